//! What the shapers of an axis leave of a vibration, over its frequency.

use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_shape::AxisShaper;

use super::plot::{Chart, Series, Style};
use crate::identification::axis_shapers::AxisShapers;

/// Points of a curve.
const POINTS: u32 = 400;
/// How far the picture reaches beyond the modes, as parts of the lowest and the highest frequency.
const BEYOND: (f64, f64) = (0.5, 1.6);

/// Residual of every type over frequency, the one to take in front.
pub(super) fn left_over_frequency(axis: &AxisShapers) -> Chart {
    let comparison = axis.comparison();
    let ends = axis
        .boxes_hz()
        .iter()
        .fold([f64::INFINITY, 0.0_f64], |[low, high], [from, to]| [low.min(*from), high.max(*to)]);
    let (from_hz, to_hz) = (BEYOND.0 * ends[0], BEYOND.1 * ends[1]);
    let curve = |shaper: &AxisShaper| {
        let at = |point: u32| from_hz + (to_hz - from_hz) * f64::from(point) / f64::from(POINTS);
        let left =
            |hz| 100.0 * residual_vibration(single_mode(&shaper.mode), hz, shaper.mode.damping_ratio());
        (0..=POINTS).map(at).map(|hz| (hz, left(hz))).collect::<Vec<_>>()
    };
    let mut chart = Chart::new("Vibration left", "frequency of the vibration (Hz)", "left (%)");
    chart.height = 360;
    for [low_hz, high_hz] in axis.boxes_hz() {
        chart.areas.push([*low_hz, *high_hz, 0.0, 100.0 * axis.tolerance()]);
    }
    let best = &comparison.best;
    for other in comparison.shapers.iter().filter(|other| other.mode != best.mode) {
        let name = other.mode.shaper().name();
        chart = chart.with(Series::line(name, curve(other)).styled(Style::Dashed));
    }
    chart.with(Series::line(best.mode.shaper().name(), curve(best)))
}
