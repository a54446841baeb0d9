//! What a forced fit has to say: estimates with standard errors, cross-checks, warnings.

use std::ops::Range;

use crate::aliasing::{Image, image_of};
use crate::amplitude::{CLEAR, changes_not_in_time, of_forced};
use crate::decay_modes::Uniform;
use crate::driven_lines::DrivenLines;
use crate::error::IdentifyError;
use crate::forced_model::{ForcedModel, MIN_DAMPING, pole};
use crate::forced_record::ForcedRecord;
use crate::forced_start::{Spectral, Starts};
use crate::input_rest::samples_of_a_blow;
use crate::levenberg_marquardt::Minimum;
use crate::linearity::Linearity;
use crate::modal_response::{InputKind, Pole};
use crate::mode_gates::NotLinear;
use crate::model_choice::{Chosen, names};
use crate::noise::{Refined, refine};
use crate::poles::{Survey, survey_forced};
use crate::record_kind::{RecordKind, recognise_signal};
use crate::resolution::resolution;
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, NoiseModel, RealPole, RecordFit,
    SCHEMA_VERSION, UncertaintyBox, fit_percent,
};
use crate::second_opinions::{Opinions, replica};
use crate::separable::{Projected, span};
use crate::tall::dot;
use crate::time_shifts::{FittedRecord, time_shift_warnings};
use crate::tones::find_tones;
use crate::unexplained::unexplained;
use crate::warning_merge::merged;
use crate::warnings::{FastPassage, Quantity, Warning, WarningKind};
use crate::whitening::{Whitener, even_runs};

/// What drove the structure; something that is over at once is a pulse.
fn kind_of_input(record: &ForcedRecord) -> RecordKind {
    let values: Vec<f64> = record.input.coefficients.iter().map(|c| c[0]).collect();
    let time_s = &record.input.knots_s[..values.len()];
    match recognise_signal(time_s, &values).kind {
        RecordKind::FreeDecay => RecordKind::Pulse,
        kind => kind,
    }
}

