//! What a fit of functions of frequency has to say.

use stillbeam_recording::{Spectrum as Imported, SpectrumKind};

use nalgebra::DMatrix;

use super::choice::{Chosen, ModalModel};
use super::power_model::PowerModel;
use super::response_model::{PER_RESPONSE, ResponseModel};
use crate::error::IdentifyError;
use crate::forced_report::{disagreement, fit_warnings};
use crate::frf::FrfEstimate;
use crate::linearity::{Linearity, LinearityVerdict};
use crate::modal_response::Pole;
use crate::poles::{MethodMode, Survey};
use crate::responses::{Frf, Spectrum};
use crate::result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, NoiseModel, RecordFit,
    SCHEMA_VERSION, UncertaintyBox, fit_percent,
};
use crate::separable::fit_covariance;
use crate::tall::dot;
use crate::warning_merge::merged;
use crate::warnings::{Warning, WarningKind};

/// Lines per half-power band below which a peak's width is hardly seen.
const LINES_PER_BAND: f64 = 2.0;
/// How near, as a share of the frequency, a method's mode has to be to be the same.
const SAME: f64 = 0.01;

/// The result of a fit of frequency responses.
///
/// # Errors
/// [`IdentifyError::NotDetermined`] where there are no standard errors.
pub(super) fn of_responses(
    chosen: &Chosen<ResponseModel>,
    responses: &[FrfEstimate],
    spectra: &[&Imported],
    survey: Survey,
    (file, output): (&str, &str),
) -> Result<IdentifiedModes, IdentifyError> {
    let covariance = covariance_of(chosen, file, output)?;
    let model = &chosen.model;
    let first = spectra[0];
    let order = first.per_unit.as_deref().filter(|unit| *unit == "N").and(first.unit.as_deref());
    let order = order.and_then(|unit| match unit {
        "m" => Some(0),
        "m_s" => Some(1),
        "m_s2" => Some(2),
        _ => None,
    });
    let line_hz = responses.iter().map(FrfEstimate::resolution_hz).fold(f64::INFINITY, f64::min);
    let linear = 2 * model.modes();
    let modes = chosen.poles().into_iter().enumerate().map(|(mode, pole)| {
        // Residues of the first response, in its unit times rad/s.
        let at = mode * PER_RESPONSE * responses.len();
        let unit = model.scales[0] * pole.damping_ratio * pole.omega();
        let part = |side: usize| Estimate {
            value: unit * chosen.minimum.point.coefficients[at + side],
            stderr: unit * covariance[(linear + at + side, linear + at + side)].max(0.0).sqrt(),
        };
        let [real, imaginary] = [0, 1].map(part);
        let decay_per_s = pole.damping_ratio * pole.omega();
        let size = real.value.hypot(imaginary.value);
        let stderr = real.stderr.hypot(imaginary.stderr);
        let mut one = mode_of(&covariance, mode, pole, Method::ResponseFit);
        one.amplitude = Estimate { value: size / decay_per_s, stderr: stderr / decay_per_s };
        one.participation = order.map(|order| {
            // The residue of s^order / (s² + ...) is lambda^order / (2 i omega_d).
            let residue = pole.lambda().powi(order) / num(0.0, 2.0 * pole.lambda().im);
            Estimate {
                value: (num(real.value, imaginary.value) / residue).re,
                stderr: stderr / residue.norm(),
            }
        });
        one.cross_checks = cross_checks(&survey, pole);
        one
    });
    let modes: Vec<IdentifiedMode> = sorted(modes.collect());
    let mut warnings = width_warnings(&modes, line_hz);
    let [low, high] = model.band_hz();
    let periods_s = 1.0 / line_hz.max((high - low) * 1e-6);
    for mode in &modes {
        let local = mode.cross_checks.iter().filter(|check| check.method == "local_rational");
        warnings.extend(local.flat_map(|check| disagreement(mode, check, periods_s)));
    }
    warnings.extend(fit_warnings(&chosen.minimum));
    let frf = &responses[0];
    let scale = model.scales[0];
    let lines = frf.frequency_hz.len();
    let left = scaled(&chosen.minimum.point.residuals[..2 * lines], scale);
    let measured: Vec<f64> =
        frf.response.iter().map(|value| value.re).chain(frf.response.iter().map(|value| value.im)).collect();
    let mut result = result(chosen, modes, (file, output), &measured, &left);
    result.frf = Some(Frf {
        frequency_hz: frf.frequency_hz.clone(),
        real: frf.response.iter().map(|value| value.re).collect(),
        imag: frf.response.iter().map(|value| value.im).collect(),
        ..Frf::default()
    });
    result.second_opinions = survey.modes.clone();
    result.survey = survey;
    result.warnings = merged(warnings);
    Ok(result)
}

