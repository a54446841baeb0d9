//! The report of `diagnose`: from one sentence down to every gate.

use maud::{Markup, PreEscaped, html};
use stillbeam_diagnose::{Diagnosis, ForceSurface, Mismatch, OrderMap, Overlay, RecordRole, Verdict};

use super::diagnose_tables::{candidate_table, confusability_table, effect_list, fit_table};
use super::heat_map::HeatMap;
use super::page::{figure, page, warnings};
use super::plot::{Chart, Series, Style};

/// The page.
pub fn diagnose_page(found: &Diagnosis) -> String {
    let body = html! {
        h1 { (title(found.verdict)) }
        p.note { (found.sentence) }
        (warnings(found.caps.iter().map(String::as_str)))
        (warnings(found.ties.iter().map(|tie| tie.sentence.as_str())))
        @if let Some(next) = &found.next_experiment {
            p.note { "Next run, as a line for the console: " code { (next) } " " (found.next_experiment_reason.as_deref().unwrap_or_default()) "." }
        }
        @if let Some(controls) = &found.controls { p.note { (controls.sentence()) } }
        h2 { "How well each model fits" }
        (fit_table(found))
        @if !found.effects.is_empty() { h2 { "What was left out" } (effect_list(&found.effects)) }
        @if let Some(mismatch) = &found.mismatch { (located(mismatch)) }
        @for chart in found.overlays.iter().max_by(|a, b| by_interest(a).total_cmp(&by_interest(b))).map(overlay_charts).unwrap_or_default() {
            (figure(&chart, ""))
        }
        @for map in &found.orders { (picture(&order_picture(map))) }
        @for surface in found.surfaces.iter().take(2) { (picture(&surface_picture(surface))) (figure(&profile(surface), "Mean of the latent force over all positions, with two standard errors on either side; where a law was found here, its force in the same cells.")) }
        (parameters(found))
        @if found.confusability.candidates.len() > 1 { h2 { "How alike the candidates are here" } (confusability_table(found)) }
        h2 { "Every candidate and its gates" }
        (candidate_table(found))
        p.muted {
            "Took " (format!("{:.1}", found.seconds)) " s: " (found.cost.simulations) " simulations of a recording, "
            (found.cost.fits) " fits."
        }
    };
    page("Diagnosis", &body)
}

fn title(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "Nothing is missing",
        Verdict::Explained => "Physics was missing, and is named",
        Verdict::Improved => "Physics was missing; part of it is named",
        Verdict::Ambiguous => "Physics was missing; several candidates fit",
        Verdict::Unexplained => "Something is missing that the catalogue does not explain",
    }
}

fn located(mismatch: &Mismatch) -> Markup {
    html! {
        h2 { "Where the refitted model and the recordings differ" }
        @if let Some(link) = &mismatch.link { p { "Link: " strong { (link) } } }
        ul { @for sentence in &mismatch.sentences { li { (sentence) } } }
    }
}

/// Held-out recordings first, then those in which most was gained.
fn by_interest(overlay: &Overlay) -> f64 {
    let power = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    let gained = power(&overlay.refitted_residual);
    if overlay.role == RecordRole::HeldOut { 1e6 * gained } else { gained }
}

fn overlay_charts(overlay: &Overlay) -> Vec<Chart> {
    let points = |values: Vec<f64>| overlay.time_s.iter().copied().zip(values).collect::<Vec<_>>();
    let simulated = |residual: &[f64]| overlay.recorded.iter().zip(residual).map(|(r, e)| r - e).collect();
    let mut whole = Chart::new(
        format!("Recorded and simulated: {}", overlay.recording),
        "time (s)",
        overlay.output.clone(),
    )
    .with(Series::line("recorded", points(overlay.recorded.clone())).styled(Style::Reference))
    .with(Series::line("refitted", points(simulated(&overlay.refitted_residual))));
    let mut rest = Chart::new("Recorded minus simulated", "time (s)", overlay.output.clone())
        .with(Series::line("refitted", points(overlay.refitted_residual.clone())));
    if let Some(extended) = &overlay.extended_residual {
        whole = whole.with(Series::line("with the physics found", points(simulated(extended))));
        rest = rest.with(Series::line("with the physics found", points(extended.clone())));
    }
    let given = Chart::new("Recorded minus simulated, as given", "time (s)", overlay.output.clone())
        .with(Series::line("given", points(overlay.given_residual.clone())));
    vec![whole, rest, given]
}