/// Turns a chosen model into the result.
///
/// # Errors
/// [`IdentifyError::NotDetermined`] where there are no standard errors.
pub(crate) fn report(
    chosen: &Chosen<'_>,
    starts: &Starts,
    cross_checks: bool,
) -> Result<IdentifiedModes, IdentifyError> {
    let model = &chosen.model;
    let runs = model.rows().flat_map(|(rows, record)| even_runs(&record.time_s, rows.start)).collect();
    let whitener = Whitener::of(&chosen.minimum.point.residuals, runs);
    let known: Vec<Pole> = (0..model.modes).map(|mode| pole(&chosen.minimum.parameters, mode)).collect();
    let range = model.parameters(
        &known,
        model.delay_s(&chosen.minimum.parameters),
        model.rate_per_s(&chosen.minimum.parameters),
    );
    let refined = refine(model, &chosen.minimum, &range, whitener).or_refused(
        names(model.records),
        &model.records[0].output_column,
        model.modes,
    )?;

    let mut warnings: Vec<Warning> =
        model.records.iter().flat_map(|record| record.warnings.clone()).collect();
    let mut modes: Vec<IdentifiedMode> =
        (0..model.modes).map(|mode| identified_mode(model, &refined, mode, starts)).collect();
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    for dependence in &chosen.dependences {
        let away =
            |mode: &&mut IdentifiedMode| (mode.frequency_hz.value / dependence.mean.frequency_hz).ln().abs();
        if let Some(mode) = modes.iter_mut().min_by(|a, b| away(a).total_cmp(&away(b))) {
            mode.go_with_amplitude(dependence.points.clone(), dependence.changes.clone());
        }
    }
    let changes = told_changes(chosen, &mut modes);
    let opinions = opinions(model, &refined, starts, cross_checks);
    for mode in modes.iter_mut().filter(|_| cross_checks) {
        mode.cross_checks.extend(opinions.of(mode));
    }
    let nyquist_hz = starts.spectral.iter().map(Spectral::nyquist_hz).fold(0.0, f64::max);
    for mode in &modes {
        warnings.extend(mode_warnings(mode, model.records, starts));
        warnings.extend(mode.own_warnings(nyquist_hz, image(model, &refined, mode, nyquist_hz)));
    }
    let mut rejected = chosen.rejected.clone();
    rejected.extend(chosen.remarks.iter().cloned());
    let not_linear: Vec<Warning> = match changes.is_empty() {
        true => not_linear_warnings(chosen),
        false => changes,
    };
    rejected.extend(opinions.rejected(&modes));
    rejected.extend(model.records.iter().flat_map(|record| record.left_out.clone()));
    let span = span(model, &chosen.minimum);
    for (rows, record) in model.rows() {
        // What the input explains is gone from the residuals; lines that are left are driven by something
        // else.
        let first_row = rows.start;
        let left = &refined.residuals[rows];
        let fitted = FittedRecord {
            name: &record.name,
            first_row,
            time_s: record.time_s.iter().map(|t| t + record.origin_s).collect(),
            fitted: record.output.iter().zip(left).map(|(y, e)| y - e).collect(),
        };
        warnings.extend(time_shift_warnings(&fitted, &chosen.minimum.point.residuals, &span));
        let uniform = Uniform::new(&record.time_s, left);
        let input: Vec<f64> =
            record.input.sample(record.time_s.iter().copied()).into_iter().map(|value| value[0]).collect();
        let driven = DrivenLines::new(&input, left, uniform.interval_s);
        // A line that the input drives is no stranger's, whatever the structure makes of it.
        let tones = find_tones(&uniform);
        for tone in tones.iter().filter(|tone| !driven.at(tone.frequency_hz.value)) {
            let (warning, pole) = tone.told();
            warnings.push(warning);
            rejected.push(pole);
        }
        let output = record.with_taken_out(record.output.iter().copied());
        let is_told = |hz: f64, bin_hz: f64| tones.iter().any(|tone| tone.is_at(hz, bin_hz));
        warnings.extend(unexplained(&record.output_column, (&record.time_s, &output, left), is_told));
    }
    warnings.extend(fit_warnings(&chosen.minimum));
    warnings.extend(not_linear.clone());
    if let NoiseModel::NotNoise { apart, .. } = refined.noise {
        warnings.push(WarningKind::ResidualsNotNoise { apart }.into());
    }

    let record_fits: Vec<RecordFit> = model
        .rows()
        .enumerate()
        .map(|(index, (rows, record))| record_fit(model, &refined, index, rows, record))
        .collect();
    let coefficient = |index: usize| Estimate {
        value: refined.coefficients[index],
        stderr: refined.coefficient_stderr(index),
    };
    let delay = 2 * model.modes;
    let first = &model.records[0];
    let fitted = first.with_taken_out(first.output.iter().zip(&refined.residuals).map(|(y, e)| y - e));
    Ok(IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        linearity: Linearity::of(&modes).and_near(&not_linear),
        recording: names(model.records),
        kind: Some(kind_of_input(first)),
        shapes: Vec::new(),
        input: Some(first.input_column.clone()),
        output: first.output_column.clone(),
        modes,
        second_opinions: opinions.record.modes.clone(),
        survey: opinions.record,
        frf: starts.spectral.first().map(|spectral| spectral.frf.clone()),
        spectrum: None,
        offset: coefficient(model.offset_index(0)),
        delay_s: model
            .delay
            .then(|| Estimate { value: refined.parameters[delay], stderr: refined.stderr(delay) }),
        direct: model.direct_index().map(coefficient),
        real_pole: model.real_pole_index().map(|index| {
            let rate = model.rate_parameter();
            let time_constant_s = (-refined.parameters[rate]).exp();
            RealPole {
                time_constant_s: Estimate {
                    value: time_constant_s,
                    stderr: time_constant_s * refined.stderr(rate),
                },
                participation: coefficient(index),
            }
        }),
        residual_rms: refined.residual_rms(),
        window_s: record_fits[0].window_s,
        band_hz: None,
        records: record_fits,
        noise: refined.noise,
        model_choice: chosen.steps.clone(),
        rejected,
        stop_reason: chosen.minimum.stop_reason,
        warnings: merged(warnings),
        fit: FitTrace {
            time_s: first.time_s.iter().map(|t| t + first.origin_s).collect(),
            measured: first.with_taken_out(first.output.iter().copied()),
            fitted,
        },
    })
}

