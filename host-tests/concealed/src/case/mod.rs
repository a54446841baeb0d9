//! Sealed cases: a machine, what is left out of its model, how it was excited, and how well the effect is
//! concealed.

mod achievable;
mod conceal;
pub mod draw_machine;
pub mod draw_runs;
pub mod files;
pub mod maker;
pub mod menu;
pub mod model_text;
mod tell_tale;

use serde::{Deserialize, Serialize};

use crate::truth::devices::Device;
use crate::truth::excitation::Excitation;
use crate::truth::law::Physics;

/// How an effect is concealed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Concealment {
    /// A linear refit leaves at least three times the noise, and does not hide the effect.
    Visible,
    /// On any single recording a linear refit hides at least 70 % of the effect.
    Absorbed,
    /// What a linear refit of all recordings leaves is within a factor of two of the noise.
    Buried,
    /// A second effect, an unknown disturbance, or the tell-tale channel not recorded.
    Masked,
    /// Nothing is missing and the parameters are nearly right.
    Null,
    /// Nothing is missing, but the parameters are wrong.
    Decoy,
    /// The law is in no catalogue.
    Outside,
}

impl Concealment {
    /// All kinds, in the order of the tables.
    pub const ALL: [Self; 7] =
        [Self::Visible, Self::Absorbed, Self::Buried, Self::Masked, Self::Null, Self::Decoy, Self::Outside];

    /// Its word in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Visible => "visible",
            Self::Absorbed => "absorbed",
            Self::Buried => "buried",
            Self::Masked => "masked",
            Self::Null => "null",
            Self::Decoy => "decoy",
            Self::Outside => "outside",
        }
    }

    /// The kind of a case by its number: twenty cases in a row hold every kind.
    pub fn of_case(number: usize) -> Self {
        const ROUND: [Concealment; 20] = [
            Concealment::Visible,
            Concealment::Absorbed,
            Concealment::Buried,
            Concealment::Masked,
            Concealment::Null,
            Concealment::Visible,
            Concealment::Absorbed,
            Concealment::Buried,
            Concealment::Masked,
            Concealment::Outside,
            Concealment::Visible,
            Concealment::Absorbed,
            Concealment::Buried,
            Concealment::Masked,
            Concealment::Decoy,
            Concealment::Visible,
            Concealment::Absorbed,
            Concealment::Visible,
            Concealment::Masked,
            Concealment::Outside,
        ];
        ROUND[number % ROUND.len()]
    }
}

/// What a recording may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// To fit.
    Train,
    /// To judge.
    HeldOut,
}

/// One recording to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunPlan {
    /// Stem of its file.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// What was commanded.
    pub excitation: Excitation,
}

/// An output that is recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Index of the plant's output.
    pub output: usize,
    /// Its column.
    pub column: String,
    /// What reads it.
    pub device: Device,
}

/// How well the effect is concealed, measured when the case was made, without noise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Measured {
    /// Readings with the effect minus readings without, root mean square over the noise, training recordings.
    pub effect_over_noise: f64,
    /// What a linear refit of all training recordings leaves, root mean square over the noise.
    pub left_over_noise: f64,
    /// The same where every recording may begin from any state, as no lab knows better.
    #[serde(default)]
    pub left_from_any_start: f64,
    /// Per training recording: share (0 to 1) of the effect's root mean square that a refit of it alone
    /// hides.
    pub hidden_share: Vec<f64>,
    /// What a linear refit leaves of the truth without the effect: the nominal model's own limits.
    pub null_over_noise: f64,
    /// The second effect or disturbance alone, as `left_over_noise`; 0 if there is none.
    pub mask_over_noise: f64,
}

/// What is sealed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Number of the case.
    pub number: usize,
    /// Seed of the bench.
    pub seed: u64,
    /// How the effect is concealed.
    pub concealment: Concealment,
    /// Which kind of machine, in words.
    pub machine: String,
    /// What the nominal model lacks and a catalogue has.
    pub physics: Vec<Physics>,
    /// What it lacks and no catalogue has.
    pub outside: Vec<Physics>,
    /// Whether the tell-tale channel was left unrecorded.
    pub without_encoder: bool,
    /// Readings per second.
    pub rate_hz: f64,
    /// What was recorded.
    pub channels: Vec<Channel>,
    /// The recordings.
    pub runs: Vec<RunPlan>,
    /// How well it is concealed.
    pub measured: Measured,
    /// Root mean square of what nobody can know of the held-out recordings, per channel: noise, what a force
    /// that nobody recorded does beside a law of the catalogue, and what the training recordings and the
    /// samples of the input leave open (`achievable.rs`).
    pub held_out_floor: Vec<f64>,
    /// Drawings that did not reach the kind's definition before this one did.
    pub redrawn: usize,
}