fn picture(map: &HeatMap) -> Markup {
    html! { figure { (PreEscaped(map.to_svg())) } }
}

fn order_picture(map: &OrderMap) -> HeatMap {
    let orders = map.residual.first().map_or(0, |orders| orders.len());
    let most = map.residual.iter().flatten().copied().fold(f64::MIN_POSITIVE, f64::max);
    // A hundredth of the largest is where the colours begin.
    let shade = |amplitude: f64| Some((1.0 + 0.5 * (amplitude.max(1e-30) / most).log10()).max(0.0));
    let values =
        (0..orders).flat_map(|order| map.residual.iter().map(move |window| shade(window[order]))).collect();
    HeatMap {
        title: format!("Orders of the sweep in what the refitted model leaves over: {}", map.recording),
        x: (
            "frequency of the sweep, window by window (Hz)".to_owned(),
            map.frequency_hz.first().copied().unwrap_or(0.0),
            map.frequency_hz.last().copied().unwrap_or(0.0),
        ),
        y: ("order".to_owned(), 0.5, orders as f64 + 0.5),
        columns: map.residual.len(),
        values,
        unit: String::new(),
        ends: Some([format!("{most:.1e}"), format!("≤ {:.1e}", 0.01 * most)]),
        signed: false,
    }
}

fn surface_picture(surface: &ForceSurface) -> HeatMap {
    let [z0, z1, v0, v1] = surface.range;
    HeatMap {
        title: format!("Force at {} that would explain the rest", surface.location),
        x: (format!("displacement ({})", surface.displacement_unit), z0, z1),
        y: (format!("speed ({}/s)", surface.displacement_unit), v0, v1),
        columns: (surface.mean.len() as f64).sqrt().round() as usize,
        values: surface.mean.clone(),
        unit: surface.force_unit.clone(),
        ends: None,
        signed: true,
    }
}

/// The force over speed, averaged over positions.
fn profile(surface: &ForceSurface) -> Chart {
    let cells = (surface.mean.len() as f64).sqrt().round() as usize;
    let [_, _, v0, v1] = surface.range;
    let mut middle = Vec::new();
    let (mut low, mut high, mut law) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..cells {
        let range = row * cells..(row + 1) * cells;
        let known: Vec<(f64, f64)> = surface.mean[range.clone()]
            .iter()
            .zip(&surface.stderr[range])
            .filter_map(|(mean, stderr)| Some(((*mean)?, (*stderr)?)))
            .collect();
        if known.is_empty() {
            continue;
        }
        let n = known.len() as f64;
        let mean = known.iter().map(|(mean, _)| mean).sum::<f64>() / n;
        let stderr = known.iter().map(|(_, stderr)| stderr * stderr).sum::<f64>().sqrt() / n;
        let speed = v0 + (row as f64 + 0.5) * (v1 - v0) / cells as f64;
        middle.push((speed, mean));
        if let Some(forces) = &surface.law {
            let forces = || forces[row * cells..(row + 1) * cells].iter().flatten();
            law.push((speed, forces().sum::<f64>() / forces().count().max(1) as f64));
        }
        low.push((speed, mean - 2.0 * stderr));
        high.push((speed, mean + 2.0 * stderr));
    }
    let chart = Chart::new(
        format!("The same force over speed at {}", surface.location),
        format!("speed ({}/s)", surface.displacement_unit),
        format!("force ({})", surface.force_unit),
    )
    .with(Series::line("mean", middle))
    .with(Series::line("", low).styled(Style::Dashed))
    .with(Series::line("", high).styled(Style::Dashed));
    if law.is_empty() { chart } else { chart.with(Series::line("the law that was found", law)) }
}

fn parameters(found: &Diagnosis) -> Markup {
    html! {
        @if !found.parameter_changes.is_empty() {
            h2 { "Parameters of the given model that had to move" }
            table.numbers {
                thead { tr { th { "parameter" } th { "given" } th { "refitted" } th { "± (standard error)" } } }
                tbody {
                    @for change in &found.parameter_changes {
                        tr { td { code { (change.path) } } td { (format!("{:.5e}", change.from)) } td { (format!("{:.5e}", change.to)) } td { (format!("{:.1e}", change.stderr)) } }
                    }
                }
            }
        }
        @if !found.undetermined_parameters.is_empty() {
            p.muted { "Kept as given, because these recordings do not determine them: " (found.undetermined_parameters.join(", ")) "." }
        }
        @for line in &found.set_aside { p.muted { (line) } }
    }
}