/// What changes modes in time, or with their amplitude or in time, each mode once; what their stretches seem
/// to say of the amplitude is dropped there, and their boxes hold all that they go through.
fn told_changes(chosen: &Chosen<'_>, modes: &mut [IdentifiedMode]) -> Vec<Warning> {
    let mut told = Vec::new();
    let mut hit = vec![false; modes.len()];
    let in_time = chosen.in_time.iter().rev().map(|one| {
        let warning = WarningKind::NotConstantNear {
            before_hz: one.before.frequency_hz,
            after_hz: one.after.frequency_hz,
            before_damping: one.before.damping_ratio,
            after_damping: one.after.damping_ratio,
            at_s: one.at_s,
        };
        (vec![one.before, one.after], warning)
    });
    let unclear = chosen.dependences.iter().filter(|one| one.is_unclear).map(|one| {
        let poles = one.points.iter().map(|point| Pole {
            frequency_hz: point.frequency_hz.value,
            damping_ratio: point.damping_ratio.value,
        });
        (poles.collect(), WarningKind::NotLinearOrNotConstantNear { frequency_hz: one.mean.frequency_hz })
    });
    for (poles, warning) in unclear.chain(in_time) {
        let Some(first) = poles.first() else { continue };
        let away = |k: &usize| (modes[*k].frequency_hz.value / first.frequency_hz).ln().abs();
        let Some(nearest) = (0..modes.len()).min_by(|a, b| away(a).total_cmp(&away(b))) else { continue };
        if std::mem::replace(&mut hit[nearest], true) {
            continue;
        }
        modes[nearest].hold(&poles);
        told.push(Warning::from(warning));
    }
    told
}

/// Where the choice found what no further mode may explain; each place once, the worst first.
fn not_linear_warnings(chosen: &Chosen<'_>) -> Vec<Warning> {
    let mut places = chosen.not_linear.clone();
    places.sort_by(|a, b| b.times_floor.total_cmp(&a.times_floor));
    let mut told: Vec<NotLinear> = Vec::new();
    for place in places {
        if told.iter().all(|known| (known.frequency_hz / place.frequency_hz).ln().abs() > SAME_PLACE) {
            told.push(place);
        }
    }
    let blow = |record: &ForcedRecord| {
        let force: Vec<f64> = record.input.coefficients.iter().map(|cubic| cubic[0]).collect();
        samples_of_a_blow(&force).filter(|_| record.input_kind == InputKind::Force)
    };
    // The shortest blow decides: it is the one that is known least.
    let shortest = chosen.model.records.iter().filter_map(blow).min();
    if let Some(samples) = shortest.filter(|samples| *samples < ENOUGH_OF_A_BLOW) {
        let worst = told.first().map(|place| place.frequency_hz);
        return worst
            .map(|frequency_hz| WarningKind::BlowsOfFewSamples { frequency_hz, samples }.into())
            .into_iter()
            .collect();
    }
    let warning = |NotLinear { frequency_hz, times_floor }| {
        Warning::from(WarningKind::NotLinearNear { frequency_hz, times_floor })
    };
    told.into_iter().map(warning).collect()
}

/// Samples of a blow from which a spline through them is the blow to within the noise of a load cell.
const ENOUGH_OF_A_BLOW: usize = 6;
/// Places this close, as a share of the frequency, are one.
const SAME_PLACE: f64 = 0.05;

/// What the record says of a mode's image.
fn image(model: &ForcedModel<'_>, refined: &Refined, mode: &IdentifiedMode, nyquist_hz: f64) -> Image {
    let away =
        |index: &usize| (pole(&refined.parameters, *index).frequency_hz - mode.frequency_hz.value).abs();
    let index = (0..model.modes).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
    image_of(model, &refined.parameters, &refined.residuals, index, nyquist_hz)
}

/// What the classical methods see in the first record.
fn opinions(model: &ForcedModel<'_>, refined: &Refined, starts: &Starts, with_replica: bool) -> Opinions {
    let first = model.rows().zip(&starts.spectral).zip(&starts.surveys).next();
    let Some((((rows, record), spectral), survey)) = first else {
        return Opinions { record: Survey::default(), replica: Survey::default() };
    };
    let again = with_replica.then(|| {
        let output = replica(&record.output, &refined.residuals[rows]);
        survey_forced(&spectral.with_output(&record.time_s, &output), None)
    });
    Opinions { record: survey.clone(), replica: again.unwrap_or_default() }
}

