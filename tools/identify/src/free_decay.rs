//! Modes from a free decay: a sum of damped sinusoids, fitted to the record from its peak on.

use stillbeam_recording::Recording;

use crate::decay_fit::DecayFit;
use crate::decay_model::heavily_damped;
use crate::decay_modes::Uniform;
use crate::decay_report::report;
use crate::decay_shapes::decay_shapes;
use crate::decay_starts::starting_parts;
use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::gaps::{beyond_said, ringing_stretches};
use crate::narrow_band::WholeSpectrum;
use crate::poles::{Survey, survey_decay_bands};
use crate::result::{IdentifiedModes, Rejected};
use crate::ringing::{DecayRecord, Ringing};
use crate::warnings::WarningKind;

/// Choices of [`identify_free_decay`].
#[derive(Debug, Clone, PartialEq)]
pub struct FreeDecayOptions {
    /// Output column: any quantity that rings.
    pub output: String,
    /// Further output columns: they give the modes' shapes.
    pub also: Vec<String>,
    /// How many modes; `None` takes all that stand well above the noise. Of more than that many the lowest
    /// are taken: they move the structure most, whatever quantity was recorded.
    pub modes: Option<usize>,
    /// Where the free decay begins, s in the recording's time; `None` takes the largest deflection.
    pub start_s: Option<f64>,
    /// Where it ends, s in the recording's time; `None` takes all that is not long sunk into the noise.
    pub end_s: Option<f64>,
    /// Whether the classical methods, which start the fit in any case, are also set against it: it takes them
    /// a second time. Large statistical studies may do without.
    pub cross_checks: bool,
}

impl FreeDecayOptions {
    /// The usual choices for an output column.
    pub fn new(output: impl Into<String>) -> Self {
        Self {
            output: output.into(),
            also: Vec::new(),
            modes: None,
            start_s: None,
            end_s: None,
            cross_checks: true,
        }
    }

    /// The same with a number of modes.
    #[must_use]
    pub fn with_modes(mut self, modes: usize) -> Self {
        self.modes = Some(modes);
        self
    }
}

/// Identifies modes from a record that rings freely.
///
/// # Errors
/// [`IdentifyError`] when the column cannot be used or fewer modes stand out than were asked for.
pub fn identify_free_decay(
    recording: &Recording,
    options: &FreeDecayOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    check_modes(options.modes)?;
    let window_s = [options.start_s, options.end_s];
    let Some(stretches) = ringing_stretches(recording, &options.output, window_s) else {
        return read_decay(recording, options);
    };
    let (read, mut found) = read_stretches(&stretches, options)?;
    let (said, left_out) = beyond_said(recording, &options.output, read);
    found.warnings.extend(said);
    found.rejected.extend(left_out);
    Ok(found)
}

/// Stretches between gaps that are looked at.
const STRETCHES: usize = 4;
/// Modes of two stretches this close, as a share of the frequency, are the same.
const SAME_IN_BOTH: f64 = 0.01;

/// The decay of the most telling stretch; that of an earlier one where it holds all the same modes and more,
/// which have died away before the other begins.
fn read_stretches<'s>(
    stretches: &'s [Recording],
    options: &FreeDecayOptions,
) -> Result<(&'s Recording, IdentifiedModes), IdentifyError> {
    let mut best: Option<(&Recording, IdentifiedModes)> = None;
    let mut first_refusal = None;
    for stretch in stretches.iter().take(STRETCHES) {
        let is_earlier = |other: &Recording| stretch.time_s.first() < other.time_s.first();
        if best.as_ref().is_some_and(|(other, _)| !is_earlier(other)) {
            continue;
        }
        match read_decay(stretch, options) {
            Err(refusal) => {
                first_refusal.get_or_insert(refusal);
            }
            Ok(found) => match &best {
                Some((_, known)) if !holds_more(&found, known) => {}
                _ => best = Some((stretch, found)),
            },
        }
    }
    let none = || IdentifyError::NoPeaks {
        recording: stretches.first().map_or(String::new(), |one| one.name.clone()),
        column: options.output.clone(),
    };
    best.ok_or_else(|| first_refusal.unwrap_or_else(none))
}

fn holds_more(found: &IdentifiedModes, known: &IdentifiedModes) -> bool {
    let holds =
        |hz: f64| found.modes.iter().any(|mode| (mode.frequency_hz.value / hz - 1.0).abs() < SAME_IN_BOTH);
    found.modes.len() > known.modes.len() && known.modes.iter().all(|mode| holds(mode.frequency_hz.value))
}

/// Identifies modes from a record that rings freely and has no gaps that matter.
fn read_decay(recording: &Recording, options: &FreeDecayOptions) -> Result<IdentifiedModes, IdentifyError> {
    let ringing = Ringing::new(recording, options)?;
    // A knock rings in ways that are over long before the modes are, and the hammer or the finger may still
    // be there: the first start from which modes explain what follows is taken, or the one from which they
    // explain most.
    let mut first_refusal = None;
    let mut tried: Vec<Attempt> = Vec::new();
    let released = ringing.released();
    for start in released.into_iter().chain(ringing.starts(options.start_s)) {
        match identify_from(&ringing, start, options) {
            Err(
                refusal @ (IdentifyError::NoPeaks { .. }
                | IdentifyError::TooFewPeaks { .. }
                | IdentifyError::OnlyTones { .. }
                | IdentifyError::NotDetermined { .. }),
            ) => {
                first_refusal.get_or_insert(refusal);
            }
            Err(IdentifyError::TooFewSamples { .. }) if first_refusal.is_some() || !tried.is_empty() => {}
            Err(error) => return Err(error),
            // A move that modes cannot make leaves more.
            Ok(attempt) if Some(start) == released && attempt.explained < LET_GO => {}
            Ok(attempt) => {
                let enough = attempt.is_explained;
                tried.push(attempt);
                if enough {
                    break;
                }
            }
        }
    }
    if let Some(found) = best_of(tried) {
        return Ok(found);
    }
    Err(match first_refusal {
        Some(IdentifyError::NoPeaks { recording, column }) if !ringing.tones.is_empty() => {
            IdentifyError::OnlyTones {
                recording,
                column,
                tones: ringing
                    .tones
                    .iter()
                    .map(|tone| (tone.frequency_hz.value, tone.reason.clone()))
                    .collect(),
            }
        }
        Some(refusal) => refusal,
        None => ringing.too_short(0),
    })
}

