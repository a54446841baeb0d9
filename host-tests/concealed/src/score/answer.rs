//! The tool's answer as it stands in its JSON.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value; absent where it is not a number.
    pub value: Option<f64>,
    /// Its standard error; absent where it is not a number.
    pub stderr: Option<f64>,
}

/// A law that the tool names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Which law.
    pub id: String,
    /// Where.
    pub location: String,
    /// Its parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, Estimate>,
}

/// Sets of laws, as `id at location`, that the tool cannot tell apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tie {
    /// Each candidate a set.
    pub candidates: Vec<Vec<String>>,
}

/// How well a model fits, over all recordings of a role.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Root mean square of recorded minus simulated.
    pub rms: Option<f64>,
}

/// The three models of a role and output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pooled {
    /// `train` or `held_out`.
    pub role: String,
    /// Output column.
    pub output: String,
    /// As given.
    pub given: Quality,
    /// Refitted within its own parameters.
    pub refitted_linear: Quality,
    /// With the physics found.
    pub extended: Option<Quality>,
}

/// All fits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Fits {
    /// By role and output.
    #[serde(default)]
    pub pooled: Vec<Pooled>,
}

/// The fields of the tool's JSON (schema version 1) that are scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict's word.
    pub verdict: String,
    /// Laws named.
    #[serde(default)]
    pub effects: Vec<Effect>,
    /// Candidates that cannot be told apart.
    #[serde(default)]
    pub ties: Vec<Tie>,
    /// How well the models fit.
    #[serde(default)]
    pub fit: Fits,
}

impl Answer {
    /// Reads the tool's JSON; `None` if it is not one.
    pub fn read(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }
}
