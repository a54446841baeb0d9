//! What the fit of a free decay has to say: estimates with standard errors, cross-checks, warnings.

use crate::aliasing::{Image, image_of};
use crate::amplitude::CLEAR_WHERE_BENT;
use crate::decay_fit::lowest_hz;
use crate::decay_model::DecayModel;
use crate::decay_modes::{Fitted, Part, Uniform, decay_part};
use crate::forced_model::{MIN_DAMPING, pole};
use crate::forced_record::left_out;
use crate::forced_report::{disagreement, fit_warnings};
use crate::free_decay::FreeDecayOptions;
use crate::levenberg_marquardt::Minimum;
use crate::linearity::Linearity;
use crate::modal_response::Pole;
use crate::narrow_band::WholeSpectrum;
use crate::noise::Refined;
use crate::poles::{Survey, survey_decay_again};
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, RecordFit, Rejected,
    SCHEMA_VERSION, UncertaintyBox, fit_percent,
};
use crate::ringing::{DecayRecord, Ringing};
use crate::second_opinions::{Opinions, replica};
use crate::separable::{Projected, span};
use crate::time_shifts::{FittedRecord, time_shift_warnings};
use crate::time_stamps::are_uneven;
use crate::tones::Tone;
use crate::unexplained::unexplained;
use crate::warning_merge::merged;
use crate::warnings::{Quantity, Warning, WarningKind};

/// Turns a fit into the result; beside it comes the mean square that courses that bend explain more.
pub(crate) fn report(
    ringing: &Ringing,
    record: &DecayRecord,
    minimum: &Minimum<Projected>,
    refined: &Refined,
    (parts, survey): (&[Part], Survey),
    uniform: &Uniform,
    (options, mut rejected): (&FreeDecayOptions, Vec<Rejected>),
) -> (IdentifiedModes, f64) {
    let left = Uniform::new(&record.time_s, &refined.residuals);
    let left = WholeSpectrum::new(left.samples(), left.interval_s);
    let mut warnings = ringing.warnings.clone();
    for tone in &ringing.tones {
        let (warning, pole) = tone.told();
        warnings.push(warning);
        rejected.push(pole);
    }
    let mut more_by_bending = 0.0;
    let mut modes: Vec<IdentifiedMode> = Vec::new();
    for (mode, part) in parts.iter().enumerate() {
        let (mode, own, more) = identified_mode(record, refined, mode, part, &left);
        if let Some(hum) = Tone::of_line(mode.frequency_hz, mode.damping_ratio, record.window_s()) {
            let (warning, pole) = hum.told();
            warnings.push(warning);
            rejected.push(pole);
            continue;
        }
        warnings.extend(own);
        more_by_bending += more;
        modes.push(mode);
    }
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    let again = match options.cross_checks {
        true => survey_of_replica(record, refined, &survey, &modes),
        false => Survey::default(),
    };
    let opinions = Opinions { record: survey, replica: again };
    for mode in &mut modes {
        let checks = if options.cross_checks { opinions.of(mode) } else { Vec::new() };
        warnings.extend(checks.iter().flat_map(|check| disagreement(mode, check, record.duration_s())));
        mode.cross_checks.extend(checks);
        let nyquist_hz = 0.5 / uniform.interval_s;
        warnings.extend(mode.own_warnings(nyquist_hz, image(record, refined, parts, mode, nyquist_hz)));
    }
    rejected.extend(opinions.rejected(&modes));
    warnings.extend(fit_warnings(minimum));
    let of_record = (&record.time_s[..], &record.output[..], &refined.residuals[..]);
    warnings.extend(unexplained(&record.column, of_record, |hz, bin_hz| ringing.is_tone(hz, bin_hz)));
    let fitted = FittedRecord {
        name: &record.name,
        first_row: 0,
        time_s: record.time_s.iter().map(|t| t + record.origin_s).collect(),
        fitted: record.output.iter().zip(&minimum.point.residuals).map(|(y, r)| y - r).collect(),
    };
    let model = DecayModel::of(record, parts.len(), lowest_hz(parts));
    warnings.extend(time_shift_warnings(&fitted, &minimum.point.residuals, &span(&model, minimum)));

    let n = record.time_s.len();
    let time_s: Vec<f64> = record.time_s.iter().map(|t| t + record.origin_s).collect();
    let window_s = [time_s[0], time_s[n - 1]];
    rejected.extend(ringing.left_out.iter().cloned());
    rejected.extend(left_out(ringing.recording, &record.column, window_s));
    let offset = Estimate {
        value: refined.coefficients[2 * parts.len()],
        stderr: refined.coefficient_stderr(2 * parts.len()),
    };
    let found = IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        linearity: Linearity::of(&modes),
        recording: record.name.clone(),
        kind: Some(ringing.kind),
        shapes: Vec::new(),
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
        real_pole: None,
        records: vec![RecordFit {
            recording: record.name.clone(),
            rows: n,
            offset,
            residual_rms: refined.residual_rms(),
            fit_percent: fit_percent(&record.output, refined.residual_rms()),
            window_s,
        }],
        noise: refined.noise,
        model_choice: Vec::new(),
        rejected,
        residual_rms: refined.residual_rms(),
        window_s,
        band_hz: None,
        stop_reason: minimum.stop_reason,
        warnings: merged(warnings),
        fit: FitTrace {
            fitted: record.output.iter().zip(&refined.residuals).map(|(y, r)| y - r).collect(),
            measured: record.output.clone(),
            time_s,
        },
    };
    (found, more_by_bending)
}

