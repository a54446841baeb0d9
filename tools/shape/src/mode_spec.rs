//! `F_HZ,ZETA[,TYPE]`: a mode as a person writes it.

use stillbeam_firmware::shaper::{Mode, ShaperType};

use crate::error::ModeSpecError;

/// The shaper of a mode whose specification names none.
pub const DEFAULT_TYPE: ShaperType = ShaperType::Zvd;

/// Reads a shaper type.
///
/// # Errors
/// [`ModeSpecError::UnknownType`], which lists the known ones.
pub fn parse_type(text: &str) -> Result<ShaperType, ModeSpecError> {
    let text = text.trim();
    text.parse().map_err(|_| ModeSpecError::UnknownType { context: String::new(), text: text.to_owned() })
}

/// Reads a mode: frequency in hertz, damping ratio, and a shaper type, [`DEFAULT_TYPE`] if absent.
///
/// # Errors
/// [`ModeSpecError`] says which part is wrong and what it should be.
pub fn parse_mode(spec: &str) -> Result<Mode, ModeSpecError> {
    let parts: Vec<&str> = spec.split(',').map(str::trim).collect();
    let (frequency, damping, kind) = match parts.as_slice() {
        [frequency, damping] => (frequency, damping, None),
        [frequency, damping, kind] => (frequency, damping, Some(*kind)),
        parts => return Err(ModeSpecError::Parts { spec: spec.to_owned(), found: parts.len() }),
    };
    let frequency_hz = number(spec, "frequency", frequency, "1.1")?;
    let damping_ratio = number(spec, "damping ratio", damping, "0.0074")?;
    let shaper = match kind {
        None => DEFAULT_TYPE,
        Some(text) => text.parse().map_err(|_| ModeSpecError::UnknownType {
            context: format!("mode `{spec}`: "),
            text: text.to_owned(),
        })?,
    };
    Mode::new(frequency_hz, damping_ratio, shaper)
        .map_err(|error| ModeSpecError::Mode { spec: spec.to_owned(), error })
}

fn number(spec: &str, what: &'static str, text: &str, example: &'static str) -> Result<f64, ModeSpecError> {
    text.parse().map_err(|_| ModeSpecError::NotANumber {
        spec: spec.to_owned(),
        what,
        text: text.to_owned(),
        example,
    })
}
