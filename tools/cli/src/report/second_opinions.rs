//! What the classical methods see in a record: their modes side by side, and the stabilisation charts.

use maud::{Markup, html};
use stillbeam_identify::poles::{PoleVerdict, StabilisationChart, Survey};

use super::page::figure;
use super::plot::{Chart, Series, Style};

/// The verdicts as the chart groups them, drawn in this order.
const GROUPS: [(&str, &[PoleVerdict]); 3] = [
    ("stable", &[PoleVerdict::Stable]),
    ("damping moves with the order", &[PoleVerdict::DampingMoves]),
    ("new, growing or overdamped", &[PoleVerdict::New, PoleVerdict::Unstable, PoleVerdict::Overdamped]),
];

/// A table of all methods' modes and a stabilisation chart for each method that has one.
pub fn section(survey: &Survey) -> Markup {
    html! {
        h3 { "Second opinions" }
        p.muted {
            "Methods that do not fit the record in time. They see leakage where a mode rings for longer than the record resolves; ± is the scatter "
            "over model orders, which does not know of that. What each gets wrong on a record of exactly the fitted modes is part of the standard error "
            "of the cross-checks in the JSON; a method that is further from the fit than three of those is among the warnings."
        }
        @if survey.modes.is_empty() { p { "None of the methods found a mode." } } @else { (modes(survey)) }
        @for chart in survey.charts.iter().filter(|chart| !chart.picks.is_empty()) {
            (figure(&stabilisation(chart), ""))
            (picks(chart))
        }
    }
}

fn modes(survey: &Survey) -> Markup {
    let error = |stderr: Option<f64>| stderr.map_or("–".to_owned(), |stderr| format!("{stderr:.1e}"));
    html! {
        table {
            thead { tr { th { "method" } th { "frequency (Hz)" } th { "±" } th { "damping ratio" } th { "±" } } }
            tbody {
                @for mode in &survey.modes {
                    tr {
                        td { (mode.method.words()) }
                        td { (format!("{:.5}", mode.frequency_hz)) }
                        td { (error(mode.frequency_stderr_hz)) }
                        td { (format!("{:.6}", mode.damping_ratio)) }
                        td { (error(mode.damping_stderr)) }
                    }
                }
            }
        }
    }
}

/// Poles over model order; picked modes are marked.
pub fn stabilisation(chart: &StabilisationChart) -> Chart {
    let mut plot =
        Chart::new(format!("Stabilisation chart: {}", chart.method.words()), "frequency (Hz)", "model order");
    for (label, verdicts) in GROUPS {
        let inside = chart.poles.iter().filter(|pole| verdicts.contains(&pole.verdict));
        let mut points: Vec<(f64, f64)> = inside.map(|pole| (pole.frequency_hz, pole.order as f64)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !points.is_empty() {
            plot = plot.with(Series::line(label, points).styled(Style::Dots));
        }
    }
    plot.x_range = Some((chart.band_hz[0], chart.band_hz[1]));
    plot.marks = chart.picks.iter().map(|p| (p.frequency_hz, format!("{:.4} Hz", p.frequency_hz))).collect();
    plot
}

/// Picked and rejected groups, each with what decided.
fn picks(chart: &StabilisationChart) -> Markup {
    html! {
        details {
            summary { (chart.picks.len()) " picked, " (chart.rejected.len()) " groups rejected" }
            table {
                thead { tr { th { "frequency (Hz)" } th { "damping ratio" } th { "" } } }
                tbody {
                    @for pick in &chart.picks {
                        tr {
                            td { (format!("{:.5}", pick.frequency_hz)) }
                            td { (format!("{:.6}", pick.damping_ratio)) }
                            td {
                                "picked: stable at " (pick.orders) " orders, which agree within "
                                (format!("{:.1e}", pick.frequency_spread_hz)) " Hz and "
                                (format!("{:.1e}", pick.damping_spread))
                            }
                        }
                    }
                    @for rejected in &chart.rejected {
                        tr {
                            td { (format!("{:.5}", rejected.frequency_hz)) }
                            td { (format!("{:.6}", rejected.damping_ratio)) }
                            td { "rejected: " (rejected.reason) }
                        }
                    }
                }
            }
        }
    }
}
