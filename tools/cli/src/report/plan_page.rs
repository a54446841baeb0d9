//! The report of `plan`.

use maud::html;
use stillbeam_shape::MoveRequest;

use super::page::{figure, page};
use super::plot::{Chart, Series};
use crate::shaping::ComparedMove;

/// The page for one move and what it is compared with; `described` puts the boxes in words.
pub fn plan_page(request: &MoveRequest, moves: &[ComparedMove], described: &str) -> String {
    let bounds = &request.bounds;
    let body = html! {
        h1 { "Move" }
        p {
            (1e3 * request.distance_m) " mm within " (1e3 * bounds.velocity_m_s) " mm/s, "
            (1e3 * bounds.acceleration_m_s2) " mm/s² and " (1e3 * bounds.jerk_m_s3) " mm/s³, at " (request.rate_hz)
            " Hz. No mode in its box may keep more than " (100.0 * request.tolerance)
            " % of what a step of this distance leaves. Boxes: " (described) "."
        }
        table {
            thead { tr {
                th { "move" } th { "duration (s)" }
                @for area in &request.modes { th { "worst at " (area.nominal_hz()) " Hz (%)" } }
            } }
            tbody {
                @for compared in moves {
                    tr {
                        td { (compared.name) } td { (format!("{:.5}", compared.duration_s)) }
                        @for worst in &compared.worst_over_box { td { (format!("{:.4}", 100.0 * worst)) } }
                    }
                }
            }
        }
        (figure(&chart("Position", "position (mm)", moves, &|ticks, index| 1e-6 * ticks.get(index).copied().unwrap_or(0) as f64, request.rate_hz), ""))
        (figure(&chart("Velocity", "velocity (mm/s)", moves, &|ticks, index| velocity(ticks, index, request.rate_hz), request.rate_hz),
            "As played, tick by tick."))
    };
    page("Move", &body)
}

/// Over a few ticks, so that rounding to nanometres does not show.
fn velocity(positions_nm: &[i64], index: usize, rate_hz: f64) -> f64 {
    const TICKS: usize = 4;
    let at = |index: usize| positions_nm.get(index).or(positions_nm.last()).copied().unwrap_or(0);
    let before = index.saturating_sub(TICKS);
    1e-6 * (at(index) - at(before)) as f64 * rate_hz / TICKS as f64
}

fn chart(
    title: &str,
    label: &str,
    moves: &[ComparedMove],
    value: &dyn Fn(&[i64], usize) -> f64,
    rate_hz: f64,
) -> Chart {
    let mut chart = Chart::new(title, "time (s)", label);
    for compared in moves {
        let points = (0..compared.positions_nm.len())
            .map(|index| (index as f64 / rate_hz, value(&compared.positions_nm, index)));
        chart = chart.with(Series::line(compared.name, points.collect()));
    }
    chart
}
