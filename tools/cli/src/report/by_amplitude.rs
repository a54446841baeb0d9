//! A mode by its amplitude: backbone and damping curve with their bands.

use stillbeam_identify::{AmplitudePoint, Estimate, IdentifiedMode, IdentifiedModes};

use super::plot::{Chart, Series, Style};

/// Fewer points than this are no curve.
const FEWEST: usize = 3;

/// Two charts for every mode that was seen at several amplitudes.
pub fn charts(modes: &IdentifiedModes) -> Vec<(Chart, String)> {
    let seen = modes.modes.iter().filter(|mode| mode.by_amplitude.len() >= FEWEST);
    seen.flat_map(|mode| {
        let backbone =
            curve(mode, "Backbone", "frequency (Hz)", |point| point.frequency_hz, mode.frequency_hz);
        let damping =
            curve(mode, "Damping curve", "damping ratio", |point| point.damping_ratio, mode.damping_ratio);
        let caption =
            "Dashed: two standard errors either way. Grey: the value for the whole record.".to_owned();
        [(backbone, caption.clone()), (damping, caption)]
    })
    .collect()
}

fn curve(
    mode: &IdentifiedMode,
    title: &str,
    y_label: &str,
    pick: fn(&AmplitudePoint) -> Estimate,
    whole: Estimate,
) -> Chart {
    let mut points = mode.by_amplitude.clone();
    points.sort_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
    let largest = points.last().map_or(1.0, |point| point.amplitude);
    let at = |point: &AmplitudePoint| 20.0 * (point.amplitude / largest).log10();
    let line = |shift: f64| {
        let value = |point: &AmplitudePoint| pick(point).value + shift * pick(point).stderr;
        points.iter().map(|point| (at(point), value(point))).collect::<Vec<_>>()
    };
    let ends = [points.first(), points.last()].into_iter().flatten();
    let level = ends.map(|point| (at(point), whole.value)).collect();
    Chart::new(
        format!("{title} of the mode at {:.4} Hz", mode.frequency_hz.value),
        "amplitude below its largest (dB)",
        y_label,
    )
    .with(Series::line("whole record", level).styled(Style::Reference))
    .with(Series::line("by amplitude", line(0.0)))
    .with(Series::line("± 2 standard errors", line(2.0)).styled(Style::Dashed))
    .with(Series::line("", line(-2.0)).styled(Style::Dashed))
}
