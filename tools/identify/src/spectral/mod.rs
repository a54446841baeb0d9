//! Modes from functions of frequency, where there is no record over time: frequency responses and power
//! spectra.
//!
//! Responses are fitted by the modal model with poles common to all of them ([`response_model`]), started by
//! the least-squares complex frequency method, whose poles and the local rational ones stand beside the
//! result. A power spectrum has no phase and knows nothing of what excited it: its peaks are fitted as those
//! of modes under an even excitation ([`power_model`]), and the result says what that is worth.

mod choice;
mod power_model;
mod report;
mod response_model;
mod starts;

use stillbeam_recording::{ImportedSpectra, Spectrum, SpectrumKind, SpectrumValues};

use crate::error::IdentifyError;
use crate::forced_fit::check_modes;
use crate::frf::{FrfEstimate, FrfEstimator};
use crate::result::IdentifiedModes;
use choice::{Chosen, choose};
use power_model::PowerModel;
use response_model::ResponseModel;
use rustfft::num_complex::Complex64;

/// Choices of [`identify_spectra`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectralOptions {
    /// The functions of the file to use, by name; empty takes all frequency responses, or the strongest power
    /// spectrum.
    pub outputs: Vec<String>,
    /// How many modes; `None` takes all that explain a noticeable part.
    pub modes: Option<usize>,
    /// Lowest and highest frequency to use, Hz.
    pub band_hz: Option<[f64; 2]>,
}

/// Lines that a fit of one mode needs at least.
const MIN_LINES: usize = 16;

/// Identifies modes from the functions of frequency of a file.
///
/// # Errors
/// [`IdentifyError`] when there are none to use, too few lines, or no resonance in them.
pub fn identify_spectra(
    file: &ImportedSpectra,
    options: &SpectralOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    check_modes(options.modes)?;
    let used = used(file, options)?;
    let name = used.iter().map(|spectrum| spectrum.name.as_str()).collect::<Vec<_>>().join(", ");
    if used[0].kind == SpectrumKind::FrequencyResponse {
        let responses = used.iter().map(|spectrum| response(spectrum, options, file));
        let responses: Vec<FrfEstimate> = responses.collect::<Result<_, _>>()?;
        let survey = starts::survey(&responses);
        let chosen =
            choose(ResponseModel::new(&responses), starts::poles(&survey, &responses), options.modes);
        let chosen = found(chosen, file, &name, options)?;
        return report::of_responses(&chosen, &responses, &used, survey, (&file.name, &name));
    }
    let (frequency_hz, density) = power(used[0], options, file)?;
    let peaks = starts::peaks(&frequency_hz, &density);
    let chosen = choose(PowerModel::new(&frequency_hz, &density), peaks, options.modes);
    let chosen = found(chosen, file, &name, options)?;
    report::of_power(&chosen, used[0], (&file.name, &name))
}

/// The functions that are asked for, or those to choose: all responses, else the strongest power spectrum of
/// one signal.
fn used<'f>(
    file: &'f ImportedSpectra,
    options: &SpectralOptions,
) -> Result<Vec<&'f Spectrum>, IdentifyError> {
    let no_such = |name: &str| IdentifyError::NoSuchSpectrum {
        file: file.name.clone(),
        name: name.to_owned(),
        known: file.spectra.iter().map(|spectrum| spectrum.name.clone()).collect(),
    };
    let asked: Vec<&Spectrum> = options
        .outputs
        .iter()
        .map(|name| file.spectra.iter().find(|spectrum| spectrum.name == *name).ok_or_else(|| no_such(name)))
        .collect::<Result<_, _>>()?;
    let complex = |spectrum: &&Spectrum| {
        spectrum.kind == SpectrumKind::FrequencyResponse
            && matches!(spectrum.values, SpectrumValues::Complex { .. })
    };
    let from: Vec<&Spectrum> = if asked.is_empty() { file.spectra.iter().collect() } else { asked };
    let responses: Vec<&Spectrum> = from.iter().copied().filter(complex).collect();
    if !responses.is_empty() {
        return Ok(responses);
    }
    // A sum over axes, which its name tells, is the strongest and belongs to none.
    let strength = |spectrum: &&Spectrum| -> f64 {
        let sum = spectrum.name.contains("xyz") && options.outputs.is_empty();
        if sum { 0.0 } else { squares(&spectrum.values, spectrum.kind).iter().sum() }
    };
    let strongest = from.into_iter().max_by(|a, b| strength(a).total_cmp(&strength(b)));
    strongest.map(|spectrum| vec![spectrum]).ok_or_else(|| no_such("any"))
}

