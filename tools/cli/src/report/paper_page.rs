//! The report of `paper`.

use maud::{Markup, html};
use stillbeam_firmware::shaper::ShaperType;

use super::page::{figure, page};
use super::plot::{Chart, Series, Style};
use crate::demo::cases::Case;
use crate::paper::PaperResult;
use crate::paper::moves::PaperMove;
use crate::paper::sections::{Figure, Section, Table, introduction, sections};

/// Seconds of a move that are shown.
const MOVE_S: f64 = 4.0;

/// Seconds of free vibration that are shown.
const RESPONSE_S: f64 = 8.0;

/// The page of a finished run.
pub fn paper_page(result: &PaperResult) -> String {
    let body = html! {
        h1 { "The paper, made again" }
        p.note { (introduction(result)) }
        @for section in sections(result) { (part(&section, result)) }
        p.muted { "Took " (format!("{:.1}", result.seconds)) " s. Every printed equation is checked in docs/errata.md." }
    };
    page("stillbeam paper", &body)
}

fn part(section: &Section, result: &PaperResult) -> Markup {
    let charts = match section.figure {
        Some(Figure::Spectra) => vec![spectra(result)],
        Some(Figure::FreeVibration) => vec![free_vibration(result)],
        Some(Figure::Responses) => responses(result),
        Some(Figure::Moves) => moves(&result.moves),
        None => Vec::new(),
    };
    html! {
        h2 { (section.title) }
        @for paragraph in &section.text { p { (paragraph) } }
        @if let Some(rows) = &section.table { (table(rows)) }
        @for (chart, caption) in charts { (figure(&chart, &caption)) }
        @for paragraph in &section.notes { p { (paragraph) } }
    }
}

fn table(table: &Table) -> Markup {
    let printed: Vec<bool> = table.head.iter().map(|head| head.contains("paper")).collect();
    let class = |paper: &bool| if *paper { "paper" } else { "" };
    html! {
        table.dense {
            thead { tr { @for (head, paper) in table.head.iter().zip(&printed) { th class=(class(paper)) { (head) } } } }
            tbody {
                @for row in &table.rows {
                    tr { @for (cell, paper) in row.iter().zip(&printed) { td class=(class(paper)) { (cell) } } }
                }
            }
        }
    }
}

/// Fig. 4.
fn spectra(result: &PaperResult) -> (Chart, String) {
    let mut chart = Chart::new(
        "Tip over base: one Hamming-windowed transform of each record",
        "frequency (Hz)",
        "magnitude (m/m)",
    );
    for sweep in &result.sweeps {
        chart = chart.with(Series::line(sweep.printed.name(), sweep.spectrum.points()));
    }
    let true_magnitude = |hz: f64| {
        let (mut real, mut imag) = (0.0, 0.0);
        for mode in &result.true_modes {
            let gain = mode.participation.first().copied().unwrap_or(0.0) * hz * hz;
            let stiffness = mode.frequency_hz.powi(2) - hz * hz;
            let damping = 2.0 * mode.damping_ratio * mode.frequency_hz * hz;
            let square = stiffness * stiffness + damping * damping;
            real += gain * stiffness / square;
            imag -= gain * damping / square;
        }
        real.hypot(imag)
    };
    let points = (40..=3200).map(|k| 0.0025 * f64::from(k)).map(|hz| (hz, true_magnitude(hz))).collect();
    chart = chart.with(Series::line("the beam itself", points).styled(Style::Dashed));
    chart.log_y = true;
    chart.x_range = Some((0.0, 8.0));
    chart.height = 380;
    let caption = "As the paper's Fig. 4. The dashed peaks are the modes; what the records show instead is how long they were and how fast the sweep passed.";
    (chart, caption.to_owned())
}

fn free_vibration(result: &PaperResult) -> (Chart, String) {
    let points = result.decrement.tip.iter().copied().take_while(|(time_s, _)| *time_s <= RESPONSE_S);
    let chart = Chart::new("Free vibration after the unshaped move", "time (s)", "tip deflection (mm)")
        .with(Series::line("", points.collect()));
    (chart, "The ripple is the second mode; it is what moves the peaks.".to_owned())
}

/// Fig. 5.
fn responses(result: &PaperResult) -> Vec<(Chart, String)> {
    let Some(unshaped) = result.moves.first() else { return Vec::new() };
    let beam = unshaped.simulated.points(&unshaped.simulated.tip_deflection_m, RESPONSE_S, 1e3);
    let charts = result.responses.iter().map(|response| {
        let mut chart = Chart::new(response.name.clone(), "time (s)", "tip deflection (mm)")
            .with(Series::line("the beam", beam.clone()).styled(Style::Reference))
            .with(
                Series::line(
                    "the model",
                    unshaped.simulated.points(&response.tip_deflection_m, RESPONSE_S, 1e3),
                )
                .styled(Style::Dashed),
            );
        chart.height = 220;
        (chart, String::new())
    });
    charts.collect()
}

/// Figs. 6 to 9.
fn moves(moves: &[PaperMove]) -> Vec<(Chart, String)> {
    let figures: [(&str, &[(ShaperType, usize)]); 4] = [
        ("Fig. 6: single-mode ZV", &[(ShaperType::Zv, 1)]),
        ("Fig. 7: single-mode ZVD and ZVDD", &[(ShaperType::Zvd, 1), (ShaperType::Zvdd, 1)]),
        ("Fig. 8: two-mode ZV", &[(ShaperType::Zv, 2)]),
        ("Fig. 9: two-mode ZVD and ZVDD", &[(ShaperType::Zvd, 2), (ShaperType::Zvdd, 2)]),
    ];
    let charts = figures.into_iter().map(|(title, shown)| {
        let mut chart = Chart::new(title, "time (s)", "tip position (mm)");
        let is_shown = |case: &Case| case.shaper.is_none_or(|shaper| shown.contains(&(shaper, case.modes)));
        for outcome in moves.iter().filter(|outcome| is_shown(&outcome.case)) {
            let points = outcome.simulated.points(&outcome.simulated.tip_position_m, MOVE_S, 1e3);
            let series = match outcome.case.shaper {
                Some(_) => Series::line(outcome.case.name(), points),
                None => Series::line("no shaper", points).styled(Style::Reference),
            };
            chart = chart.with(series);
        }
        chart.marks.extend(
            moves
                .iter()
                .filter(|outcome| outcome.case.shaper.is_some() && is_shown(&outcome.case))
                .map(|outcome| (outcome.command_end_s, "command's end".to_owned())),
        );
        (chart, String::new())
    });
    charts.collect()
}
