//! The report of `demo`.

use maud::{Markup, html};
use stillbeam_firmware::shaper::ShaperType;
use stillbeam_plant::{SETPOINT, TIP_DEFLECTION};

use super::identify_page::{charts, mode_table};
use super::page::{figure, page, warnings};
use super::plot::{Chart, Series, Style};
use crate::demo::cases::Case;
use crate::demo::moves::{MoveResult, TARGET_MM};
use crate::demo::rig::CAMERA_NOISE_M;
use crate::demo::{DEFINITIONS, DemoResult};

/// Seconds of a move in the plots of the tip.
const SHOWN_S: f64 = 6.0;

/// The page of a finished demo.
pub fn demo_page(result: &DemoResult) -> String {
    let body = html! {
        h1 { "From a sweep to a still beam" }
        p {
            "A flexible beam on a moving base is swept, its first two modes are identified from the record, six input "
            "shapers are designed from them, and the same move of " (TARGET_MM) " mm is made with each: the experiment of "
            "Pham, Kim, Nguyen and Hong (2021)."
        }
        p.note {
            strong { "What is real here: " } "the board side is " (result.board.description())
            "; every setpoint was computed by it and streamed over its console. "
            strong { "What is simulated: " } "the beam (" code { "models/paper_beam.toml" } ", ideal drive) and the camera, with "
            (format!("{:.0}", 1e6 * CAMERA_NOISE_M)) " µm rms of noise on every frame. The paper's columns are measurements on its testbed."
        }
        p.muted { "The board says: " (result.board_info.join(", ")) ". The demo took " (format!("{:.1}", result.seconds)) " s." }
        (results(result))
        h2 { "The moves" }
        @for (chart, caption) in move_charts(&result.moves) { (figure(&chart, caption)) }
        h2 { "The sweep" }
        p { code { (result.sweep_command) } ", unshaped, and the tip as the camera saw it." }
        @for chart in sweep_charts(result) { (figure(&chart, "")) }
        h2 { "Identified modes" }
        (mode_table(&result.identified))
        (truth(result))
        (warnings(result.identified.warnings.iter().map(|warning| warning.message.as_str())))
        @for chart in charts(&result.identified) { (figure(&chart, "")) }
        h2 { "The shapers" }
        (shapers(&result.moves))
    };
    page("stillbeam demo", &body)
}

fn results(result: &DemoResult) -> Markup {
    let summary = result.summary();
    html! {
        h2 { "Results" }
        table {
            thead {
                tr { th { "" } th colspan="3" { "this run" } th.paper colspan="3" { "paper, Table 2" } }
                tr {
                    th { "shaper" }
                    th { "settling (s)" } th { "overshoot (%)" } th { "vibration (%)" }
                    th.paper { "settling (s)" } th.paper { "overshoot (%)" } th.paper { "vibration (%)" }
                }
            }
            tbody {
                @for (row, outcome) in summary.moves.iter().zip(&result.moves) {
                    tr {
                        td { (row.shaper) }
                        td { (row.settling_time_s.map_or("never".to_owned(), |seconds| format!("{seconds:.2}"))) }
                        td { (format!("{:.2}", row.overshoot_pct)) }
                        td { (format!("{:.4}", row.percentage_vibration_pct)) }
                        @match outcome.case.paper {
                            Some(paper) => {
                                td.paper { (format!("{:.2}", paper.settling_time_s)) }
                                td.paper { (format!("{:.2}", paper.overshoot_pct)) }
                                td.paper { (format!("{:.2}", paper.percentage_vibration_pct)) }
                            }
                            None => { td.paper { "–" } td.paper { "–" } td.paper { "–" } }
                        }
                    }
                }
            }
        }
        dl { @for (name, meaning) in DEFINITIONS { dt { (name) } dd { (meaning) "." } } }
        p.muted {
            "The paper does not print its definitions of settling and overshoot, its move profile or its unshaped case. Its settling times "
            "are about those of move and shaper together even where several percent of vibration are left, so its band must be wider than "
            "ours. A testbed also has friction, a servo that lags and modes that are only nearly those it was designed for: compare the "
            "order of the rows rather than the numbers."
        }
    }
}

