//! The plant: a non-uniform flexible beam clamped to a translating base, or modes, or bodies and springs,
//! from model file to simulation.
//!
//! ```text
//! setpoint ──▶ drive ──▶ base y(t) ──▶ beam w(x, t) ──▶ camera ──▶ recorded tip
//!              force u ──▶ base + beam (coupled) ──▶ base position, tip
//! ```
//!
//! | sentence | file |
//! |---|---|
//! | a model file becomes a checked [`Model`], or an error naming file, line, key and remedy | `model_file`, `model` |
//! | width and thickness along the beam become mass and stiffness matrices | `beam` |
//! | matrices become modes, with the base held or free | `modes` |
//! | state-space matrices and transfer functions become modes | `matrices` |
//! | modes, or bodies and springs, become one state space that is advanced without discretisation error | [`state_space`], `linear` |
//! | it is run over a recording, or one tick at a time | [`simulate()`], [`PrescribedBase`] |
//! | numbers are listed, read and set by path, for refits | `parameters` |
//! | physics that was left out, one file per law, and where it may sit | [`catalogue`] |
//! | forces, controller and sensors run with the linear part, sub-step by sub-step | `nonlinear` |
//! | the tip is seen by a slow, noisy camera | [`Camera`] |
//! | a move is judged | `metrics` |
//!
//! Units are SI throughout: metres, seconds, kilograms, newtons, hertz; angular frequencies say `rad_s`.
//! Equation numbers are those of Pham, Kim, Nguyen and Hong, "Control of a Non-uniform Flexible Beam:
//! Identification of First Two Modes" (2021).
//!
//! ```
//! use stillbeam_plant::{Model, PrescribedBase};
//! let text = r#"
//!     schema = 1
//!     kind = "modal"
//!     [[mode]]
//!     frequency_hz = 1.1
//!     damping_ratio = 0.0074
//!     participation = [1.566]
//!     [input]
//!     column = "base_position_m"
//!     [[output]]
//!     column = "tip_deflection_m"
//! "#;
//! let model = Model::from_toml("example.toml", text)?;
//! let mut plant = PrescribedBase::new(&model, 1000.0, 0.0)?;
//! // A base that starts to move forwards leaves the tip behind.
//! assert!(plant.step(0.001) < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod advances;
pub mod beam;
mod blocks;
mod camera;
pub mod catalogue;
mod drive;
mod error;
mod linear;
mod matrices;
mod metrics;
mod model;
mod model_file;
pub mod modes;
mod nonlinear;
mod parameters;
mod prescribed_base;
mod profile;
mod rerun;
mod residual;
mod simulate;
mod stamps;
pub mod state_space;

pub use camera::{Camera, CameraError};
pub use drive::ServoDrive;
pub use error::PlantError;
pub use metrics::{Move, MoveMetrics, measure_move};
pub use model::{
    BASE_POSITION, BeamDamping, BeamFittings, BeamOnBase, BeamParameters, BeamSignal, Beside, Body,
    Connection, Controller, DRIVING_POINT, DriveLimits, FORCE, GROUND, InitialState, Input, InvalidParameter,
    Lag, LumpedInput, LumpedModel, LumpedOutput, MAX_BODIES, MAX_MODES, MatricesProblem, ModalModel,
    ModalOutput, Model, Physics, Problem, Quantity, RealPole, Rigid, SETPOINT, SectionTables, Sensor,
    SensorKind, Setup, TIP_DEFLECTION, TIP_POSITION,
};
pub use model_file::{ModelFileError, SCHEMA};
pub use modes::Mode;
pub use nonlinear::{Guide, Tie};
pub use parameters::Parameter;
pub use prescribed_base::{ModalState, PrescribedBase};
pub use profile::Profile;
pub use rerun::{Motion, Rerun, StepLengths, force_along};
pub use residual::{PercentageVibration, ResidualVibration};
pub use simulate::{Feedback, Hold, SimulateOptions, free_decay, simulate, simulate_with};
pub use state_space::StateSpace;
