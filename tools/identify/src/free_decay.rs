//! Modes from a free decay: a sum of damped sinusoids, fitted to the record from its peak on.

use stillbeam_recording::Recording;

use crate::aliasing::{Image, image_of};
use crate::decay_model::{DecayModel, heavily_damped};
use crate::decay_modes::{Part, Uniform, decay_part};
use crate::decay_starts::starting_parts;
use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::forced_model::{MIN_DAMPING, pole, pole_parameters};
use crate::forced_record::left_out;
use crate::forced_report::{disagreement, fit_warnings};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::Pole;
use crate::narrow_band::WholeSpectrum;
use crate::noise::{Refined, refine};
use crate::poles::{Survey, survey_decay_again, survey_decay_bands};
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Linearity, Method, RecordFit, Rejected,
    SCHEMA_VERSION, UncertaintyBox,
};
use crate::ringing::{DecayRecord, Ringing};
use crate::second_opinions::{Opinions, replica};
use crate::separable::{Projected, fit, fit_covariance, span};
use crate::time_shifts::{FittedRecord, time_shift_warnings};
use crate::warnings::{Quantity, Warning, WarningKind, merged};
use crate::whitening::{Whitener, even_runs};

/// Choices of [`identify_free_decay`].
#[derive(Debug, Clone, PartialEq)]
pub struct FreeDecayOptions {
    /// Output column: any quantity that rings.
    pub output: String,
    /// How many modes; `None` takes all that stand well above the noise. Of more than that many the lowest are taken:
    /// they move the structure most, whatever quantity was recorded.
    pub modes: Option<usize>,
    /// Where the free decay begins, s in the recording's time; `None` takes the largest deflection.
    pub start_s: Option<f64>,
    /// Whether the classical methods, which start the fit in any case, are also set against it: it takes them a second
    /// time. Large statistical studies may do without.
    pub cross_checks: bool,
}

