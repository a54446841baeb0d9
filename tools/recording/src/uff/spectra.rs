//! The functions of frequency of a universal file.

use super::function::Function;
use super::names::spectrum_names;
use super::units;
use crate::spectrum::{Spectrum, SpectrumKind, SpectrumValues};
use crate::unit_label::hertz;

/// Function types of data set 58.
const AUTO_SPECTRUM: i64 = 2;
pub(super) const FREQUENCY_RESPONSE: i64 = 4;
pub(super) const TRANSMISSIBILITY: i64 = 5;
const POWER_DENSITY: i64 = 9;
const SPECTRUM: i64 = 12;

fn kind(function: &Function) -> Option<SpectrumKind> {
    if !matches!(function.abscissa.data_type, units::FREQUENCY | 0) {
        return None;
    }
    match function.kind {
        AUTO_SPECTRUM => Some(SpectrumKind::Power),
        FREQUENCY_RESPONSE | TRANSMISSIBILITY => Some(SpectrumKind::FrequencyResponse),
        POWER_DENSITY => Some(SpectrumKind::PowerDensity),
        SPECTRUM => Some(SpectrumKind::Amplitude),
        _ => None,
    }
}

/// All functions of frequency, their frequencies in hertz.
pub(super) fn spectra(functions: &[Function], si: bool) -> Vec<Spectrum> {
    let kinds: Vec<(&Function, SpectrumKind)> =
        functions.iter().filter_map(|function| Some((function, kind(function)?))).collect();
    let taken: Vec<&Function> = kinds.iter().map(|(function, _)| *function).collect();
    let names = spectrum_names(&taken);
    kinds
        .into_iter()
        .zip(names)
        .map(|((function, kind), name)| {
            let scale = function.abscissa.unit(false).and_then(|unit| hertz(&unit)).unwrap_or(1.0);
            Spectrum {
                name,
                kind,
                unit: function.ordinate.unit(si),
                per_unit: function.denominator.unit(si),
                frequency_hz: function.places.iter().map(|place| place * scale).collect(),
                values: if function.complex {
                    SpectrumValues::Complex {
                        real: function.values.clone(),
                        imaginary: function.imaginary.clone(),
                    }
                } else {
                    SpectrumValues::Real(function.values.clone())
                },
            }
        })
        .collect()
}
