//! Which physics a model left out, judged on recordings.
//!
//! | sentence | file |
//! |---|---|
//! | recordings are checked against the model and made ready | `record`, `outliers`, `study` |
//! | what no model may explain is estimated | `noise` |
//! | the model is fitted by the error of its simulation, offsets and initial states solved for inside | `stacking`, `weighting`, `fit`, `refit`, `parameters` |
//! | standard errors hold under coloured noise | `intervals`, `statistics` |
//! | what is left is tested | `adequacy` |
//! | and located: link, time, frequency, order, amplitude, latent force over position and speed | `locate` |
//! | laws of the catalogue are tried at every place, fitted, put through gates | `naming` |
//! | the run that would tell candidates apart is looked for | `next_experiment` |
//! | the whole is tried on itself | [`controls`](fn@controls) |
//! | and the verdict is put together | `verdict`, `quality`, [`diagnose`](fn@diagnose) |
//!
//! Three models are always reported apart: as given, refitted within its own parameters, extended. Units are
//! SI.

mod adequacy;

#[cfg(test)]
mod axis_in_loop;
mod beginnings;
mod between_samples;
mod by_itself;
mod caps;
mod common_motion;
mod comparison;
mod controls;
mod cost;
mod determined;
mod diagnosis;
mod drawn_error;
mod effort;
mod error;
mod fine_steps;
mod fit;
mod frequency_scan;
mod held_command;
mod horizon;
mod input_noise;
mod intervals;
mod linear_findings;
mod linear_ties;
mod locate;
mod looked_at;
mod moving_starts;
mod naming;
mod next_experiment;
mod noise;
mod one_mode;
mod options;
mod outliers;
mod overlays;
mod parameters;
mod patience;
mod phase;
mod quality;
mod reading_step;
mod record;
mod refit;
mod remainder;
mod result;
mod ringing;
mod simulation;
#[cfg(test)]
mod spoilt_sensor;
mod stacking;
mod stated_noise;
mod statistics;
mod stretches;
mod study;
mod sub_steps;
mod summary;
mod sweep;
mod telling;
#[cfg(test)]
mod two_bodies;
mod verdict;
mod visible;
mod weighting;
mod wording;
mod zeros;

pub use controls::{Controls, Outcome, controls};
pub use diagnosis::{Progress, diagnose};
pub use error::DiagnoseError;
pub use locate::{CELLS, ForceSurface, ORDERS, OrderMap};
pub use noise::NoiseSource;
pub use options::{MachineLimits, Options};
pub use result::{
    CandidateRow, Confusability, Cost, Diagnosis, Effect, Evidence, Fits, Gate, Mismatch, Overlay,
    ParameterChange, ParameterEstimate, PooledFit, Quality, RecordRole, RecordingFit, ResidualTests,
    SCHEMA_VERSION, SmallestVisible, StepCost, ThreeFits, Tie, Verdict,
};
pub use sweep::Sweep;
