//! One set of modes from several recordings of the same structure.

use serde::Serialize;
use stillbeam_identify::{
    Estimate, IdentifiedMode, IdentifiedModes, Linearity, LinearityVerdict, Quantity, Warning, WarningKind,
    merged, resolution,
};

/// How far (a fraction) two recordings' frequencies may differ and still be one mode.
const SAME_MODE: f64 = 0.05;

/// Standard errors beyond which two recordings disagree.
const DISAGREEMENT: f64 = 3.0;

/// The JSON of `identify` with several recordings: like that of one, with the single results beside it.
#[derive(Clone, Debug, Serialize)]
pub struct CombinedModes<'r> {
    /// As in [`IdentifiedModes`].
    pub schema_version: u32,
    /// The modes of all recordings together: of one fit where they are forced, else those that all show, as means
    /// weighted by the inverse variances. Their boxes hold those of every recording alone.
    pub modes: Vec<IdentifiedMode>,
    /// Whether the structure answered as a linear one, in each recording and from one to the other.
    pub linearity: Linearity,
    /// Disagreements first, then the recordings' own warnings.
    pub warnings: Vec<Warning>,
    /// The one fit of all recordings, where they are forced.
    pub together: Option<&'r IdentifiedModes>,
    /// What each recording gave alone.
    pub recordings: &'r [IdentifiedModes],
}

/// Combines results, with the one fit of all where there is one.
pub fn combine<'r>(
    results: &'r [IdentifiedModes],
    together: Option<&'r IdentifiedModes>,
) -> CombinedModes<'r> {
    let mut warnings = Vec::new();
    if let Some((first, others)) = results.split_first() {
        for mode in &first.modes {
            for other in others {
                let shorter_s = duration_s(first).min(duration_s(other));
                let twin = twin(mode, other);
                warnings.extend(twin.into_iter().flat_map(|twin| disagreements(mode, twin, shorter_s)));
            }
        }
    }
    let modes = match together {
        Some(together) => together.modes.clone(),
        None => shared_modes(results),
    };
    let modes: Vec<IdentifiedMode> = modes.into_iter().map(|mode| boxed(mode, results)).collect();
    let mut linearity = Linearity::of(&modes);
    for verdict in [LinearityVerdict::NotConstant, LinearityVerdict::NotLinear] {
        let mut alone = results.iter().map(|result| &result.linearity);
        if let Some(bent) = alone.find(|one| one.verdict == verdict) {
            linearity = bent.clone();
        }
    }
    if let Some(first) = warnings.first().filter(|_| linearity.verdict != LinearityVerdict::NotLinear) {
        linearity = Linearity {
            verdict: LinearityVerdict::NotLinear,
            statement: format!("The recordings disagree: {}.", first.message),
        };
    }
    warnings.extend(together.into_iter().flat_map(|together| together.warnings.iter().cloned()));
    warnings.extend(results.iter().flat_map(|result| result.warnings.iter().cloned()));
    CombinedModes {
        schema_version: stillbeam_identify::SCHEMA_VERSION,
        modes,
        linearity,
        warnings: merged(warnings),
        together,
        recordings: results,
    }
}

/// The modes that every recording shows.
fn shared_modes(results: &[IdentifiedModes]) -> Vec<IdentifiedMode> {
    let Some((first, others)) = results.split_first() else { return Vec::new() };
    let shared = first.modes.iter().filter_map(|mode| {
        let twins: Vec<&IdentifiedMode> =
            others.iter().map(|other| twin(mode, other)).collect::<Option<_>>()?;
        let estimates = |pick: fn(&IdentifiedMode) -> Estimate| {
            weighted_mean([mode].into_iter().chain(twins.iter().copied()).map(pick))
        };
        Some(IdentifiedMode {
            frequency_hz: estimates(|mode| mode.frequency_hz),
            damping_ratio: estimates(|mode| mode.damping_ratio),
            ..mode.clone()
        })
    });
    shared.collect()
}

/// The mode with a box that holds what every recording says of it.
fn boxed(mode: IdentifiedMode, results: &[IdentifiedModes]) -> IdentifiedMode {
    results.iter().fold(mode, |mode, result| match twin(&mode, result) {
        Some(alone) if alone.damping_ratio.stderr < alone.damping_ratio.value => {
            mode.with_box_over(&alone.uncertainty_box)
        }
        _ => mode,
    })
}

fn twin<'m>(mode: &IdentifiedMode, other: &'m IdentifiedModes) -> Option<&'m IdentifiedMode> {
    let distance = |twin: &IdentifiedMode| (twin.frequency_hz.value / mode.frequency_hz.value).ln().abs();
    let nearest = other.modes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.filter(|twin| distance(twin) < SAME_MODE)
}

/// Length of the fitted record, s.
fn duration_s(result: &IdentifiedModes) -> f64 {
    result.window_s[1] - result.window_s[0]
}

/// Differences of a mode in two recordings, of which the shorter one is so long, that neither their standard errors nor their
/// resolution allow.
fn disagreements(first: &IdentifiedMode, second: &IdentifiedMode, shorter_s: f64) -> Vec<Warning> {
    let [least_hz, least_ratio] = resolution(first.frequency_hz.value, first.damping_ratio.value, shorter_s);
    let pairs = [
        (Quantity::FrequencyHz, first.frequency_hz, second.frequency_hz, least_hz),
        (Quantity::DampingRatio, first.damping_ratio, second.damping_ratio, least_ratio),
    ];
    let apart = pairs
        .into_iter()
        .filter(|(_, a, b, least)| a.distance(b) > DISAGREEMENT && (a.value - b.value).abs() > *least);
    apart
        .map(|(quantity, a, b, _)| {
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

/// Weighted by inverse variances: to first order what one fit of all decays gives, whose sum of squares is the sum of
/// the single ones, each a parabola around its own minimum, every decay with its own amplitudes, offset and noise
/// (docs/derivations/identification.md; `tests/decays_together.rs` makes that fit). The plain mean when none
/// has a finite one.
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
