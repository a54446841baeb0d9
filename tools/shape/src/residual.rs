//! How much vibration a table's integers leave at one frequency.

use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_firmware::shaper::residual::residual_vibration;

/// Residual vibration of the table's integer taps for one mode, as a fraction of what the unshaped command
/// leaves (0 is still, 1 is unshaped). Vibration of a cascade is the product over its stages.
pub fn cascade_residual(table: &ShaperTable, frequency_hz: f64, damping_ratio: f64) -> f64 {
    let tick_period_s = table.tick_rate().period_s();
    let stages = table.stages();
    stages
        .map(|stage| residual_vibration(stage.impulses(tick_period_s), frequency_hz, damping_ratio))
        .product()
}
