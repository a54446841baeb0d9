//! The report of `identify`.

use maud::{Markup, html};
use stillbeam_identify::{Estimate, IdentifiedModes};

use super::page::{figure, page, warnings};
use super::plot::{Chart, Series, Style};
use super::{axis_chart, by_amplitude, choice, frequency_response, second_opinions};
use crate::identification::axis_shapers::{AXIS_COLUMNS, AxisShapers};

/// Periods of the slowest mode in the close view.
const SHOWN_PERIODS: f64 = 12.0;

/// The page for one or more results, with what the classical methods see; before them the shapers of the
/// axes, if any.
pub fn identify_page(results: &[&IdentifiedModes], axes: &[AxisShapers]) -> String {
    let body = html! {
        h1 { "Identified modes" }
        @for axis in axes {
            h2 { "Shaper for " (axis.axis()) }
            pre { (axis) }
            (figure(&axis_chart::left_over_frequency(axis), "What every type leaves of a vibration, over its frequency. The area is what may be left of the modes over their boxes."))
        }
        @if !axes.is_empty() { p.muted { (AXIS_COLUMNS) "." } }
        @for modes in results {
            h2 { (modes.recording) }
            p {
                @match &modes.input {
                    None if modes.band_hz.is_some() => { "Function of frequency " code { (modes.output) } "." },
                    Some(input) => { "Forced record: output " code { (modes.output) } ", input " code { (input) } "." },
                    None => { "Free decay of " code { (modes.output) } "." },
                }
                @match modes.band_hz {
                    Some([low, high]) => { " Fitted from " (format!("{low:.3}")) " Hz to " (format!("{high:.3}")) " Hz" },
                    None => {
                        " Fitted from " (format!("{:.3}", modes.window_s[0])) " s to "
                        (format!("{:.3}", modes.window_s[1])) " s"
                    },
                }
                "; what is left has an rms of " (format!("{:.3e}", modes.residual_rms)) " in the output's unit."
            }
            (mode_table(modes))
            @if !modes.linearity.statement.is_empty() { p.note { (modes.linearity.statement) } }
            (warnings(modes.warnings.iter().map(|warning| warning.message.as_str())))
            @for chart in charts(modes) { (figure(&chart, "")) }
            @for (chart, caption) in by_amplitude::charts(modes) { (figure(&chart, &caption)) }
            (choice::section(modes))
            (second_opinions::section(&modes.survey))
        }
    };
    page("Identified modes", &body)
}

/// Frequencies and damping ratios with their standard errors.
pub fn mode_table(modes: &IdentifiedModes) -> Markup {
    html! {
        table {
            thead { tr {
                th { "mode" } th { "frequency (Hz)" } th { "± (Hz)" } th { "damping ratio" } th { "±" }
                th { "largest amplitude (output unit)" } th { "participation" }
            } }
            tbody {
                @for (number, mode) in (1..).zip(&modes.modes) {
                    tr {
                        td { (number) }
                        td { (format!("{:.5}", mode.frequency_hz.value)) }
                        td { (format!("{:.1e}", mode.frequency_hz.stderr)) }
                        td { (format!("{:.6}", mode.damping_ratio.value)) }
                        td { (format!("{:.1e}", mode.damping_ratio.stderr)) }
                        td { (format!("{:.3e}", mode.amplitude.value)) }
                        td { (mode.participation.map_or("–".to_owned(), |Estimate { value, .. }| format!("{value:.4}"))) }
                    }
                }
            }
        }
        @if let Some(real) = &modes.real_pole { p { (real.words()) } }
        p.muted { "± is one standard error, robust to coloured residuals." }
    }
}

/// Fit in time, and response or spectrum.
pub fn charts(modes: &IdentifiedModes) -> Vec<Chart> {
    let fit = &modes.fit;
    let pairs = |values: &[f64]| fit.time_s.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    let mut charts = Vec::new();
    if !fit.time_s.is_empty() {
        let left = fit.measured.iter().zip(&fit.fitted).map(|(measured, fitted)| measured - fitted);
        let left: Vec<f64> = left.collect();
        let whole = Chart::new("Recorded output and fit", "time (s)", modes.output.clone())
            .with(Series::line("recorded", pairs(&fit.measured)).styled(Style::Reference))
            .with(Series::line("fitted", pairs(&fit.fitted)))
            .with(Series::line("recorded minus fitted", pairs(&left)));
        let loudest = fit.measured.iter().zip(&fit.time_s).max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let slowest_hz = modes.modes.iter().map(|mode| mode.frequency_hz.value).fold(f64::INFINITY, f64::min);
        if let Some((_, middle_s)) = loudest.filter(|_| slowest_hz.is_finite()) {
            let half_s = 0.5 * SHOWN_PERIODS / slowest_hz;
            let [first_s, last_s] = modes.window_s;
            let mut close = whole.clone();
            close.title = "The same around its largest deflection".to_owned();
            close.x_range = Some(((middle_s - half_s).max(first_s), (middle_s + half_s).min(last_s)));
            charts.push(whole);
            charts.push(close);
        } else {
            charts.push(whole);
        }
    }
    charts.extend(frequency_response::chart(modes));
    if let Some(spectrum) = &modes.spectrum {
        let points = spectrum.frequency_hz.iter().copied().zip(spectrum.density.iter().copied());
        let mut chart = Chart::new("Spectrum", "frequency (Hz)", "power density (unit²/Hz)")
            .with(Series::line("spectrum", points.collect()));
        chart.log_y = true;
        for mode in &modes.modes {
            chart.marks.push((mode.frequency_hz.value, format!("{:.4} Hz", mode.frequency_hz.value)));
        }
        charts.push(chart);
    }
    charts
}