/// Powers, whatever the spectrum states.
fn squares(values: &SpectrumValues, kind: SpectrumKind) -> Vec<f64> {
    let amplitude = matches!(kind, SpectrumKind::Amplitude | SpectrumKind::FrequencyResponse);
    match values {
        SpectrumValues::Real(values) if amplitude => values.iter().map(|value| value * value).collect(),
        SpectrumValues::Real(values) => values.clone(),
        SpectrumValues::Complex { real, imaginary } => {
            let pairs = real.iter().zip(imaginary);
            pairs.map(|(re, im)| if amplitude { re * re + im * im } else { *re }).collect()
        }
    }
}

fn too_few(file: &ImportedSpectra, spectrum: &Spectrum, lines: usize) -> IdentifyError {
    IdentifyError::TooFewSamples {
        recording: file.name.clone(),
        column: spectrum.name.clone(),
        found: lines,
        required: MIN_LINES,
        context: " (lines of the spectrum) in the band",
    }
}

fn in_band(options: &SpectralOptions, hz: f64) -> bool {
    hz > 0.0 && options.band_hz.is_none_or(|[low, high]| (low..=high).contains(&hz))
}

fn response(
    spectrum: &Spectrum,
    options: &SpectralOptions,
    file: &ImportedSpectra,
) -> Result<FrfEstimate, IdentifyError> {
    let SpectrumValues::Complex { real, imaginary } = &spectrum.values else {
        return Err(too_few(file, spectrum, 0));
    };
    let lines = spectrum.frequency_hz.iter().zip(real.iter().zip(imaginary));
    let (frequency_hz, response): (Vec<f64>, Vec<Complex64>) = lines
        .map(|(hz, (re, im))| (*hz, Complex64::new(*re, *im)))
        .filter(|(hz, value)| in_band(options, *hz) && value.is_finite())
        .unzip();
    if frequency_hz.len() < MIN_LINES {
        return Err(too_few(file, spectrum, frequency_hz.len()));
    }
    Ok(FrfEstimate { estimator: FrfEstimator::H1, frequency_hz, response, variance: None, coherence: None })
}

fn power(
    spectrum: &Spectrum,
    options: &SpectralOptions,
    file: &ImportedSpectra,
) -> Result<(Vec<f64>, Vec<f64>), IdentifyError> {
    let powers = squares(&spectrum.values, spectrum.kind);
    let lines = spectrum.frequency_hz.iter().copied().zip(powers);
    let (frequency_hz, density): (Vec<f64>, Vec<f64>) =
        lines.filter(|(hz, power)| in_band(options, *hz) && power.is_finite() && *power > 0.0).unzip();
    if frequency_hz.len() < MIN_LINES {
        return Err(too_few(file, spectrum, frequency_hz.len()));
    }
    Ok((frequency_hz, density))
}

/// The choice, if it is what was asked for.
fn found<M: choice::ModalModel>(
    chosen: Option<Chosen<M>>,
    file: &ImportedSpectra,
    column: &str,
    options: &SpectralOptions,
) -> Result<Chosen<M>, IdentifyError> {
    let (recording, column) = (file.name.clone(), column.to_owned());
    let chosen = chosen.ok_or_else(|| IdentifyError::NotComputable {
        recording: recording.clone(),
        column: column.clone(),
    })?;
    let poles = chosen.poles();
    match options.modes {
        Some(requested) if poles.len() < requested => Err(IdentifyError::TooFewPeaks {
            recording,
            column,
            requested,
            found: poles.len(),
            frequencies_hz: poles.iter().map(|pole| pole.frequency_hz).collect(),
        }),
        _ if poles.is_empty() => Err(IdentifyError::NoPeaks { recording, column }),
        _ => Ok(chosen),
    }
}
