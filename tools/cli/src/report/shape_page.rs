//! The report of `shape`.

use maud::{Markup, html};
use stillbeam_shape::{ModeBox, ShaperDesign, harmonic_accidents};

use super::page::{figure, page, warnings};
use super::plot::{Chart, Series, Style};
use super::shape_charts::{pareto_chart, sensitivity_chart};
use crate::shaping::Candidate;

/// Modes to shape for, and what is asked of a shaper for them.
pub struct Purpose<'p> {
    /// Where every mode may be.
    pub boxes: &'p [ModeBox],
    /// The boxes in words.
    pub described: &'p str,
    /// The most that may be left of any mode, a fraction.
    pub tolerance: f64,
    /// Why this shaper was taken, a paragraph each; nothing where it was asked for.
    pub reasons: &'p [String],
}

/// The page for one shaper, beside the others that there are for the same modes, boxes and tolerance.
pub fn shape_page(own: &Candidate, mut others: Vec<Candidate>, purpose: &Purpose<'_>) -> String {
    let Purpose { boxes, described, tolerance, reasons } = *purpose;
    let (design, cost) = (&own.design, own.cost);
    // The same shaper under its own name is no other one.
    others.retain(|other| other.table != own.table);
    let impulses = |design: &ShaperDesign| {
        design.impulses.iter().map(|impulse| (1e3 * impulse.time_s, impulse.amplitude)).collect()
    };
    let impulse_chart = Chart::new("Impulses", "time (ms)", "amplitude")
        .with(Series::line("", impulses(design)).styled(Style::Stems));
    let accidents: Vec<String> = harmonic_accidents(boxes, tolerance)
        .iter()
        .map(|accident| {
            format!(
                "Beware of a single {} at {:.3} Hz: it leaves {:.1} % of the nominal modes, because a multiple of its frequency lies near \
                 {:.4} Hz, but up to {:.0} % of that mode within its box.",
                accident.kind,
                accident.designed_hz,
                100.0 * accident.nominal,
                accident.mode_hz,
                100.0 * accident.worst
            )
        })
        .collect();
    let body = html! {
        h1 { "Shaper" }
        @for reason in reasons { p.note { (reason) } }
        p {
            "Tick rate " (design.rate_hz) " Hz, duration " (format!("{:.5}", design.duration_s)) " s, delay of a ramp "
            (format!("{:.5}", design.delay_s)) " s, CRC " code { (design.crc32) } ". On the board: " (cost.taps) " taps, "
            (cost.ram_bytes) " bytes, some " (cost.instructions) " instructions per tick."
        }
        @if let Some(optimal) = &design.optimal {
            p {
                "The shortest shaper that leaves at most " (100.0 * optimal.tolerance) " % of every mode anywhere in its box: of one tick less, "
                "every shaper leaves at least " (format!("{:.5}", 100.0 * optimal.bound_one_tick_less)) " % of some mode."
            }
        }
        p { "Boxes: " (described) "." }
        (modes_table(design, boxes))
        p.muted {
            "Residual: amplitude of the vibration left behind, relative to the unshaped command, computed from the integer taps that the board runs."
        }
        h2 { "Beside the others" }
        (candidates_table(own, &others, tolerance))
        (warnings(accidents.iter().map(String::as_str)))
        @if let Some(chart) = pareto_chart(boxes, design.rate_hz, tolerance, own, &others) {
            (figure(&chart, "Worst residual of all modes over their boxes. The line is the least that any shaper with non-negative weights can leave; the green area meets the tolerance."))
        }
        @for (index, area) in boxes.iter().enumerate() {
            (figure(&sensitivity_chart(area, &format!("Mode {}, {:.4} Hz", index + 1, area.nominal_hz()), own, &others, tolerance),
                "Green: the mode's box and the tolerance. At the nominal damping ratio."))
        }
        h2 { "Impulses" }
        (figure(&impulse_chart, "This shaper."))
        @if let Some(other) = others.iter().find(|other| other.name == if design.optimal.is_some() { "zvd" } else { "optimal" }) {
            (figure(&taps_chart(other), ""))
        }
    };
    page("Shaper", &body)
}

fn modes_table(design: &ShaperDesign, boxes: &[ModeBox]) -> Markup {
    html! {
        table {
            thead { tr {
                th { "mode" } th { "frequency (Hz)" } th { "in (Hz)" } th { "damping ratio" } th { "in" } th { "type" } th { "taps" }
                th { "residual, nominal (%)" } th { "worst in its box (%)" }
            } }
            tbody {
                @for (index, area) in boxes.iter().enumerate() {
                    tr {
                        td { (index + 1) } td { (format!("{:.5}", area.nominal_hz())) } td { (range(area.frequency_hz(), 4)) }
                        td { (format!("{:.6}", area.nominal_damping_ratio())) } td { (range(area.damping_ratio(), 5)) }
                        @match design.stages.get(index).filter(|stage| stage.frequency_hz.is_some()) {
                            Some(stage) => { td { (stage.shaper.to_string()) } td { (stage.taps.len()) } }
                            None => { td { "all at once" } td {} }
                        }
                        td { (percent(design.residual.nominal.get(index))) }
                        td { (percent(design.residual.worst_over_box.get(index))) }
                    }
                }
            }
        }
    }
}

fn candidates_table(own: &Candidate, others: &[Candidate], tolerance: f64) -> Markup {
    html! {
        table.dense {
            thead { tr {
                th { "shaper" } th { "duration (s)" } th { "delay (s)" } th { "taps" } th { "RAM (bytes)" } th { "instructions" }
                th { "nominal, each mode (%)" } th { "worst in its box, each mode (%)" } th { "within " (100.0 * tolerance) " %" }
            } }
            tbody {
                @for candidate in std::iter::once(own).chain(others) {
                    tr {
                        td { (candidate.name) }
                        td { (format!("{:.4}", candidate.table.duration_s())) } td { (format!("{:.4}", candidate.table.delay_s())) }
                        td { (candidate.cost.taps) } td { (candidate.cost.ram_bytes) } td { (candidate.cost.instructions) }
                        td { (each(&candidate.design.residual.nominal)) } td { (each(candidate.worst_over_box())) }
                        td { @if candidate.holds(tolerance) { "yes" } @else { "no" } }
                    }
                }
            }
        }
        p.muted {
            "One stage per mode, all of the same type, but for the shortest shaper, which is one flat stage. Delay: the centroid, by which a ramp lags behind. "
            "Instructions per tick beyond those without a shaper, by the measurements of the firmware."
        }
    }
}

fn taps_chart(candidate: &Candidate) -> Chart {
    let period_s = candidate.table.tick_rate().period_s();
    let mut taps = vec![(0.0, 1.0)];
    for stage in candidate.table.stages() {
        let impulses: Vec<_> = stage.impulses(period_s).collect();
        taps = taps
            .iter()
            .flat_map(|(time_ms, amplitude)| {
                impulses
                    .iter()
                    .map(move |impulse| (time_ms + 1e3 * impulse.time_s, amplitude * impulse.amplitude))
            })
            .collect();
    }
    taps.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    Chart::new(format!("Taps of {}", candidate.name), "time (ms)", "amplitude")
        .with(Series::line("", taps).styled(Style::Stems))
}

fn range([low, high]: [f64; 2], decimals: usize) -> String {
    format!("{low:.decimals$} – {high:.decimals$}")
}

fn each(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|value| format!("{:.3}", 100.0 * value)).collect();
    values.join(" · ")
}

fn percent(fraction: Option<&f64>) -> String {
    fraction.map_or_else(String::new, |fraction| format!("{:.5}", 100.0 * fraction))
}