fn record_fit(
    model: &ForcedModel<'_>,
    refined: &Refined,
    index: usize,
    rows: Range<usize>,
    record: &ForcedRecord,
) -> RecordFit {
    let offset = model.offset_index(index);
    let left = &refined.residuals[rows.clone()];
    let ends = [record.time_s.first(), record.time_s.last()];
    let residual_rms = (dot(left, left) / left.len().max(1) as f64).sqrt();
    RecordFit {
        recording: record.name.clone(),
        rows: rows.len(),
        offset: Estimate { value: refined.coefficients[offset], stderr: refined.coefficient_stderr(offset) },
        residual_rms,
        fit_percent: fit_percent(&record.with_taken_out(record.output.iter().copied()), residual_rms),
        window_s: ends.map(|end| end.map_or(0.0, |t| t + record.origin_s)),
    }
}

/// One mode with its standard errors and its second opinion.
fn identified_mode(
    model: &ForcedModel<'_>,
    refined: &Refined,
    mode: usize,
    starts: &Starts,
) -> IdentifiedMode {
    let pole = pole(&refined.parameters, mode);
    let columns = model.mode_columns(pole, model.delay_s(&refined.parameters));
    let at = mode * model.columns_per_mode();
    let mut contribution = vec![0.0; refined.residuals.len()];
    for (column, factor) in columns.iter().zip(&refined.coefficients[at..]) {
        column.add_to(&mut contribution, *factor);
    }
    let largest = contribution.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
    let participation = Estimate { value: refined.coefficients[at], stderr: refined.coefficient_stderr(at) };
    let points = of_forced(model, &refined.parameters, mode);
    let changes = changes_not_in_time(&points, CLEAR);
    let mut identified = IdentifiedMode {
        frequency_hz: Estimate {
            value: pole.frequency_hz,
            stderr: pole.frequency_hz * refined.stderr(2 * mode),
        },
        damping_ratio: Estimate {
            value: pole.damping_ratio,
            stderr: pole.damping_ratio * refined.stderr(2 * mode + 1),
        },
        method: Method::OutputError,
        amplitude: Estimate {
            value: largest,
            stderr: largest * (participation.stderr / participation.value).abs(),
        },
        participation: Some(participation),
        rate_participation: model.rate_share_index(mode).map(|index| Estimate {
            value: refined.coefficients[index],
            stderr: refined.coefficient_stderr(index),
        }),
        cross_checks: starts
            .spectral
            .iter()
            .filter_map(|spectral| spectral.half_power(pole))
            .take(1)
            .collect(),
        by_amplitude: Vec::new(),
        amplitude_changes: Vec::new(),
        uncertainty_box: UncertaintyBox::default(),
    };
    identified.go_with_amplitude(points, changes);
    identified
}

/// Warnings about one mode.
fn mode_warnings(mode: &IdentifiedMode, records: &[ForcedRecord], starts: &Starts) -> Vec<Warning> {
    let pole = Pole { frequency_hz: mode.frequency_hz.value, damping_ratio: mode.damping_ratio.value };
    let mode_hz = pole.frequency_hz;
    let mut warnings: Vec<Warning> = Vec::new();
    let duration_s = records.iter().map(ForcedRecord::duration_s).fold(0.0, f64::max);
    if duration_s < pole.decay_time_s() {
        warnings.push(
            WarningKind::RecordShorterThanDecay { mode_hz, duration_s, decay_time_s: pole.decay_time_s() }
                .into(),
        );
    }
    let limit_hz_s = (2.0 * pole.damping_ratio * mode_hz).powi(2);
    let rates = starts.spectral.iter().filter_map(|spectral| spectral.sweep_rate_at(mode_hz));
    let slowest = rates.fold(f64::INFINITY, f64::min);
    if slowest.is_finite() && slowest > limit_hz_s {
        let modes = vec![FastPassage { mode_hz, rate_hz_s: slowest, limit_hz_s }];
        warnings.push(WarningKind::SweepTooFast { modes }.into());
    }
    let bands = starts.spectral.iter().map(Spectral::excited_band_hz);
    let [lower_hz, upper_hz] =
        bands.fold([f64::INFINITY, 0.0], |all, band| [all[0].min(band[0]), all[1].max(band[1])]);
    if !(lower_hz..=upper_hz).contains(&mode_hz) {
        warnings.push(WarningKind::OutsideExcitedBand { mode_hz, lower_hz, upper_hz }.into());
    }
    for check in &mode.cross_checks {
        warnings.extend(disagreement(mode, check, duration_s));
    }
    if pole.damping_ratio <= MIN_DAMPING * 1.001 {
        warnings.push(
            WarningKind::AtBound { mode_hz, quantity: Quantity::DampingRatio, bound: MIN_DAMPING }.into(),
        );
    }
    warnings
}

