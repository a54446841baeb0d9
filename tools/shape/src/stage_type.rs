//! How a stage's taps were made, by the name it has in files and on the command line.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use stillbeam_firmware::shaper::{KnownTypes, ShaperType};

use crate::error::ModeSpecError;

/// How a stage was designed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StageType {
    /// One mode by a closed form; the board designs the same from the mode.
    Textbook(ShaperType),
    /// One mode by specified insensitivity (Singhose, Seering and Singer 1996): the shortest shaper with
    /// non-negative weights that leaves at most `tolerance` over the mode's box.
    SpecifiedInsensitivity {
        /// A fraction from 0 to below 1.
        tolerance: f64,
    },
    /// All modes at once, in one flat stage.
    Optimal,
}

/// The name of the flat stage.
const OPTIMAL: &str = "optimal";
/// Klipper's names for types that are called otherwise here. Its `ei`, `mzv`, `zv` and `zvd` have the same
/// names.
const KLIPPER: [(&str, ShaperType); 2] = [("2hump_ei", ShaperType::Ei2), ("3hump_ei", ShaperType::Ei3)];

impl StageType {
    /// The textbook type, if it is one.
    pub fn textbook(self) -> Option<ShaperType> {
        match self {
            Self::Textbook(shaper) => Some(shaper),
            Self::SpecifiedInsensitivity { .. } | Self::Optimal => None,
        }
    }
}

impl fmt::Display for StageType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Textbook(shaper) => f.pad(shaper.name()),
            Self::SpecifiedInsensitivity { tolerance } => f.pad(&format!("si:{tolerance}")),
            Self::Optimal => f.pad(OPTIMAL),
        }
    }
}

impl FromStr for StageType {
    type Err = ModeSpecError;

    /// Reads the name of a type: a textbook type, also by Klipper's name for it, or `si:TOLERANCE`.
    fn from_str(text: &str) -> Result<Self, ModeSpecError> {
        let text = text.trim();
        let lower = text.to_ascii_lowercase();
        if lower == OPTIMAL {
            return Ok(Self::Optimal);
        }
        if let Some(tolerance) = lower.strip_prefix("si:") {
            let refused = || ModeSpecError::SiTolerance { text: tolerance.to_owned() };
            let tolerance: f64 = tolerance.parse().map_err(|_| refused())?;
            return if (0.0..1.0).contains(&tolerance) {
                Ok(Self::SpecifiedInsensitivity { tolerance })
            } else {
                Err(refused())
            };
        }
        if let Some((_, shaper)) = KLIPPER.iter().find(|(name, _)| *name == lower) {
            return Ok(Self::Textbook(*shaper));
        }
        let unknown = |_| ModeSpecError::UnknownType { context: String::new(), text: text.to_owned() };
        text.parse().map(Self::Textbook).map_err(unknown)
    }
}

impl Serialize for StageType {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for StageType {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Prints the names of all types that a mode can be given, as in a sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownStageTypes;

impl fmt::Display for KnownStageTypes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{KnownTypes}, or si:TOLERANCE such as si:0.05")
    }
}
