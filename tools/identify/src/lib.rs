//! Modes from recordings, with honest intervals, in the time domain first.
//!
//! Three experiments are read:
//! * a **forced record**, such as a sweep of the base: [`identify_forced`] fits the whole time record by
//!   output error, from a free initial state;
//! * a **free decay**: [`identify_free_decay`] fits a sum of damped sinusoids from the peak of the ring-down;
//! * a record **under noise, traffic or wind**: [`identify_output_only`] reads the covariances of the
//!   outputs.
//!
//! [`recognise`] says what a record without an input is. All choose the number of modes themselves unless
//! told, report standard errors that stay honest when the noise is coloured, look at every mode a second way
//! where there is one, and say in [`Warning`]s what a reader must know. The result, [`IdentifiedModes`],
//! serialises to the JSON of `stillbeam identify`. Methods based on the frequency response only start the
//! fits: with damping below 1 % and sweeps shorter than the decay time they are limited by leakage, not by
//! noise.
//!
//! ```
//! use stillbeam_identify::{FreeDecayOptions, identify_free_decay};
//! use stillbeam_recording::Recording;
//! let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
//! let tip = time_s.iter().map(|t| 1e-3 * (-0.1 * t).exp() * (6.9 * t).cos()).collect();
//! let recording = Recording::new("example", time_s).with_column("tip_deflection_m", tip);
//! let found = identify_free_decay(&recording, &FreeDecayOptions::new("tip_deflection_m"))?;
//! let omega = 6.9_f64.hypot(0.1);
//! assert!((found.modes[0].damping_ratio.value - 0.1 / omega).abs() < 1e-8);
//! # Ok::<(), stillbeam_identify::IdentifyError>(())
//! ```

mod aliasing;
mod amplitude;
mod amplitude_law;
mod band_models;
mod column;
mod common_clock;
mod comparison;
mod decay_fit;
mod decay_model;
mod decay_modes;
mod decay_report;
mod decay_shapes;
mod decay_starts;
mod died_away;
mod drift;
mod driven_lines;
mod error;
mod follows;
mod forced_fit;
mod forced_model;
mod forced_record;
mod forced_report;
mod forced_start;
mod free_decay;
pub mod frf;
mod gaps;
mod in_band;
mod input_rest;
pub mod interpolation;
pub mod levenberg_marquardt;
mod linearity;
mod log_decrement;
mod magnitude;
mod modal_response;
mod mode_gates;
mod model_choice;
mod modes_file;
mod narrow_band;
mod noise;
mod output_only;
pub mod poles;
mod readings;
mod real_pole;
mod record_kind;
mod resolution;
mod responses;
mod result;
mod ringing;
mod robust_covariance;
mod second_opinions;
mod separable;
mod signal_checks;
mod sound_part;
mod spectra;
mod spectral;
mod spikes;
mod step;
mod strongest;
pub mod tall;
mod time_shifts;
mod time_stamps;
mod tones;
mod unexplained;
mod unrecorded_sweep;
mod warning_merge;
mod warning_sentences;
mod warnings;
mod whitening;
mod wild_samples;

pub use amplitude::{AmplitudeChange, AmplitudePoint};
pub use common_clock::{
    ClockError, ClockFit, Derivative, Signal, clock_by_edges, clock_by_motion, rising_edges_s,
};
pub use comparison::compare_recordings;
pub use error::IdentifyError;
pub use follows::follows_input;
pub use forced_fit::{
    ForcedOptions, MAX_MODES, identify_forced, identify_forced_together, usual_max_delay_s,
};
pub use free_decay::{FreeDecayOptions, identify_free_decay};
pub use gaps::driven_stretches;
pub use interpolation::InputInterpolation;
pub use levenberg_marquardt::StopReason;
pub use linearity::{Linearity, LinearityVerdict};
pub use log_decrement::damping_from_peaks;
pub use modal_response::{InputKind, OutputQuantity};
pub use modes_file::{BOX_STANDARD_ERRORS, Doubt, FiledMode, ModesFile, ModesFileError, UnusableBox};
pub use output_only::{OutputOnlyOptions, identify_output_only};
pub use record_kind::{Recognised, RecordKind, SweepLine, possible_inputs, recognise};
pub use resolution::resolution;
pub use responses::{Frf, Response, Spectrum};
pub use result::{
    CrossCheck, Estimate, FitTrace, IdentifiedMode, IdentifiedModes, Method, ModeShape, ModelStep,
    NoiseModel, RealPole, RecordFit, Rejected, SCHEMA_VERSION, ShapePart, UncertaintyBox,
};
pub use spectral::{SpectralOptions, identify_spectra};
pub use strongest::{loudest_line_hz, strongest_column};
pub use unrecorded_sweep::{
    FoundSweep, SWEEP_COLUMN, SweepPace, SweepPlan, SweepPlanError, SweepShape, find_sweep,
};
pub use warning_merge::merged;
pub use warnings::{FastPassage, Quantity, Warning, WarningKind};
