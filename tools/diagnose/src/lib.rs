//! Which physics a model left out.

mod adequacy;
mod diagnosis;
mod error;
mod fit;
mod intervals;
mod naming;
mod noise;
mod options;
mod outliers;
mod parameters;
mod quality;
mod record;
mod result;
mod simulation;
mod stacking;
mod statistics;
mod study;
mod verdict;

pub use diagnosis::{Progress, diagnose};
pub use error::DiagnoseError;
pub use noise::NoiseSource;
pub use options::Options;
pub use result::{
    CandidateRow, Confusability, Diagnosis, Effect, Evidence, Fits, Gate, Mismatch, Overlay, ParameterChange,
    ParameterEstimate, PooledFit, Quality, RecordRole, RecordingFit, ResidualTests, SCHEMA_VERSION,
    ThreeFits, Tie, Verdict,
};
