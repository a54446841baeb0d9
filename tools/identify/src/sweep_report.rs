//! What a forced fit has to say: estimates with standard errors, cross-checks, warnings.

use crate::forced_record::ForcedRecord;
use crate::forced_start::Spectral;
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::Pole;
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, SCHEMA_VERSION,
};
use crate::separable::{Projected, fit_covariance};
use crate::sweep_fit::{ForcedModel, MIN_DAMPING, pole};
use crate::tall::add_scaled;
use crate::warnings::{Quantity, Warning, WarningKind};

/// Turns a finished fit into the result.
pub(crate) fn report(
    model: &ForcedModel,
    minimum: &Minimum<Projected>,
    spectral: &Spectral,
) -> IdentifiedModes {
    let record = model.record;
    let covariance = fit_covariance(model, minimum);
    let stderr =
        |index: usize| covariance.as_ref().map_or(f64::INFINITY, |c| c[(index, index)].max(0.0).sqrt());
    let linear = minimum.parameters.len();
    let coefficients = &minimum.point.coefficients;
    let times_s = model.input_times(&minimum.parameters);
    let mut warnings = record.warnings.clone();
    let fitted: Vec<f64> = record.output.iter().zip(&minimum.point.residuals).map(|(y, r)| y - r).collect();

    let mut modes: Vec<IdentifiedMode> = (0..model.modes)
        .map(|mode| {
            let pole = pole(&minimum.parameters, mode);
            let columns = model.mode_columns(pole, &times_s);
            let own = &coefficients[3 * mode..3 * mode + 3];
            let mut contribution = vec![0.0; record.time_s.len()];
            for (column, factor) in columns.iter().zip(own) {
                add_scaled(&mut contribution, *factor, column);
            }
            let largest = contribution.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
            let participation = Estimate { value: own[0], stderr: stderr(linear + 3 * mode) };
            let estimated = IdentifiedMode {
                frequency_hz: Estimate {
                    value: pole.frequency_hz,
                    stderr: pole.frequency_hz * stderr(2 * mode),
                },
                damping_ratio: Estimate {
                    value: pole.damping_ratio,
                    stderr: pole.damping_ratio * stderr(2 * mode + 1),
                },
                method: Method::OutputError,
                amplitude: Estimate {
                    value: largest,
                    stderr: largest * (participation.stderr / participation.value).abs(),
                },
                participation: Some(participation),
                cross_checks: spectral.half_power(pole).into_iter().collect(),
            };
            warnings.extend(mode_warnings(&estimated, pole, record, spectral));
            estimated
        })
        .collect();
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    warnings.extend(fit_warnings(minimum, covariance.is_some()));

    let delay_s = (model.max_delay_s > 0.0)
        .then(|| Estimate { value: minimum.parameters[linear - 1], stderr: stderr(linear - 1) });
    let n = record.time_s.len();
    let time_s: Vec<f64> = record.time_s.iter().map(|t| t + record.origin_s).collect();
    IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        recording: record.name.clone(),
        input: Some(record.input_column.clone()),
        output: record.output_column.clone(),
        modes,
        frf: Some(spectral.frf.clone()),
        spectrum: None,
        offset: Estimate { value: coefficients[3 * model.modes], stderr: stderr(linear + 3 * model.modes) },
        delay_s,
        residual_rms: (minimum.sum_of_squares / n as f64).sqrt(),
        window_s: [time_s[0], time_s[n - 1]],
        stop_reason: minimum.stop_reason,
        warnings,
        fit: FitTrace { time_s, measured: record.output.clone(), fitted },
    }
}

fn mode_warnings(
    mode: &IdentifiedMode,
    pole: Pole,
    record: &ForcedRecord,
    spectral: &Spectral,
) -> Vec<Warning> {
    let mode_hz = pole.frequency_hz;
    let mut warnings: Vec<Warning> = Vec::new();
    let duration_s = record.duration_s();
    if duration_s < pole.decay_time_s() {
        warnings.push(
            WarningKind::RecordShorterThanDecay { mode_hz, duration_s, decay_time_s: pole.decay_time_s() }
                .into(),
        );
    }
    let limit_hz_s = (2.0 * pole.damping_ratio * mode_hz).powi(2);
    if let Some(rate_hz_s) = spectral.sweep_rate_at(mode_hz)
        && rate_hz_s > limit_hz_s
    {
        warnings.push(WarningKind::SweepTooFast { mode_hz, rate_hz_s, limit_hz_s }.into());
    }
    let [lower_hz, upper_hz] = spectral.excited_band_hz();
    if !(lower_hz..=upper_hz).contains(&mode_hz) {
        warnings.push(WarningKind::OutsideExcitedBand { mode_hz, lower_hz, upper_hz }.into());
    }
    for check in &mode.cross_checks {
        warnings.extend(disagreement(mode, check));
    }
    if pole.damping_ratio <= MIN_DAMPING * 1.001 {
        warnings.push(
            WarningKind::AtBound { mode_hz, quantity: Quantity::DampingRatio, bound: MIN_DAMPING }.into(),
        );
    }
    warnings
}

/// Warnings for a cross-check more than three standard errors away.
pub(crate) fn disagreement(mode: &IdentifiedMode, check: &CrossCheck) -> Vec<Warning> {
    let pairs = [
        (Quantity::FrequencyHz, mode.frequency_hz, check.frequency_hz),
        (Quantity::DampingRatio, mode.damping_ratio, check.damping_ratio),
    ];
    let mut warnings = Vec::new();
    for (quantity, fitted, other) in pairs {
        if let Some(other) = other
            && fitted.distance(&other) > 3.0
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
pub(crate) fn fit_warnings(minimum: &Minimum<Projected>, has_covariance: bool) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if !minimum.stop_reason.converged() {
        warnings.push(WarningKind::NotConverged { steps: minimum.steps }.into());
    }
    if !has_covariance {
        warnings.push(WarningKind::NoStandardErrors.into());
    }
    warnings
}