/// Share of what follows that modes explain where a structure was let go and not moved.
const LET_GO: f64 = 0.995;

/// A fit from one start.
struct Attempt {
    found: IdentifiedModes,
    /// Share of the decay that it explains, and whether that is enough.
    explained: f64,
    is_explained: bool,
}

/// The last attempt when it explains the decay, else the one that explains most; what the others found and it
/// did not is listed.
fn best_of(mut tried: Vec<Attempt>) -> Option<IdentifiedModes> {
    let by_share = |a: &usize, b: &usize| tried[*a].explained.total_cmp(&tried[*b].explained);
    // Of equals the earliest.
    let best = match tried.last()?.is_explained {
        true => tried.len() - 1,
        false => (0..tried.len()).rev().max_by(by_share)?,
    };
    let mut found = tried.remove(best).found;
    let earlier = tried.iter().filter(|attempt| attempt.found.window_s[0] < found.window_s[0]);
    let mut lost: Vec<Rejected> = Vec::new();
    for attempt in earlier {
        for mode in &attempt.found.modes {
            let hz = mode.frequency_hz.value;
            let apart = |other: f64| (other / hz - 1.0).abs() > SAME_MODE;
            let is_new = found.modes.iter().all(|known| apart(known.frequency_hz.value))
                && lost.iter().all(|known| known.frequency_hz().is_none_or(apart));
            if is_new {
                lost.push(Rejected::Pole {
                    frequency_hz: hz,
                    damping_ratio: Some(mode.damping_ratio.value),
                    reason: format!(
                        "heard from {:.4} s on, where modes explain {:.0} % of what follows: not a free decay yet; from {:.4} s on the fit does without it",
                        attempt.found.window_s[0],
                        100.0 * attempt.explained.max(0.0),
                        found.window_s[0]
                    ),
                });
            }
        }
    }
    found.rejected.extend(lost);
    Some(found)
}

/// Modes of two starts this close, as a share of the frequency, are the same.
const SAME_MODE: f64 = 0.05;

fn identify_from(
    ringing: &Ringing,
    start: usize,
    options: &FreeDecayOptions,
) -> Result<Attempt, IdentifyError> {
    let record = ringing.from(start)?;
    let uniform = Uniform::new(&record.time_s, &record.output);
    let mut rejected = Vec::new();
    let survey = survey_decay_bands(&uniform.without_mean(), uniform.interval_s);
    // A drive that speeds up and slows down is a multitude of short decays to the realisation.
    let realised = if ringing.only_hums() { survey.clone() } else { Survey::default() };
    let (mut parts, left_by_all) = starting_parts(&uniform, &realised, options.modes, &mut rejected);
    parts.retain(|part| !ringing.is_tone(part.pole.frequency_hz, uniform.bin_hz()));
    if parts.is_empty() && ringing.tones.is_empty() {
        let whole = WholeSpectrum::new(&uniform.without_mean(), uniform.interval_s);
        parts.extend(heavily_damped(&record.time_s, &record.output, &whole));
    }
    let mut fit = DecayFit::of(&record, parts, options.modes, &mut rejected)?;
    if options.modes.is_none() {
        fit = fit.with_what_it_leaves(ringing, &record, &uniform, &mut rejected);
    }
    let (minimum, refined) = (&fit.minimum, &fit.refined);
    let of_modes = (&refined.parameters[..2 * fit.parts.len()], &refined.coefficients[..]);
    let shapes = decay_shapes(ringing, &record, options, of_modes)?;
    let (mut found, more_by_bending) =
        report(ringing, &record, minimum, refined, (&fit.parts, survey), &uniform, (options, rejected));
    if found.modes.is_empty() {
        return Err(only_hum(&record, &found));
    }
    let is_mode = |hz: f64| found.modes.iter().any(|mode| mode.frequency_hz.value == hz);
    found.shapes = shapes.into_iter().filter(|shape| is_mode(shape.frequency_hz)).collect();
    // Neither modes that were not asked for nor a mode that goes with its amplitude are a reason to read the
    // decay from elsewhere.
    let bent = (refined.residual_rms().powi(2) - more_by_bending).max(0.0).sqrt();
    let left = bent.min(left_by_all.unwrap_or(f64::INFINITY));
    Ok(Attempt { explained: record.explained(left), is_explained: record.is_explained(left), found })
}

/// The refusal of a record of which nothing but lines of the mains was fitted.
fn only_hum(record: &DecayRecord, found: &IdentifiedModes) -> IdentifyError {
    let tones = found.warnings.iter().filter_map(|warning| match &warning.kind {
        WarningKind::ToneInRecord { frequency_hz, reason } => Some((*frequency_hz, reason.clone())),
        _ => None,
    });
    IdentifyError::OnlyTones {
        recording: record.name.clone(),
        column: record.column.clone(),
        tones: tones.collect(),
    }
}
