//! Charts that set a shaper beside the others: residual over frequency, and against duration.

use stillbeam_shape::{ModeBox, OptimalRequest, cascade_residual};

use super::plot::{Chart, Series, Style};
use crate::shaping::Candidate;

/// Points of a curve over frequency.
const POINTS: u32 = 400;
/// Points of the curve against duration, for up to two modes and for more, which take longer to solve for.
const DURATIONS: (u32, u32) = (44, 18);
/// Points that are solved for before looking whether the next ones would still be drawn.
const AT_ONCE: usize = 3;
/// Residuals below this, in per cent, are drawn there: integers and exact zeros have no place on a
/// logarithmic axis.
const FLOOR_PERCENT: f64 = 1e-3;

/// Residual over frequency around one mode, for this shaper and the others; the tolerance is a fraction.
pub fn sensitivity_chart(
    area: &ModeBox,
    title: &str,
    own: &Candidate,
    others: &[Candidate],
    tolerance: f64,
) -> Chart {
    let [low_hz, high_hz] = area.frequency_hz();
    let margin_hz = (1.5 * (high_hz - low_hz)).max(0.08 * area.nominal_hz());
    let (from_hz, to_hz) = ((low_hz - margin_hz).max(0.05 * area.nominal_hz()), high_hz + margin_hz);
    let curve = |candidate: &Candidate| {
        (0..=POINTS)
            .map(|point| {
                let hz = from_hz + (to_hz - from_hz) * f64::from(point) / f64::from(POINTS);
                let left = cascade_residual(&candidate.table, hz, area.nominal_damping_ratio());
                (hz, (100.0 * left).max(FLOOR_PERCENT))
            })
            .collect()
    };
    let mut chart = Chart::new(title, "frequency (Hz)", "residual (%)");
    chart.log_y = true;
    chart.height = 360;
    chart.areas.push([low_hz, high_hz, FLOOR_PERCENT, 100.0 * tolerance]);
    chart.marks.push((area.nominal_hz(), String::new()));
    chart = chart.with(Series::line("this one", curve(own)));
    for other in others {
        chart = chart.with(Series::line(&other.name, curve(other)).styled(Style::Dashed));
    }
    chart
}

/// The least residual against duration, and where this shaper and the others are; the tolerance is a
/// fraction. `None` when the solver gives up.
pub fn pareto_chart(
    boxes: &[ModeBox],
    rate_hz: f64,
    tolerance: f64,
    own: &Candidate,
    others: &[Candidate],
) -> Option<Chart> {
    let all = || std::iter::once(own).chain(others);
    let longest_s = all().map(|candidate| candidate.table.duration_s()).fold(0.0, f64::max);
    let slowest_hz = boxes.iter().map(ModeBox::nominal_hz).fold(f64::INFINITY, f64::min);
    let first_s = (0.25 / slowest_hz).min(longest_s);
    let points = if boxes.len() <= 2 { DURATIONS.0 } else { DURATIONS.1 };
    let durations_s: Vec<f64> = (0..=points)
        .map(|point| first_s + (longest_s - first_s) * f64::from(point) / f64::from(points))
        .collect();
    let request =
        OptimalRequest { modes: boxes.to_vec(), rate_hz, tolerance, negative_limit: 0.0, longest_s: None };
    let percent = |fraction: f64| (100.0 * fraction).max(FLOOR_PERCENT);
    let mut least: Vec<(f64, f64)> = Vec::new();
    for some_s in durations_s.chunks(AT_ONCE) {
        let solved = request.least_residuals(some_s).ok()?;
        least.extend(solved.into_iter().map(|(duration_s, worst)| (duration_s, percent(worst))));
        // Longer ones leave less, and take the longest to solve for.
        if least.last().is_some_and(|(_, worst)| *worst <= FLOOR_PERCENT) {
            least.push((longest_s, FLOOR_PERCENT));
            break;
        }
    }
    let lowest = least.iter().map(|(_, worst)| *worst).fold(100.0 * tolerance, f64::min);
    let mut chart = Chart::new("Residual against duration", "duration (s)", "worst residual (%)")
        .with(Series::line("", least));
    chart.log_y = true;
    chart.height = 360;
    chart.x_range = Some((0.0, 1.08 * longest_s));
    chart.areas.push([0.0, 1.08 * longest_s, lowest, 100.0 * tolerance]);
    for candidate in all() {
        chart.notes.push((candidate.table.duration_s(), percent(candidate.worst()), candidate.name.clone()));
    }
    Some(chart)
}