impl FreeDecayOptions {
    /// The usual choices for an output column.
    pub fn new(output: impl Into<String>) -> Self {
        Self { output: output.into(), modes: None, start_s: None, cross_checks: true }
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
    for start in ringing.starts(options.start_s) {
        match identify_from(&ringing, start, options) {
            Err(refusal @ (IdentifyError::NoPeaks { .. } | IdentifyError::TooFewPeaks { .. })) => {
                first_refusal.get_or_insert(refusal);
            }
            Err(IdentifyError::TooFewSamples { .. }) if first_refusal.is_some() || !tried.is_empty() => {}
            Err(error) => return Err(error),
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
    let (mut parts, left_by_all) = starting_parts(&uniform, &survey, options.modes, &mut rejected);
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
        let model = DecayModel { time_s: &record.time_s, output: &record.output, modes: parts.len() };
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
            let refined = refine(&model, &minimum, &range, whitener);
            // Modes that were not asked for are no reason to read the decay from elsewhere.
            let left = refined.residual_rms().min(left_by_all.unwrap_or(f64::INFINITY));
            return Ok(Attempt {
                explained: record.explained(left),
                is_explained: record.is_explained(left),
                found: report(
                    ringing,
                    &record,
                    &minimum,
                    &refined,
                    (&parts, survey),
                    &uniform,
                    (options, rejected),
                ),
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

fn report(
    ringing: &Ringing,
    record: &DecayRecord,
    minimum: &Minimum<Projected>,
    refined: &Refined,
    (parts, survey): (&[Part], Survey),
    uniform: &Uniform,
    (options, mut rejected): (&FreeDecayOptions, Vec<Rejected>),
) -> IdentifiedModes {
    let whole = WholeSpectrum::new(&uniform.without_mean(), uniform.interval_s);
    let mut warnings = ringing.warnings.clone();
    for tone in &ringing.tones {
        let (warning, pole) = tone.told();
        warnings.push(warning);
        rejected.push(pole);
    }
    let mut modes: Vec<IdentifiedMode> = parts
        .iter()
        .enumerate()
        .map(|(mode, part)| {
            let (mode, own) = identified_mode(record, refined, mode, part, &whole);
            warnings.extend(own);
            mode
        })
        .collect();
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    let again = match options.cross_checks {
        true => survey_of_replica(record, refined, &survey, &modes),
        false => Survey::default(),
    };
    let opinions = Opinions { record: survey, replica: again };
    for mode in &mut modes {
        let checks = if options.cross_checks { opinions.of(mode) } else { Vec::new() };
        warnings.extend(checks.iter().flat_map(|check| disagreement(mode, check)));
        mode.cross_checks.extend(checks);
        let nyquist_hz = 0.5 / uniform.interval_s;
        warnings.extend(mode.own_warnings(nyquist_hz, image(record, refined, parts.len(), mode, nyquist_hz)));
    }
    rejected.extend(opinions.rejected(&modes));
    warnings.extend(fit_warnings(minimum, refined.covariance.is_some()));
    let fitted = FittedRecord {
        name: &record.name,
        first_row: 0,
        time_s: record.time_s.iter().map(|t| t + record.origin_s).collect(),
        fitted: record.output.iter().zip(&minimum.point.residuals).map(|(y, r)| y - r).collect(),
    };
    let model = DecayModel { time_s: &record.time_s, output: &record.output, modes: parts.len() };
    warnings.extend(time_shift_warnings(&fitted, &minimum.point.residuals, &span(&model, minimum)));

    let n = record.time_s.len();
    let time_s: Vec<f64> = record.time_s.iter().map(|t| t + record.origin_s).collect();
    let window_s = [time_s[0], time_s[n - 1]];
    rejected.extend(left_out(ringing.recording, &record.column, window_s));
    let offset = Estimate {
        value: refined.coefficients[2 * parts.len()],
        stderr: refined.coefficient_stderr(2 * parts.len()),
    };
    IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        linearity: Linearity::of(&modes),
        recording: record.name.clone(),
        input: None,
        output: record.column.clone(),
        modes,
        second_opinions: opinions.record.modes.clone(),
        survey: opinions.record,
        frf: None,
        spectrum: Some(uniform.spectrum.clone()),
        offset,
        delay_s: None,
        direct: None,
        records: vec![RecordFit {
            recording: record.name.clone(),
            rows: n,
            offset,
            residual_rms: refined.residual_rms(),
            window_s,
        }],
        noise: refined.noise,
        model_choice: Vec::new(),
        rejected,
        residual_rms: refined.residual_rms(),
        window_s,
        stop_reason: minimum.stop_reason,
        warnings: merged(warnings),
        fit: FitTrace {
            fitted: record.output.iter().zip(&refined.residuals).map(|(y, r)| y - r).collect(),
            measured: record.output.clone(),
            time_s,
        },
    }
}

/// What the record says of a mode's image.
fn image(
    record: &DecayRecord,
    refined: &Refined,
    modes: usize,
    mode: &IdentifiedMode,
    nyquist_hz: f64,
) -> Image {
    let model = DecayModel { time_s: &record.time_s, output: &record.output, modes };
    let away =
        |index: &usize| (pole(&refined.parameters, *index).frequency_hz - mode.frequency_hz.value).abs();
    let index = (0..modes).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
    image_of(&model, &refined.parameters, &refined.residuals, index, nyquist_hz)
}

/// What the classical methods see where the fitted modes are exactly true.
fn survey_of_replica(
    record: &DecayRecord,
    refined: &Refined,
    survey: &Survey,
    modes: &[IdentifiedMode],
) -> Survey {
    let again = Uniform::new(&record.time_s, &replica(&record.output, &refined.residuals));
    let modes_hz: Vec<f64> = modes.iter().map(|mode| mode.frequency_hz.value).collect();
    survey_decay_again(&again.without_mean(), again.interval_s, survey, &modes_hz)
}

/// One mode, its second opinions, its course over amplitude, and what its length and its changes call for saying.
fn identified_mode(
    record: &DecayRecord,
    refined: &Refined,
    mode: usize,
    part: &Part,
    whole: &WholeSpectrum,
) -> (IdentifiedMode, Vec<Warning>) {
    let pole = pole(&refined.parameters, mode);
    let (cosine, sine) = (refined.coefficients[2 * mode], refined.coefficients[2 * mode + 1]);
    let amplitude = cosine.hypot(sine);
    let (cosine_stderr, sine_stderr) =
        (refined.coefficient_stderr(2 * mode), refined.coefficient_stderr(2 * mode + 1));
    let seen = decay_part(whole, pole, part.half_width_hz, record.origin_s);
    let mut estimated = IdentifiedMode {
        frequency_hz: Estimate {
            value: pole.frequency_hz,
            stderr: pole.frequency_hz * refined.stderr(2 * mode),
        },
        damping_ratio: Estimate {
            value: pole.damping_ratio,
            stderr: pole.damping_ratio * refined.stderr(2 * mode + 1),
        },
        method: Method::DampedSinusoids,
        amplitude: Estimate {
            value: amplitude,
            stderr: (cosine * cosine_stderr).hypot(sine * sine_stderr) / amplitude,
        },
        participation: None,
        cross_checks: Vec::new(),
        by_amplitude: Vec::new(),
        amplitude_changes: Vec::new(),
        uncertainty_box: UncertaintyBox::default(),
    }
    .with_amplitudes(seen.course);
    let mut warnings: Vec<Warning> = length_warning(pole, record).into_iter().collect();
    if let Some([early, late]) = seen.early_late {
        warnings.extend(changes(pole.frequency_hz, &early, &late));
        estimated.cross_checks.extend([early, late]);
    }
    if let Some(check) = seen.decrement {
        warnings.extend(disagreement(&estimated, &check));
        estimated.cross_checks.push(check);
    }
    (estimated, warnings)
}

/// Warns about a record too short for the damping, or a tone that does not decay.
fn length_warning(pole: Pole, record: &DecayRecord) -> Option<Warning> {
    let mode_hz = pole.frequency_hz;
    let duration_s = record.duration_s();
    let kind = if pole.damping_ratio <= MIN_DAMPING * 1.001 || pole.decay_time_s() > 20.0 * duration_s {
        WarningKind::ForcedTone { mode_hz, duration_s }
    } else if duration_s < pole.decay_time_s() {
        WarningKind::RecordShorterThanDecay { mode_hz, duration_s, decay_time_s: pole.decay_time_s() }
    } else {
        return None;
    };
    Some(kind.into())
}

/// Warnings when the early and the late part of the decay disagree by more than four standard errors and by
/// an amount that matters to a shaper: a thousandth of the frequency, a tenth of the damping.
fn changes(mode_hz: f64, early: &CrossCheck, late: &CrossCheck) -> Vec<Warning> {
    let pairs = [
        (Quantity::FrequencyHz, early.frequency_hz, late.frequency_hz, 0.001),
        (Quantity::DampingRatio, early.damping_ratio, late.damping_ratio, 0.1),
    ];
    let mut warnings = Vec::new();
    for (quantity, early, late, share) in pairs {
        if let (Some(early), Some(late)) = (early, late)
            && early.distance(&late) > 4.0
            && (early.value - late.value).abs() > share * early.value.abs()
        {
            warnings.push(
                WarningKind::ChangesDuringDecay {
                    mode_hz,
                    quantity,
                    early: early.value,
                    late: late.value,
                    stderr: early.stderr.hypot(late.stderr),
                }
                .into(),
            );
        }
    }
    warnings
}
