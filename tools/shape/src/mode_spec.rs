//! `F_HZ,ZETA[,TYPE]`: a mode as a person writes it.

use stillbeam_firmware::shaper::{Mode, ShaperType};

use crate::error::ModeSpecError;
use crate::stage_type::StageType;

/// The shaper of a mode whose specification names none.
pub const DEFAULT_TYPE: ShaperType = ShaperType::Zvd;

/// A mode and how its stage is to be designed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StagePlan {
    /// The mode. Its own shaper type is the textbook's, or [`DEFAULT_TYPE`] where the stage is none.
    pub mode: Mode,
    /// How the stage is designed.
    pub kind: StageType,
}

impl StagePlan {
    /// A mode with its textbook shaper.
    pub fn textbook(mode: Mode) -> Self {
        Self { mode, kind: StageType::Textbook(mode.shaper()) }
    }
}

/// Reads a textbook shaper type.
///
/// # Errors
/// [`ModeSpecError::UnknownType`], which lists the known ones.
pub fn parse_type(text: &str) -> Result<ShaperType, ModeSpecError> {
    let kind: StageType = text.parse()?;
    kind.textbook()
        .ok_or_else(|| ModeSpecError::UnknownType { context: String::new(), text: text.trim().to_owned() })
}

/// Reads a mode with a textbook shaper: frequency in hertz, damping ratio, and a shaper type,
/// [`DEFAULT_TYPE`] if absent.
///
/// # Errors
/// [`ModeSpecError`] says which part is wrong and what it should be.
pub fn parse_mode(spec: &str) -> Result<Mode, ModeSpecError> {
    let plan = parse_stage(spec, StageType::Textbook(DEFAULT_TYPE))?;
    match plan.kind {
        StageType::Textbook(_) => Ok(plan.mode),
        kind => {
            Err(ModeSpecError::UnknownType { context: format!("mode `{spec}`: "), text: kind.to_string() })
        }
    }
}

/// Reads a mode: frequency in hertz, damping ratio, and how to design its stage, `default` if absent.
///
/// # Errors
/// [`ModeSpecError`] says which part is wrong and what it should be.
pub fn parse_stage(spec: &str, default: StageType) -> Result<StagePlan, ModeSpecError> {
    let parts: Vec<&str> = spec.split(',').map(str::trim).collect();
    let (frequency, damping, kind) = match parts.as_slice() {
        [frequency, damping] => (frequency, damping, None),
        [frequency, damping, kind] => (frequency, damping, Some(*kind)),
        parts => return Err(ModeSpecError::Parts { spec: spec.to_owned(), found: parts.len() }),
    };
    let frequency_hz = number(spec, "frequency", frequency, "1.1")?;
    let damping_ratio = number(spec, "damping ratio", damping, "0.0074")?;
    let kind = match kind {
        None => default,
        Some(text) => match text.parse() {
            // The flat stage is of all modes, not of one.
            Ok(StageType::Optimal) | Err(ModeSpecError::UnknownType { .. }) => {
                return Err(ModeSpecError::UnknownType {
                    context: format!("mode `{spec}`: "),
                    text: text.to_owned(),
                });
            }
            Ok(kind) => kind,
            Err(error) => return Err(error),
        },
    };
    let mode = Mode::new(frequency_hz, damping_ratio, kind.textbook().unwrap_or(DEFAULT_TYPE))
        .map_err(|error| ModeSpecError::Mode { spec: spec.to_owned(), error })?;
    Ok(StagePlan { mode, kind })
}

fn number(spec: &str, what: &'static str, text: &str, example: &'static str) -> Result<f64, ModeSpecError> {
    text.parse().map_err(|_| ModeSpecError::NotANumber {
        spec: spec.to_owned(),
        what,
        text: text.to_owned(),
        example,
    })
}
