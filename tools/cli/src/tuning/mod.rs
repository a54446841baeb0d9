//! From identified modes to one recommended shaper, with its reasons.

mod between_recordings;
mod box_origin;
mod doubts;
mod error;
mod figures;
mod left_out;
mod next_commands;
mod numbers;
mod outcome;
mod reasons;
mod recommendation;
mod request;
mod shaper_names;
mod tables;
mod usable_modes;

pub use between_recordings::{Movement, Sighting};
pub use box_origin::BoxOrigin;
pub use error::TuningError;
pub use left_out::LeftOut;
pub use next_commands::NextCommands;
pub use numbers::TuningNumbers;
pub use outcome::Tuning;
pub use reasons::Reasons;
pub use recommendation::Recommendation;
pub use request::TuningRequest;
pub use tables::print_tables;
pub use usable_modes::{UsableMode, UsableModes};
