//! One set of modes from several recordings of the same structure.

use serde::Serialize;
use stillbeam_identify::{
    Estimate, IdentifiedMode, IdentifiedModes, Linearity, LinearityVerdict, Quantity, UncertaintyBox,
    Warning, WarningKind, compare_recordings, merged, resolution,
};

/// How far (a fraction) two recordings' frequencies may differ and still be one mode.
const SAME_MODE: f64 = 0.1;

/// Standard errors beyond which two recordings disagree.
const DISAGREEMENT: f64 = 3.0;

/// The JSON of `identify` with several recordings: like that of one, with the single results beside it.
#[derive(Clone, Debug, Serialize)]
pub struct CombinedModes<'r> {
    /// As in [`IdentifiedModes`].
    pub schema_version: u32,
    /// The modes of all recordings together: of one fit where they are forced and agree, else means weighted
    /// by the inverse variances, of decays of those that all show. Their boxes hold those of every recording
    /// alone.
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

/// Whether no mode differs between the recordings by more than their errors allow and enough to matter to a
/// shaper.
pub fn recordings_agree(results: &[IdentifiedModes]) -> bool {
    compare_recordings(results).is_empty()
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
                let twin = twin(mode, &first.modes, &other.modes);
                warnings.extend(twin.into_iter().flat_map(|twin| disagreements(mode, twin, shorter_s)));
            }
        }
    }
    let modes = match together {
        Some(together) if recordings_agree(results) => together.modes.clone(),
        _ => mean_modes(results),
    };
    let modes: Vec<IdentifiedMode> = modes.iter().map(|mode| boxed(mode, &modes, results)).collect();
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

/// The modes that the recordings show, each once, as means over those that show it; of free decays only what
/// all of them show. One fit of forced recordings that disagree would put a mode between theirs and take the
/// difference for damping.
fn mean_modes(results: &[IdentifiedModes]) -> Vec<IdentifiedMode> {
    let forced = results.iter().all(|result| result.input.is_some());
    let mut modes = Vec::new();
    for (index, result) in results.iter().enumerate() {
        let (earlier, later) = (&results[..index], &results[index + 1..]);
        for mode in &result.modes {
            let twin_in = |other: &IdentifiedModes| twin(mode, &result.modes, &other.modes).cloned();
            if earlier.iter().any(|other| twin_in(other).is_some()) {
                continue;
            }
            let twins: Vec<IdentifiedMode> = later.iter().filter_map(twin_in).collect();
            if forced || twins.len() + 1 == results.len() {
                modes.push(mean_mode(mode, &twins));
            }
        }
    }
    // Of one recording they stay in its order, which is that of its file.
    if results.len() > 1 {
        modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    }
    modes
}

/// The mean of a mode and its twins in other recordings.
fn mean_mode(mode: &IdentifiedMode, twins: &[IdentifiedMode]) -> IdentifiedMode {
    let mean =
        |pick: fn(&IdentifiedMode) -> Estimate| weighted_mean([mode].into_iter().chain(twins).map(pick));
    let (frequency_hz, damping_ratio) = (mean(|mode| mode.frequency_hz), mean(|mode| mode.damping_ratio));
    let mean_alone =
        UncertaintyBox { frequency_hz: [frequency_hz.value; 2], damping_ratio: [damping_ratio.value; 2] };
    IdentifiedMode { frequency_hz, damping_ratio, ..mode.clone() }.with_box_over(&mean_alone)
}

/// The mode, one of `modes`, with a box that holds what every recording says of it. One that knows nothing of
/// the damping may still show that the frequency has moved.
fn boxed(mode: &IdentifiedMode, modes: &[IdentifiedMode], results: &[IdentifiedModes]) -> IdentifiedMode {
    let mut boxed = mode.clone();
    for alone in results.iter().filter_map(|result| twin(mode, modes, &result.modes)) {
        if alone.damping_ratio.stderr < alone.damping_ratio.value {
            boxed = boxed.with_box_over(&alone.uncertainty_box);
        } else if alone.frequency_hz.distance(&mode.frequency_hz) > DISAGREEMENT {
            boxed = boxed.with_box_over(&UncertaintyBox {
                frequency_hz: alone.uncertainty_box.frequency_hz,
                damping_ratio: [mode.damping_ratio.value; 2],
            });
        }
    }
    boxed
}

/// The same mode, one of `own`, among `others`: either is the nearest to the other.
pub fn twin<'m>(
    mode: &IdentifiedMode,
    own: &[IdentifiedMode],
    others: &'m [IdentifiedMode],
) -> Option<&'m IdentifiedMode> {
    let found = nearest(mode, others).filter(|found| distance(mode, found) < SAME_MODE)?;
    let back = nearest(found, own)?;
    (distance(back, found) >= distance(mode, found)).then_some(found)
}

fn nearest<'m>(mode: &IdentifiedMode, among: &'m [IdentifiedMode]) -> Option<&'m IdentifiedMode> {
    among.iter().min_by(|a, b| distance(mode, a).total_cmp(&distance(mode, b)))
}

/// How far apart two frequencies are, as a fraction.
fn distance(a: &IdentifiedMode, b: &IdentifiedMode) -> f64 {
    (a.frequency_hz.value / b.frequency_hz.value).ln().abs()
}

/// Length of the fitted record, s.
fn duration_s(result: &IdentifiedModes) -> f64 {
    result.window_s[1] - result.window_s[0]
}

/// Differences of a mode in two recordings, of which the shorter one is so long, that neither their standard
/// errors nor their resolution allow.
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

/// Weighted by inverse variances: to first order what one fit of all decays gives, whose sum of squares is
/// the sum of the single ones, each a parabola around its own minimum, every decay with its own amplitudes,
/// offset and noise (docs/derivations/identification.md; `tests/decays_together.rs` makes that fit). The
/// plain mean when none has a finite one. Values that disagree scatter by more than their errors: the mean is
/// then known no better than their scatter says (Birge's ratio).
fn weighted_mean(estimates: impl Iterator<Item = Estimate> + Clone) -> Estimate {
    let weight = |estimate: &Estimate| estimate.stderr.powi(-2);
    let count = estimates.clone().count().max(1) as f64;
    let total: f64 = estimates.clone().map(|estimate| weight(&estimate)).sum();
    if !(total.is_finite() && total > 0.0) {
        let value = estimates.map(|estimate| estimate.value).sum::<f64>() / count;
        return Estimate { value, stderr: f64::INFINITY };
    }
    let value = estimates.clone().map(|estimate| weight(&estimate) * estimate.value).sum::<f64>() / total;
    let squares: f64 = estimates.map(|one| weight(&one) * (one.value - value).powi(2)).sum();
    let scatter = (squares / (count - 1.0).max(1.0)).sqrt();
    let stretch = if scatter > DISAGREEMENT { scatter } else { 1.0 };
    Estimate { value, stderr: stretch * total.sqrt().recip() }
}
