//! Modes from a free decay: a sum of damped sinusoids, fitted to the record from its peak on.

use nalgebra::DMatrix;
use stillbeam_recording::Recording;

use crate::decay_model::{DecayModel, heavily_damped};
use crate::decay_modes::{Part, Uniform, decay_part, find_parts};
use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::forced_model::{MIN_DAMPING, pole, pole_parameters};
use crate::forced_record::{MIN_ROWS, present, refuse_constant};
use crate::forced_report::{disagreement, fit_warnings};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::Pole;
use crate::narrow_band::WholeSpectrum;
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, SCHEMA_VERSION,
};
use crate::separable::{Projected, fit, fit_covariance};
use crate::signal_checks::clipping;
use crate::warnings::{Quantity, Warning, WarningKind};

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
}

impl FreeDecayOptions {
    /// The usual choices for an output column.
    pub fn new(output: impl Into<String>) -> Self {
        Self { output: output.into(), modes: None, start_s: None }
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
    let record = DecayRecord::new(recording, options)?;
    let uniform = Uniform::new(&record.time_s, &record.output);
    let mut parts = lowest_parts(&uniform, options.modes);
    if parts.is_empty() {
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
            return Ok(report(&record, &minimum, covariance.as_ref(), &parts, &uniform));
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

/// The modes that stand out, at most `wanted` of them from the lowest on; where fewer do, the search for that many.
fn lowest_parts(uniform: &Uniform, wanted: Option<usize>) -> Vec<Part> {
    let mut parts = find_parts(uniform, None);
    let Some(wanted) = wanted else { return parts };
    if parts.len() < wanted {
        return find_parts(uniform, Some(wanted));
    }
    parts.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
    parts.truncate(wanted);
    parts
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
    covariance: Option<&DMatrix<f64>>,
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

/// The ringing part of a record; time counts from its first sample.
struct DecayRecord {
    name: String,
    column: String,
    time_s: Vec<f64>,
    output: Vec<f64>,
    origin_s: f64,
    warnings: Vec<Warning>,
}

impl DecayRecord {
    fn new(recording: &Recording, options: &FreeDecayOptions) -> Result<Self, IdentifyError> {
        let all = present(recording, &options.output)?;
        refuse_constant(recording, &options.output, &all.values)?;
        let start = match options.start_s {
            Some(start_s) => all.time_s.iter().position(|t| *t >= start_s).unwrap_or(all.time_s.len()),
            None => largest_deflection(&all.values),
        };
        let rows = all.time_s.len() - start;
        if rows < MIN_ROWS {
            return Err(IdentifyError::TooFewSamples {
                recording: recording.name.clone(),
                column: options.output.clone(),
                found: rows,
                required: MIN_ROWS,
                context: " from the start of the decay on",
            });
        }
        let origin_s = all.time_s[start];
        Ok(Self {
            name: recording.name.clone(),
            column: options.output.clone(),
            time_s: all.time_s[start..].iter().map(|t| t - origin_s).collect(),
            output: all.values[start..].to_vec(),
            origin_s,
            warnings: clipping(&options.output, &all.values),
        })
    }

    fn duration_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }
}

/// Index of the sample farthest from where the record ends up.
fn largest_deflection(values: &[f64]) -> usize {
    let tail = &values[values.len() - values.len().div_ceil(10)..];
    let rest = tail.iter().sum::<f64>() / tail.len() as f64;
    let away = |index: &usize| (values[*index] - rest).abs();
    (0..values.len()).rev().max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0)
}

fn report(
    record: &DecayRecord,
    minimum: &Minimum<Projected>,
    covariance: Option<&DMatrix<f64>>,
    parts: &[Part],
    uniform: &Uniform,
) -> IdentifiedModes {
    let stderr = |index: usize| covariance.map_or(f64::INFINITY, |c| c[(index, index)].max(0.0).sqrt());
    let linear = minimum.parameters.len();
    let coefficients = &minimum.point.coefficients;
    let whole = WholeSpectrum::new(&uniform.without_mean(), uniform.interval_s);
    let mut warnings = record.warnings.clone();
    let mut modes = Vec::with_capacity(parts.len());
    for (mode, part) in parts.iter().enumerate() {
        let pole = pole(&minimum.parameters, mode);
        let (cosine, sine) = (coefficients[2 * mode], coefficients[2 * mode + 1]);
        let amplitude = cosine.hypot(sine);
        let (cosine_stderr, sine_stderr) = (stderr(linear + 2 * mode), stderr(linear + 2 * mode + 1));
        let mut estimated = IdentifiedMode {
            frequency_hz: Estimate { value: pole.frequency_hz, stderr: pole.frequency_hz * stderr(2 * mode) },
            damping_ratio: Estimate {
                value: pole.damping_ratio,
                stderr: pole.damping_ratio * stderr(2 * mode + 1),
            },
            method: Method::DampedSinusoids,
            amplitude: Estimate {
                value: amplitude,
                stderr: (cosine * cosine_stderr).hypot(sine * sine_stderr) / amplitude,
            },
            participation: None,
            cross_checks: Vec::new(),
        };
        warnings.extend(length_warning(pole, record));
        let seen = decay_part(&whole, pole, part.half_width_hz);
        if let Some([early, late]) = seen.early_late {
            warnings.extend(changes(pole.frequency_hz, &early, &late));
            estimated.cross_checks.extend([early, late]);
        }
        if let Some(check) = seen.decrement {
            warnings.extend(disagreement(&estimated, &check));
            estimated.cross_checks.push(check);
        }
        modes.push(estimated);
    }
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    warnings.extend(fit_warnings(minimum, covariance.is_some()));

    let n = record.time_s.len();
    let time_s: Vec<f64> = record.time_s.iter().map(|t| t + record.origin_s).collect();
    IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        recording: record.name.clone(),
        input: None,
        output: record.column.clone(),
        modes,
        frf: None,
        spectrum: Some(uniform.spectrum.clone()),
        offset: Estimate { value: coefficients[2 * parts.len()], stderr: stderr(linear + 2 * parts.len()) },
        delay_s: None,
        direct: None,
        records: Vec::new(),
        noise: crate::result::NoiseModel::White,
        model_choice: Vec::new(),
        rejected: Vec::new(),
        residual_rms: (minimum.sum_of_squares / n as f64).sqrt(),
        window_s: [time_s[0], time_s[n - 1]],
        stop_reason: minimum.stop_reason,
        warnings,
        fit: FitTrace {
            fitted: record.output.iter().zip(&minimum.point.residuals).map(|(y, r)| y - r).collect(),
            measured: record.output.clone(),
            time_s,
        },
    }
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