/// Title, shapers shown (type and number of modes) and caption of a chart.
type Pairing = (&'static str, &'static [(ShaperType, usize)], &'static str);

/// The pairings of the paper's Figs. 6 to 9, and then the setpoints.
fn move_charts(moves: &[MoveResult]) -> Vec<(Chart, &'static str)> {
    let figures: [Pairing; 4] = [
        ("single-mode ZV", &[(ShaperType::Zv, 1)], "As the paper's Fig. 6. What is left is the second mode."),
        (
            "single-mode ZVD and ZVDD",
            &[(ShaperType::Zvd, 1), (ShaperType::Zvdd, 1)],
            "As the paper's Fig. 7.",
        ),
        ("two-mode ZV", &[(ShaperType::Zv, 2)], "As the paper's Fig. 8."),
        ("two-mode ZVD and ZVDD", &[(ShaperType::Zvd, 2), (ShaperType::Zvdd, 2)], "As the paper's Fig. 9."),
    ];
    let mut charts: Vec<(Chart, &'static str)> = Vec::new();
    for (title, shown, caption) in figures {
        let mut chart = Chart::new(format!("Tip position, {title}"), "time (s)", "tip position (mm)");
        let is_shown = |case: &Case| case.shaper.is_none_or(|shaper| shown.contains(&(shaper, case.modes)));
        for result in moves.iter().filter(|result| is_shown(&result.case)) {
            let points = result.simulated.points(&result.simulated.tip_position_m, SHOWN_S, 1e3);
            chart = chart.with(curve(result, points));
        }
        charts.push((chart, caption));
    }
    let mut chart = Chart::new("Setpoints as the board streamed them", "time (s)", "setpoint (mm)");
    let longest_s = moves.iter().map(|result| result.streamed_s).fold(0.0, f64::max);
    for result in moves {
        let points = result.simulated.points(&result.simulated.setpoint_m, longest_s, 1e3);
        chart = chart.with(curve(result, points));
    }
    charts.push((chart, "The last setpoint is held after the end of each stream."));
    charts
}

fn curve(result: &MoveResult, points: Vec<(f64, f64)>) -> Series {
    match result.case.shaper {
        Some(_) => Series::line(result.case.name(), points),
        None => Series::line("no shaper", points).styled(Style::Reference),
    }
}

fn sweep_charts(result: &DemoResult) -> Vec<Chart> {
    let sweep = &result.sweep;
    let signals = [
        (SETPOINT, "Setpoint during the sweep", "setpoint (mm)"),
        (TIP_DEFLECTION, "Tip during the sweep", "tip deflection (mm)"),
    ];
    let charts = signals.into_iter().map(|(column, title, label)| {
        // Frames are further apart than setpoints: the empty cells between them are no gaps in the curve.
        let samples = sweep.column(column).unwrap_or_default();
        let points = sweep.time_s.iter().zip(samples).filter(|(_, sample)| !sample.is_nan());
        let points = points.map(|(time_s, sample)| (*time_s, 1e3 * sample)).collect();
        let mut chart = Chart::new(title, "time (s)", label).with(Series::line("", points));
        chart.height = 240;
        chart
    });
    charts.collect()
}

fn truth(result: &DemoResult) -> Markup {
    html! {
        p {
            "The simulated beam was given "
            @for (index, mode) in result.true_modes.iter().enumerate() {
                @if index > 0 { " and " }
                (format!("{:.5} Hz with damping ratio {:.4}", mode.frequency_hz, mode.damping_ratio))
            }
            "; the identification was told only the record."
        }
    }
}

fn shapers(moves: &[MoveResult]) -> Markup {
    html! {
        table {
            thead { tr {
                th { "shaper" } th { "duration (s)" } th { "delay (s)" } th { "worst residual, mode 1 (%)" }
                th { "mode 2 (%)" } th { "CRC, host and board" }
            } }
            tbody {
                @for result in moves {
                    @if let Some(design) = &result.design {
                        tr {
                            td { (result.case.name()) }
                            td { (format!("{:.3}", design.duration_s)) }
                            td { (format!("{:.3}", design.delay_s)) }
                            @for mode in 0..2 {
                                td { (design.residual.worst_over_box.get(mode).map_or("not shaped".to_owned(), |worst| format!("{:.3}", 100.0 * worst))) }
                            }
                            td { code { (result.crc32) } }
                        }
                    }
                }
            }
        }
        p.muted { "Worst residual: with the mode's frequency anywhere within ±5 % of the one designed for." }
    }
}
