//! Tables whose first column is a frequency.

use super::assemble::Table;
use crate::content::{Content, Signals};
use crate::error::Problem;
use crate::heading::Heading;
use crate::recording::MIN_SAMPLES;
use crate::spectrum::{Spectrum, SpectrumKind, SpectrumValues};
use crate::unit_label::hertz;

/// What a column of a spectrum holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Part {
    Real,
    Imaginary,
    Magnitude,
    /// In dB.
    Level,
    /// In units of so many radians.
    Phase(f64),
    PowerDensity,
    Power,
    Other,
}

/// The functions of a table over frequency.
pub(super) fn spectra(table: Table) -> Result<Content, Problem> {
    let Table { headings, columns, remarks, lines, .. } = table;
    let mut pairs = headings.into_iter().zip(columns);
    let Some((axis, frequencies)) = pairs.next() else { return Err(Problem::Empty) };
    let scale = axis.unit.as_deref().and_then(hertz).unwrap_or(1.0);
    let frequency_hz: Vec<f64> = frequencies.iter().map(|f| f * scale).collect();
    if frequency_hz.len() < MIN_SAMPLES {
        return Err(Problem::TooFewSamples { found: frequency_hz.len(), required: MIN_SAMPLES });
    }
    let ordered = |index: &usize| match (frequency_hz.get(*index), frequency_hz.get(index + 1)) {
        (Some(a), Some(b)) => b > a,
        (Some(a), None) => a.is_finite(),
        _ => true,
    };
    if let Some(index) = (0..frequency_hz.len()).find(|index| !ordered(index)) {
        let row = u64::from(lines.get(index + 1).copied().unwrap_or(index as u32 + 2));
        return Err(Problem::FrequencyNotIncreasing { row });
    }
    let columns: Vec<(Heading, Vec<f64>)> = pairs.filter(|(_, values)| !values.is_empty()).collect();
    let mut spectra = Vec::new();
    let mut rest = columns.into_iter().peekable();
    while let Some((heading, values)) = rest.next() {
        let first = part(&heading);
        let second = rest.peek().map(|(heading, _)| part(heading));
        let pair = match (first, second) {
            (Part::Real, Some(Part::Imaginary)) => Some(None),
            (Part::Magnitude | Part::Level, Some(Part::Phase(unit))) => Some(Some(unit)),
            _ => None,
        };
        let second = if pair.is_some() { rest.next() } else { None };
        spectra.push(spectrum(
            &heading,
            first,
            values,
            second.map(|(_, values)| (pair.flatten(), values)),
            &frequency_hz,
        ));
    }
    if spectra.is_empty() {
        return Err(Problem::NoDataColumn);
    }
    Ok(Content { signals: Signals::Spectra(spectra), remarks })
}

fn spectrum(
    heading: &Heading,
    part: Part,
    values: Vec<f64>,
    second: Option<(Option<f64>, Vec<f64>)>,
    frequency_hz: &[f64],
) -> Spectrum {
    let kind = match part {
        Part::PowerDensity => SpectrumKind::PowerDensity,
        Part::Power => SpectrumKind::Power,
        _ if second.is_some() => SpectrumKind::FrequencyResponse,
        _ => SpectrumKind::Amplitude,
    };
    let magnitude = |value: f64| if part == Part::Level { 10_f64.powf(value / 20.0) } else { value };
    let values = match second {
        None => SpectrumValues::Real(values.into_iter().map(magnitude).collect()),
        Some((None, imaginary)) => SpectrumValues::Complex { real: values, imaginary },
        Some((Some(unit), phases)) => {
            let polar = values.iter().zip(&phases).map(|(size, phase)| (magnitude(*size), phase * unit));
            let (real, imaginary) =
                polar.map(|(size, phase)| (size * phase.cos(), size * phase.sin())).unzip();
            SpectrumValues::Complex { real, imaginary }
        }
    };
    let unit = heading.unit.clone().filter(|unit| !matches!(unit.as_str(), "x" | "y" | "z" | "xyz" | "dB"));
    Spectrum {
        name: heading.source.clone(),
        kind,
        unit,
        per_unit: None,
        frequency_hz: frequency_hz.to_vec(),
        values,
    }
}

fn part(heading: &Heading) -> Part {
    let name = heading.source.to_lowercase();
    let words: Vec<&str> = name.split(|c: char| !c.is_alphanumeric()).collect();
    let has = |wanted: &[&str]| words.iter().any(|word| wanted.contains(word));
    let unit = heading.unit.as_deref().unwrap_or("");
    if has(&["psd", "asd"])
        || name.contains("hz)") && name.contains("²/")
        || name.contains("^2/hz")
        || name.contains("density")
    {
        Part::PowerDensity
    } else if has(&["power"]) {
        Part::Power
    } else if has(&["re", "real"]) {
        Part::Real
    } else if has(&["im", "imag", "imaginary"]) {
        Part::Imaginary
    } else if has(&["phase", "arg", "angle"]) {
        Part::Phase(if unit == "rad" { 1.0 } else { 1_f64.to_radians() })
    } else if unit == "dB" || has(&["db"]) {
        Part::Level
    } else if has(&["mag", "magnitude", "abs", "amplitude", "amp", "gain"]) {
        Part::Magnitude
    } else {
        Part::Other
    }
}