/// Warnings for a cross-check more than three standard errors away, and farther than a record of this length
/// resolves.
pub(crate) fn disagreement(mode: &IdentifiedMode, check: &CrossCheck, duration_s: f64) -> Vec<Warning> {
    let [least_hz, least_ratio] = resolution(mode.frequency_hz.value, mode.damping_ratio.value, duration_s);
    let pairs = [
        (Quantity::FrequencyHz, mode.frequency_hz, check.frequency_hz, least_hz),
        (Quantity::DampingRatio, mode.damping_ratio, check.damping_ratio, least_ratio),
    ];
    let mut warnings = Vec::new();
    for (quantity, fitted, other, least) in pairs {
        if let Some(other) = other
            && fitted.distance(&other) > 3.0
            && (fitted.value - other.value).abs() > least
        {
            warnings.push(
                WarningKind::CrossCheckDisagrees {
                    mode_hz: mode.frequency_hz.value,
                    quantity,
                    method: check.method.clone(),
                    fitted: fitted.value,
                    other: other.value,
                    stderr: fitted.stderr.hypot(other.stderr),
                }
                .into(),
            );
        }
    }
    warnings
}

/// Warnings about the search itself.
pub(crate) fn fit_warnings(minimum: &Minimum<Projected>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if !minimum.stop_reason.converged() {
        warnings.push(WarningKind::NotConverged { steps: minimum.steps }.into());
    }
    warnings
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Recording;

    use super::*;
    use crate::interpolation::InputInterpolation;
    use crate::levenberg_marquardt::Parameter;
    use crate::separable::fit;

    /// What is reported of a record pushed by a swept force and fitted with modes at these frequencies, which
    /// stay where they are.
    fn reported(frequencies_hz: &[f64]) -> Result<IdentifiedModes, IdentifyError> {
        // Uneven stamps have no noise model, and what is fitted stays as it was.
        let time_s: Vec<f64> =
            (0..2000).map(|k| 0.01 * f64::from(k) + 0.002 * f64::from(k * k).sin()).collect();
        let wave = |t: &f64| (t * (1.0 + 1.5 * t)).sin();
        let recording = Recording::new("pushed", time_s.clone())
            .with_column("force_N", time_s.iter().map(wave).collect())
            .with_column("tip_m", time_s.iter().map(|t| 0.1 * wave(&(t - 0.3))).collect());
        let columns = ("force_N", "tip_m");
        let record =
            ForcedRecord::new(&recording, columns, (None, None), InputInterpolation::Cubic, 0.0, true)
                .unwrap();
        let records = [record];
        let model = ForcedModel {
            records: &records,
            modes: frequencies_hz.len(),
            delay: false,
            max_delay_s: 0.0,
            direct: false,
            real_pole: false,
        };
        let poles: Vec<Pole> = frequencies_hz
            .iter()
            .map(|frequency_hz| Pole { frequency_hz: *frequency_hz, damping_ratio: 0.02 })
            .collect();
        let stay =
            |parameter: Parameter| Parameter { lower: parameter.start, upper: parameter.start, ..parameter };
        let fixed: Vec<Parameter> = model.parameters(&poles, 0.0, None).into_iter().map(stay).collect();
        let minimum = fit(&model, &fixed).unwrap();
        report(&Chosen::new(model, minimum), &Starts::new(&records), false)
    }

    #[test]
    fn modes_without_standard_errors_are_refused_and_not_reported() {
        assert_eq!(reported(&[2.0, 3.0]).unwrap().modes.len(), 2);
        let refusal = reported(&[2.0, 2.0]).unwrap_err();
        assert!(
            matches!(&refusal, IdentifyError::NotDetermined { recording, column, modes: 2 }
                if recording == "pushed" && column == "tip_m"),
            "{refusal}"
        );
    }
}