/// What the record says of a mode's image.
fn image(
    record: &DecayRecord,
    refined: &Refined,
    parts: &[Part],
    mode: &IdentifiedMode,
    nyquist_hz: f64,
) -> Image {
    if !are_uneven(&record.time_s) {
        return Image::Unknown;
    }
    let model = DecayModel::of(record, parts.len(), lowest_hz(parts));
    let away =
        |index: &usize| (pole(&refined.parameters, *index).frequency_hz - mode.frequency_hz.value).abs();
    let index = (0..parts.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
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

/// One mode, its second opinions, its course over amplitude; what its length and its changes call for saying;
/// and what it explains more if it may bend.
fn identified_mode(
    record: &DecayRecord,
    refined: &Refined,
    mode: usize,
    part: &Part,
    left: &WholeSpectrum,
) -> (IdentifiedMode, Vec<Warning>, f64) {
    let pole = pole(&refined.parameters, mode);
    let (cosine, sine) = (refined.coefficients[2 * mode], refined.coefficients[2 * mode + 1]);
    let amplitude = cosine.hypot(sine);
    let (cosine_stderr, sine_stderr) =
        (refined.coefficient_stderr(2 * mode), refined.coefficient_stderr(2 * mode + 1));
    let fitted = Fitted { pole, factors: [cosine, sine], half_width_hz: part.half_width_hz };
    let seen = decay_part(left, &fitted, record.origin_s);
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
        rate_participation: None,
        cross_checks: Vec::new(),
        by_amplitude: Vec::new(),
        amplitude_changes: Vec::new(),
        uncertainty_box: UncertaintyBox::default(),
    }
    .with_amplitudes(seen.course, seen.bends.then_some(CLEAR_WHERE_BENT));
    let mut warnings: Vec<Warning> = length_warning(pole, record).into_iter().collect();
    if let Some([early, late]) = seen.early_late {
        if seen.bends {
            warnings.extend(changes(pole.frequency_hz, &early, &late));
        }
        estimated.cross_checks.extend([early, late]);
    }
    if let Some(check) = seen.decrement {
        warnings.extend(disagreement(&estimated, &check, record.duration_s()));
        estimated.cross_checks.push(check);
    }
    (estimated, warnings, seen.more_by_bending)
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
