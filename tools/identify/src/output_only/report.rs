//! The result of an output-only identification: modes with their errors, and their shapes.

use stillbeam_recording::Recording;

use super::{Found, OutputOnlyOptions};
use crate::aliasing::Image;
use crate::decay_modes::Uniform;
use crate::forced_record::left_out;
use crate::levenberg_marquardt::StopReason;
use crate::linearity::Linearity;
use crate::poles::Survey;
use crate::record_kind::RecordKind;
use crate::result::{
    Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, ModeShape, NoiseModel, RecordFit, Rejected,
    SCHEMA_VERSION, UncertaintyBox, fit_percent,
};

/// Turns the modes of a recording into its result.
pub(super) fn report(
    recording: &Recording,
    options: &OutputOnlyOptions,
    first: &Uniform,
    found: &[Found],
    (survey, mut rejected): (Survey, Vec<Rejected>),
) -> IdentifiedModes {
    let modes: Vec<IdentifiedMode> = found.iter().map(identified).collect();
    let samples = first.samples();
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let variance = samples.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / samples.len() as f64;
    let offset = Estimate { value: mean, stderr: f64::INFINITY };
    let explained: f64 = found.iter().map(|mode| mode.variance).sum();
    let left = (variance - explained).max(0.0).sqrt();
    let ends = [recording.time_s.first(), recording.time_s.last()].map(|t| t.copied().unwrap_or(0.0));
    rejected.extend(left_out(recording, &options.outputs[0], ends));
    let shapes = match options.outputs.len() {
        0 | 1 => Vec::new(),
        _ => found
            .iter()
            .map(|mode| ModeShape::of(mode.frequency_hz.value, &options.outputs, &mode.shape))
            .collect(),
    };
    let nyquist_hz = 0.5 / first.interval_s;
    let warnings = modes.iter().flat_map(|mode| mode.own_warnings(nyquist_hz, Image::Unknown)).collect();
    IdentifiedModes {
        schema_version: SCHEMA_VERSION,
        linearity: Linearity::of(&modes),
        recording: recording.name.clone(),
        kind: Some(RecordKind::Random),
        shapes,
        input: None,
        output: options.outputs[0].clone(),
        modes,
        second_opinions: Vec::new(),
        survey,
        frf: None,
        spectrum: Some(first.spectrum.clone()),
        offset,
        delay_s: None,
        direct: None,
        real_pole: None,
        residual_rms: left,
        window_s: ends,
        band_hz: None,
        records: vec![RecordFit {
            recording: recording.name.clone(),
            rows: samples.len(),
            offset,
            residual_rms: left,
            fit_percent: fit_percent(samples, left),
            window_s: ends,
        }],
        noise: NoiseModel::default(),
        model_choice: Vec::new(),
        rejected,
        stop_reason: StopReason::StepSmall,
        warnings,
        fit: FitTrace::default(),
    }
}

fn identified(found: &Found) -> IdentifiedMode {
    IdentifiedMode {
        frequency_hz: found.frequency_hz,
        damping_ratio: found.damping_ratio,
        method: Method::CovarianceSubspace,
        // A mode of this variance swings by this amplitude, as a steady one would.
        amplitude: Estimate { value: (2.0 * found.variance).sqrt(), stderr: f64::INFINITY },
        participation: None,
        rate_participation: None,
        cross_checks: Vec::new(),
        by_amplitude: Vec::new(),
        amplitude_changes: Vec::new(),
        uncertainty_box: UncertaintyBox::of(&found.frequency_hz, &found.damping_ratio),
    }
}