/// The result of a fit of a power spectrum.
///
/// # Errors
/// As [`of_responses`].
pub(super) fn of_power(
    chosen: &Chosen<PowerModel>,
    spectrum: &Imported,
    (file, output): (&str, &str),
) -> Result<IdentifiedModes, IdentifyError> {
    let covariance = covariance_of(chosen, file, output)?;
    let model = &chosen.model;
    let density = model.unweighted(&crate::separable::Separable::target(model, &[]));
    let modes = chosen.poles().into_iter().enumerate().map(|(mode, pole)| {
        let power: f64 = chosen.minimum.point.coefficients[2 * mode..2 * mode + 2].iter().sum();
        let mut one = mode_of(&covariance, mode, pole, Method::PowerFit);
        one.amplitude = Estimate { value: power.abs().sqrt(), stderr: f64::INFINITY };
        one
    });
    let modes: Vec<IdentifiedMode> = sorted(modes.collect());
    let lines: Vec<f64> = spectrum.frequency_hz.clone();
    let line_hz = lines.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let known = matches!(spectrum.kind, SpectrumKind::PowerDensity | SpectrumKind::Power);
    let what = if known { spectrum.kind.words() } else { "a spectrum of one signal" };
    let mut warnings = vec![Warning::from(WarningKind::FromPowerSpectrum { what: what.to_owned(), line_hz })];
    warnings.extend(width_warnings(&modes, line_hz));
    warnings.extend(fit_warnings(&chosen.minimum));
    let left = model.unweighted(&chosen.minimum.point.residuals);
    let mut result = result(chosen, modes, (file, output), &density, &left);
    let used = lines.iter().copied().filter(|hz| (model.band_hz()[0]..=model.band_hz()[1]).contains(hz));
    result.spectrum = Some(Spectrum { frequency_hz: used.collect(), density });
    result.warnings = merged(warnings);
    Ok(result)
}

fn num(re: f64, im: f64) -> rustfft::num_complex::Complex64 {
    rustfft::num_complex::Complex64::new(re, im)
}

fn covariance_of<M: ModalModel>(
    chosen: &Chosen<M>,
    file: &str,
    output: &str,
) -> Result<DMatrix<f64>, IdentifyError> {
    fit_covariance(&chosen.model, &chosen.minimum).ok_or_else(|| IdentifyError::NotDetermined {
        recording: file.to_owned(),
        column: output.to_owned(),
        modes: chosen.model.modes(),
    })
}

/// Frequency and damping of a mode with their standard errors, and nothing else.
fn mode_of(covariance: &DMatrix<f64>, mode: usize, pole: Pole, method: Method) -> IdentifiedMode {
    let stderr = |at: usize| covariance[(at, at)].max(0.0).sqrt();
    let frequency_hz = Estimate { value: pole.frequency_hz, stderr: pole.frequency_hz * stderr(2 * mode) };
    let damping_ratio =
        Estimate { value: pole.damping_ratio, stderr: pole.damping_ratio * stderr(2 * mode + 1) };
    IdentifiedMode {
        frequency_hz,
        damping_ratio,
        method,
        amplitude: Estimate { value: 0.0, stderr: f64::INFINITY },
        participation: None,
        rate_participation: None,
        cross_checks: Vec::new(),
        by_amplitude: Vec::new(),
        amplitude_changes: Vec::new(),
        uncertainty_box: UncertaintyBox::default(),
    }
    .with_amplitudes(Vec::new(), None)
}

