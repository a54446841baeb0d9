//! Modes from a free decay: a sum of damped sinusoids, fitted to the record from its peak on.

use stillbeam_recording::Recording;

use crate::decay_model::{DecayModel, heavily_damped};
use crate::decay_modes::{Part, Uniform};
use crate::decay_report::report;
use crate::decay_shapes::decay_shapes;
use crate::decay_starts::starting_parts;
use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::forced_model::{pole, pole_parameters};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::narrow_band::WholeSpectrum;
use crate::noise::refine;
use crate::poles::{Survey, survey_decay_bands};
use crate::result::{IdentifiedModes, Rejected};
use crate::ringing::{DecayRecord, Ringing};
use crate::separable::{Projected, fit, fit_covariance};
use crate::whitening::{Whitener, even_runs};

/// Choices of [`identify_free_decay`].
#[derive(Debug, Clone, PartialEq)]
pub struct FreeDecayOptions {
    /// Output column: any quantity that rings.
    pub output: String,
    /// Further output columns: they give the modes' shapes.
    pub also: Vec<String>,
    /// How many modes; `None` takes all that stand well above the noise. Of more than that many the lowest are taken:
    /// they move the structure most, whatever quantity was recorded.
    pub modes: Option<usize>,
    /// Where the free decay begins, s in the recording's time; `None` takes the largest deflection.
    pub start_s: Option<f64>,
    /// Where it ends, s in the recording's time; `None` takes all that is not long sunk into the noise.
    pub end_s: Option<f64>,
    /// Whether the classical methods, which start the fit in any case, are also set against it: it takes them a second
    /// time. Large statistical studies may do without.
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
    let ringing = Ringing::new(recording, options)?;
    // A knock rings in ways that are over long before the modes are, and the hammer or the finger may still be there:
    // the first start from which modes explain what follows is taken, or the one from which they explain most.
    let mut first_refusal = None;
    let mut tried: Vec<Attempt> = Vec::new();
    let released = ringing.released();
    for start in released.into_iter().chain(ringing.starts(options.start_s)) {
        match identify_from(&ringing, start, options) {
            Err(
                refusal @ (IdentifyError::NoPeaks { .. }
                | IdentifyError::TooFewPeaks { .. }
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

/// The last attempt when it explains the decay, else the one that explains most; what the others found and it did not
/// is listed.
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
    let realised = if ringing.tones.is_empty() { survey.clone() } else { Survey::default() };
    let (mut parts, left_by_all) = starting_parts(&uniform, &realised, options.modes, &mut rejected);
    parts.retain(|part| {
        let tone = ringing.tones.iter().find(|tone| tone.is_at(part.pole.frequency_hz, uniform.bin_hz()));
        tone.is_none()
    });
    if parts.is_empty() && ringing.tones.is_empty() {
        let whole = WholeSpectrum::new(&uniform.without_mean(), uniform.interval_s);
        parts.extend(heavily_damped(&record.time_s, &record.output, &whole));
    }
    let mut range = search_range(&parts);
    loop {
        refuse_too_few(&record, options.modes, &parts)?;
        let model = DecayModel::of(&record, parts.len(), lowest_hz(&parts));
        let minimum = fit(&model, &range).ok_or_else(|| IdentifyError::NotComputable {
            recording: record.name.clone(),
            column: record.column.clone(),
        })?;
        let covariance = fit_covariance(&model, &minimum);
        // What the whole record does not bear out was a leftover of a neighbour: fit again without it.
        let kept = borne_out(&minimum, covariance.as_ref(), &range, record.duration_s());
        if kept.iter().all(|kept| *kept) {
            let runs = even_runs(&record.time_s, 0);
            let whitener = Whitener::of(&minimum.point.residuals, runs);
            let refined = refine(&model, &minimum, &range, whitener).or_refused(
                record.name.clone(),
                &record.column,
                parts.len(),
            )?;
            let shapes = decay_shapes(
                ringing,
                &record,
                options,
                (&refined.parameters[..2 * parts.len()], &refined.coefficients),
            )?;
            let (mut found, more_by_bending) =
                report(ringing, &record, &minimum, &refined, (&parts, survey), &uniform, (options, rejected));
            found.shapes = shapes;
            // Neither modes that were not asked for nor a mode that goes with its amplitude are a reason to
            // read the decay from elsewhere.
            let bent = (refined.residual_rms().powi(2) - more_by_bending).max(0.0).sqrt();
            let left = bent.min(left_by_all.unwrap_or(f64::INFINITY));
            return Ok(Attempt {
                explained: record.explained(left),
                is_explained: record.is_explained(left),
                found,
            });
        }
        for (mode, _) in kept.iter().enumerate().filter(|(_, kept)| !**kept) {
            let pole = pole(&minimum.parameters, mode);
            rejected.push(Rejected::Pole {
                frequency_hz: pole.frequency_hz,
                damping_ratio: Some(pole.damping_ratio),
                reason: "the fit of the whole decay does not bear it out: it ran to the edge of its band or its damping stayed unknown".to_owned(),
            });
        }
        for (parameter, found) in range.iter_mut().zip(&minimum.parameters) {
            parameter.start = *found;
        }
        let mut index = 0..;
        range.retain(|_| index.next().is_none_or(|index: usize| kept[index / 2]));
        let mut index = 0..;
        parts.retain(|_| index.next().is_none_or(|index: usize| kept[index]));
    }
}

/// Frequency of the slowest mode, Hz.
pub(crate) fn lowest_hz(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.pole.frequency_hz).fold(f64::INFINITY, f64::min)
}

/// How much larger the damping of the whole record may be than that of a mode's band alone.
const DAMPING_FACTOR: f64 = 5.0;

/// The bounds of the search: every mode inside its own band, its damping within a factor of what the band
/// said. Wider bounds let a poorly determined mode turn into a patch for its neighbours' misfit.
fn search_range(parts: &[Part]) -> Vec<Parameter> {
    let range = |part: &Part| {
        let reach = (part.half_width_hz / part.pole.frequency_hz).min(0.2);
        let [frequency, mut damping] = pole_parameters(part.pole, reach);
        damping.upper = damping.upper.min(damping.start + DAMPING_FACTOR.ln());
        [frequency, damping]
    };

    parts.iter().flat_map(range).collect()
}

/// Which modes the fit of the whole record determines: inside their range, damping known to better than half.
fn borne_out(
    minimum: &Minimum<Projected>,
    covariance: Option<&nalgebra::DMatrix<f64>>,
    range: &[Parameter],
    duration_s: f64,
) -> Vec<bool> {
    (0..range.len() / 2)
        .map(|mode| {
            let (frequency, damping) = (2 * mode, 2 * mode + 1);
            let found = &minimum.parameters;
            let inside = found[frequency] > range[frequency].lower + 1e-9
                && found[frequency] < range[frequency].upper - 1e-9
                && found[damping] < range[damping].upper - 1e-9;
            let tone = pole(found, mode).decay_time_s() > 10.0 * duration_s;
            let relative = covariance.map(|c| c[(damping, damping)].max(0.0).sqrt());
            inside && (tone || relative.is_none_or(|stderr| stderr < 0.5))
        })
        .collect()
}

fn refuse_too_few(
    record: &DecayRecord,
    requested: Option<usize>,
    parts: &[Part],
) -> Result<(), IdentifyError> {
    let (recording, column) = (record.name.clone(), record.column.clone());
    match requested {
        Some(requested) if parts.len() < requested => Err(IdentifyError::TooFewPeaks {
            recording,
            column,
            requested,
            found: parts.len(),
            frequencies_hz: parts.iter().map(|part| part.pole.frequency_hz).collect(),
        }),
        _ if parts.is_empty() => Err(IdentifyError::NoPeaks { recording, column }),
        _ => Ok(()),
    }
}
