//! How much vibration the integer cascade leaves, at one frequency and over a box.

use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_firmware::shaper::residual::residual_vibration;

/// Points of the search per period of the residual's ripple over frequency. The peak of a sine between two
/// of 64 points per period is missed by at most (π/64)²/2 = 0.12 % of itself.
const POINTS_PER_RIPPLE: f64 = 64.0;

/// The fewest and the most points of the search.
const POINTS: (f64, f64) = (256.0, 65_536.0);

/// Residual vibration of the table's integer taps for one mode, as a fraction of what the unshaped command
/// leaves (0 is still, 1 is unshaped). Vibration of a cascade is the product over its stages.
pub fn cascade_residual(table: &ShaperTable, frequency_hz: f64, damping_ratio: f64) -> f64 {
    let tick_period_s = table.tick_rate().period_s();
    let stages = table.stages();
    stages
        .map(|stage| residual_vibration(stage.impulses(tick_period_s), frequency_hz, damping_ratio))
        .product()
}

/// The largest [`cascade_residual`] over frequencies within ±`fraction` of `frequency_hz`, both ends included.
///
/// `fraction` is at least 0 and below 1.
pub fn worst_residual(table: &ShaperTable, frequency_hz: f64, damping_ratio: f64, fraction: f64) -> f64 {
    let half_width_hz = frequency_hz * fraction;
    // Over frequency the residual ripples with a period of at least one over the shaper's length.
    let ripples = 2.0 * half_width_hz * table.duration_s();
    let points = (POINTS_PER_RIPPLE * ripples).clamp(POINTS.0, POINTS.1).ceil() as u32;
    (0..=points)
        .map(|point| {
            let place = 2.0 * f64::from(point) / f64::from(points) - 1.0;
            cascade_residual(table, frequency_hz + half_width_hz * place, damping_ratio)
        })
        .fold(0.0, f64::max)
}
