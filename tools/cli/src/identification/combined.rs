//! One set of modes from several recordings of the same structure.

use serde::Serialize;
use stillbeam_identify::{Estimate, IdentifiedMode, IdentifiedModes, Quantity, Warning, WarningKind};

/// How far (a fraction) two recordings' frequencies may differ and still be one mode.
const SAME_MODE: f64 = 0.05;

/// Standard errors beyond which two recordings disagree.
const DISAGREEMENT: f64 = 3.0;

/// The JSON of `identify` with several recordings: like that of one, with the single results beside it.
#[derive(Clone, Debug, Serialize)]
pub struct CombinedModes<'r> {
    /// As in [`IdentifiedModes`].
    pub schema_version: u32,
    /// The modes that all recordings show, means weighted by the inverse variances.
    pub modes: Vec<IdentifiedMode>,
    /// Disagreements first, then the recordings' own warnings.
    pub warnings: Vec<Warning>,
    /// What each recording gave alone.
    pub recordings: &'r [IdentifiedModes],
}

/// Combines results; modes that some recording does not show are left out.
pub fn combine(results: &[IdentifiedModes]) -> CombinedModes<'_> {
    let mut warnings = Vec::new();
    let mut modes = Vec::new();
    if let Some((first, others)) = results.split_first() {
        for mode in &first.modes {
            let twins: Option<Vec<&IdentifiedMode>> = others.iter().map(|other| twin(mode, other)).collect();
            let Some(twins) = twins else { continue };
            warnings.extend(twins.iter().flat_map(|twin| disagreements(mode, twin)));
            let estimates = |pick: fn(&IdentifiedMode) -> Estimate| {
                weighted_mean([mode].into_iter().chain(twins.iter().copied()).map(pick))
            };
            modes.push(IdentifiedMode {
                frequency_hz: estimates(|mode| mode.frequency_hz),
                damping_ratio: estimates(|mode| mode.damping_ratio),
                ..mode.clone()
            });
        }
    }
    warnings.extend(results.iter().flat_map(|result| result.warnings.iter().cloned()));
    CombinedModes { schema_version: stillbeam_identify::SCHEMA_VERSION, modes, warnings, recordings: results }
}

fn twin<'m>(mode: &IdentifiedMode, other: &'m IdentifiedModes) -> Option<&'m IdentifiedMode> {
    let distance = |twin: &IdentifiedMode| (twin.frequency_hz.value / mode.frequency_hz.value).ln().abs();
    let nearest = other.modes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.filter(|twin| distance(twin) < SAME_MODE)
}

fn disagreements(first: &IdentifiedMode, second: &IdentifiedMode) -> Vec<Warning> {
    let pairs = [
        (Quantity::FrequencyHz, first.frequency_hz, second.frequency_hz),
        (Quantity::DampingRatio, first.damping_ratio, second.damping_ratio),
    ];
    let apart = pairs.into_iter().filter(|(_, a, b)| a.distance(b) > DISAGREEMENT);
    apart
        .map(|(quantity, a, b)| {
            Warning::from(WarningKind::RecordingsDisagree {
                mode_hz: first.frequency_hz.value,
                quantity,
                first: a.value,
                second: b.value,
                stderr: a.stderr.hypot(b.stderr),
                first_amplitude: first.amplitude.value,
                second_amplitude: second.amplitude.value,
            })
        })
        .collect()
}

/// Weighted by inverse variances; the plain mean when none has a finite one.
fn weighted_mean(estimates: impl Iterator<Item = Estimate> + Clone) -> Estimate {
    let weight = |estimate: &Estimate| estimate.stderr.powi(-2);
    let total: f64 = estimates.clone().map(|estimate| weight(&estimate)).sum();
    if total.is_finite() && total > 0.0 {
        let sum: f64 = estimates.map(|estimate| weight(&estimate) * estimate.value).sum();
        return Estimate { value: sum / total, stderr: total.sqrt().recip() };
    }
    let count = estimates.clone().count().max(1) as f64;
    Estimate { value: estimates.map(|estimate| estimate.value).sum::<f64>() / count, stderr: f64::INFINITY }
}