fn sorted(mut modes: Vec<IdentifiedMode>) -> Vec<IdentifiedMode> {
    modes.sort_by(|a, b| a.frequency_hz.value.total_cmp(&b.frequency_hz.value));
    modes
}

/// What the classical methods say of a mode, each once.
fn cross_checks(survey: &Survey, pole: Pole) -> Vec<CrossCheck> {
    let away = |seen: &MethodMode| (seen.frequency_hz / pole.frequency_hz).ln().abs();
    let mut near: Vec<&MethodMode> =
        survey.modes.iter().filter(|seen| away(seen) < SAME.max(pole.damping_ratio)).collect();
    near.sort_by(|a, b| a.method.name().cmp(b.method.name()).then(away(a).total_cmp(&away(b))));
    near.dedup_by_key(|seen| seen.method);
    let estimate =
        |value: f64, stderr: Option<f64>| Estimate { value, stderr: stderr.unwrap_or(f64::INFINITY) };
    let check = |seen: &MethodMode| CrossCheck {
        method: seen.method.name().to_owned(),
        frequency_hz: Some(estimate(seen.frequency_hz, seen.frequency_stderr_hz)),
        damping_ratio: Some(estimate(seen.damping_ratio, seen.damping_stderr)),
    };
    near.into_iter().map(check).collect()
}

/// Modes whose peaks are hardly wider than the lines are apart.
fn width_warnings(modes: &[IdentifiedMode], line_hz: f64) -> Vec<Warning> {
    let narrow = modes
        .iter()
        .filter(|mode| 2.0 * mode.damping_ratio.value * mode.frequency_hz.value < LINES_PER_BAND * line_hz);
    let warning = |mode: &IdentifiedMode| {
        let (mode_hz, damping_ratio) = (mode.frequency_hz.value, mode.damping_ratio.value);
        Warning::from(WarningKind::PeakNarrowerThanLines { mode_hz, damping_ratio, line_hz })
    };
    narrow.map(warning).collect()
}

fn scaled(values: &[f64], by: f64) -> Vec<f64> {
    values.iter().map(|value| value * by).collect()
}

fn result<M: ModalModel>(
    chosen: &Chosen<M>,
    modes: Vec<IdentifiedMode>,
    (file, output): (&str, &str),
    measured: &[f64],
    left: &[f64],
) -> IdentifiedModes {
    let residual_rms = (dot(left, left) / left.len().max(1) as f64).sqrt();
    let none = Estimate { value: 0.0, stderr: f64::INFINITY };
    IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        recording: file.to_owned(),
        kind: None,
        shapes: Vec::new(),
        input: None,
        output: output.to_owned(),
        modes,
        second_opinions: Vec::new(),
        frf: None,
        spectrum: None,
        offset: none,
        delay_s: None,
        direct: None,
        real_pole: None,
        residual_rms,
        window_s: [0.0; 2],
        band_hz: Some(chosen.model.band_hz()),
        records: vec![RecordFit {
            recording: file.to_owned(),
            rows: left.len(),
            offset: none,
            residual_rms,
            fit_percent: fit_percent(measured, residual_rms),
            window_s: [0.0; 2],
        }],
        linearity: Linearity {
            verdict: LinearityVerdict::NotTested,
            statement: "A function of frequency does not show whether the structure is linear; record signals over time at two levels of excitation.".to_owned(),
        },
        noise: NoiseModel::White,
        model_choice: Vec::new(),
        rejected: chosen.rejected.clone(),
        stop_reason: chosen.minimum.stop_reason,
        warnings: Vec::new(),
        fit: FitTrace::default(),
        survey: Survey::default(),
    }
}
