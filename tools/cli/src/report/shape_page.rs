//! The report of `shape`.

use maud::html;
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_shape::{ModeBox, ShaperDesign, cascade_residual};

use super::page::{figure, page};
use super::plot::{Chart, Series, Style};

/// Points of the residual's curve.
const POINTS: u32 = 4000;

/// The page for one design; `table` is the same design as the core runs it, `boxes` those it was judged over, which
/// `described` puts in words.
pub fn shape_page(design: &ShaperDesign, table: &ShaperTable, boxes: &[ModeBox], described: &str) -> String {
    let impulses = design.impulses.iter().map(|impulse| (1e3 * impulse.time_s, impulse.amplitude)).collect();
    let impulse_chart = Chart::new("Impulses in continuous time", "time (ms)", "amplitude")
        .with(Series::line("", impulses).styled(Style::Stems));
    let body = html! {
        h1 { "Shaper" }
        p {
            "Tick rate " (design.rate_hz) " Hz, duration " (format!("{:.4}", design.duration_s)) " s, delay of a ramp "
            (format!("{:.4}", design.delay_s)) " s, CRC " code { (design.crc32) } "."
        }
        p { "Boxes: " (described) "." }
        table {
            thead { tr {
                th { "mode" } th { "frequency (Hz)" } th { "damping ratio" } th { "type" } th { "taps" }
                th { "residual, nominal (%)" } th { "worst in its box (%)" }
            } }
            tbody {
                @for (index, area) in boxes.iter().enumerate() {
                    tr {
                        td { (index + 1) } td { (area.nominal_hz()) } td { (area.nominal_damping_ratio()) }
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
        p.muted {
            "Residual: amplitude of the vibration left behind, relative to the unshaped command, computed from the integer taps that the board runs."
        }
        (figure(&residual_chart(boxes, table), "The marked frequencies are those designed for; the flatter the curve there, the further they may be off."))
        (figure(&impulse_chart, ""))
    };
    page("Shaper", &body)
}

fn percent(fraction: Option<&f64>) -> String {
    fraction.map_or_else(String::new, |fraction| format!("{:.5}", 100.0 * fraction))
}

/// Residual over frequency, with the damping of the mode nearest to each frequency.
fn residual_chart(boxes: &[ModeBox], table: &ShaperTable) -> Chart {
    let highest_hz = boxes.iter().map(ModeBox::nominal_hz).fold(0.0, f64::max);
    let last_hz = (1.6 * highest_hz).min(0.5 * table.tick_rate().hz());
    let points = (1..=POINTS).map(|point| {
        let hz = last_hz * f64::from(point) / f64::from(POINTS);
        let distance = |area: &&ModeBox| (area.nominal_hz() / hz).ln().abs();
        let nearest = boxes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let damping_ratio = nearest.map_or(0.0, ModeBox::nominal_damping_ratio);
        (hz, 100.0 * cascade_residual(table, hz, damping_ratio))
    });
    let mut chart = Chart::new("Residual vibration over frequency", "frequency (Hz)", "residual (%)")
        .with(Series::line("", points.collect()));
    for area in boxes {
        chart.marks.push((area.nominal_hz(), format!("{} Hz", area.nominal_hz())));
    }
    chart
}
