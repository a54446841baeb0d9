//! Commands as functions of the tick: moves, excitations and the controlled stop.
//!
//! What a person asks for is a *spec*. A *plan* is computed from it and checked outside the interrupt, with
//! floating point and divisions; a plan then yields one position per tick, in integers.

mod boxes;
pub mod context;
pub mod decay;
pub mod fine;
pub mod limits;
pub mod r#move;
pub mod multisine;
pub mod multisine_spec;
pub mod outline;
pub mod pieces;
pub mod plan;
pub mod played;
pub mod profile;
pub mod pulse;
mod quintic;
pub mod sine;
pub mod spec;
pub mod stop;
pub mod sweep;
pub mod sweep_spec;
mod taper;

use core::fmt;

pub use context::MotionContext;
pub use decay::{DecayPlan, DecaySpec};
pub use fine::FinePosition;
pub(crate) use fine::upper_product;
pub use limits::MoveLimits;
pub use r#move::MovePlan;
pub use multisine::{MultisineDrawing, MultisinePlan};
pub use multisine_spec::{MultisineSpec, Phases};
pub use outline::{PlanError, PlanOutline, PlanSurvey, StopSurvey};
pub use pieces::{Piece, PieceCourse, PieceMemory};
pub use plan::{MotionMemory, MotionPlan};
pub use played::PlayedPlan;
pub use profile::Profile;
pub use pulse::{PulsePlan, PulseSpec};
pub use spec::MotionSpec;
pub use stop::StopPlan;
pub use sweep::SweepPlan;
pub use sweep_spec::{Amplitude, SweepKind, SweepPace, SweepSpec};

use crate::decimal::Decimal;
use crate::units::MAX_TRAVEL_MM;

/// Why a motion was refused. Nothing moves after a refusal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionError {
    /// A position of the motion lies outside the travel.
    Travel {
        /// The position in millimetres.
        position_mm: f64,
        /// The permitted positions in millimetres.
        range_mm: (f64, f64),
    },
    /// The machine has yet to find its reference, and a position of the motion is too far from where it was
    /// enabled.
    Unreferenced {
        /// The position in millimetres.
        position_mm: f64,
        /// The permitted positions in millimetres.
        range_mm: (f64, f64),
    },
    /// The motion needs more velocity than the limit.
    Velocity {
        /// What it needs, in mm/s.
        needed_mm_s: f64,
        /// What is permitted, in mm/s.
        limit_mm_s: f64,
    },
    /// The motion needs more acceleration than the limit.
    Acceleration {
        /// What it needs, in mm/s².
        needed_mm_s2: f64,
        /// What is permitted, in mm/s².
        limit_mm_s2: f64,
    },
    /// The motion needs more jerk than the limit.
    Jerk {
        /// What it needs, in mm/s³.
        needed_mm_s3: f64,
        /// What is permitted, in mm/s³.
        limit_mm_s3: f64,
    },
    /// A parameter of the motion is outside its range.
    Parameter {
        /// Its name, with its unit.
        name: &'static str,
        /// The refused value.
        value: f64,
        /// The permitted values.
        range: (f64, f64),
    },
    /// A force was asked for, and the setting of the mass that it moves is zero.
    NoMass,
    /// A linear sweep has its pace in Hz/s, an exponential one in octaves per minute.
    PaceOfOtherKind {
        /// The kind of sweep.
        kind: &'static str,
        /// What its pace is in.
        unit: &'static str,
    },
    /// No multiple of one over the multisine's period lies between its frequencies.
    NoLine {
        /// The period, in seconds.
        period_s: f64,
    },
    /// The multisine's table does not fit into the memory.
    Memory {
        /// Samples needed.
        needed: usize,
        /// Samples there are.
        available: usize,
    },
    /// No command was uploaded that could be played.
    NoPlan,
    /// The uploaded command is for another tick rate.
    PlanRate {
        /// The command's, hertz.
        rate_hz: f64,
        /// The board's, hertz.
        tick_hz: f64,
    },
    /// The motion would take more ticks than can be counted.
    TooLong {
        /// How long it would take.
        seconds: f64,
    },
}

impl fmt::Display for MotionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Travel { position_mm, range_mm } => write!(
                f,
                "position {} mm is outside the travel {}..{} mm (and ±{} mm)",
                Decimal(*position_mm),
                Decimal(range_mm.0),
                Decimal(range_mm.1),
                Decimal(MAX_TRAVEL_MM)
            ),
            Self::Unreferenced { position_mm, range_mm } => write!(
                f,
                "position {} mm is outside {}..{} mm, all that is permitted before 'home' (home.unreferenced_mm)",
                Decimal(*position_mm),
                Decimal(range_mm.0),
                Decimal(range_mm.1)
            ),
            Self::Velocity { needed_mm_s, limit_mm_s } => {
                write!(
                    f,
                    "needs {:.1} mm/s, the limit is {} mm/s; ask for less or raise move.velocity_mm_s",
                    Decimal(*needed_mm_s),
                    Decimal(*limit_mm_s)
                )
            }
            Self::Acceleration { needed_mm_s2, limit_mm_s2 } => {
                write!(
                    f,
                    "needs {:.1} mm/s2, the limit is {} mm/s2; \
                     ask for less or raise move.acceleration_mm_s2",
                    Decimal(*needed_mm_s2),
                    Decimal(*limit_mm_s2)
                )
            }
            Self::Jerk { needed_mm_s3, limit_mm_s3 } => {
                write!(
                    f,
                    "needs {:.0} mm/s3, the limit is {} mm/s3; \
                     ask for less or raise move.jerk_mm_s3",
                    Decimal(*needed_mm_s3),
                    Decimal(*limit_mm_s3)
                )
            }
            Self::Parameter { name, value, range } => {
                write!(f, "{name} {} is outside {}..{}", Decimal(*value), Decimal(range.0), Decimal(range.1))
            }
            Self::NoMass => f.write_str("a force needs the mass it moves; set base.moving_mass_kg and apply"),
            Self::PaceOfOtherKind { kind, unit } => {
                write!(f, "a sweep that is {kind} has its pace in {unit}, or give seconds")
            }
            Self::NoLine { period_s } => {
                write!(
                    f,
                    "no multiple of 1/{:.4} Hz lies in the band; widen it or lengthen PERIOD_S",
                    Decimal(*period_s)
                )
            }
            Self::Memory { needed, available } => write!(
                f,
                "the table needs {needed} knots, there is room for {available}; shorten PERIOD_S or lower TO_HZ"
            ),
            Self::NoPlan => {
                f.write_str("no plan was uploaded; 'stillbeam plan --upload' makes and sends one")
            }
            Self::PlanRate { rate_hz, tick_hz } => write!(
                f,
                "the plan is for {} Hz, the board ticks at {} Hz; plan it for that rate, or set tick.rate_hz",
                Decimal(*rate_hz),
                Decimal(*tick_hz)
            ),
            Self::TooLong { seconds } => {
                write!(f, "would take {:.0} s; slow moves must be split", Decimal(*seconds))
            }
        }
    }
}

impl core::error::Error for MotionError {}

/// `value` where it is in the range, and the parameter's name where it is not.
fn within(name: &'static str, value: f64, range: (f64, f64)) -> Result<f64, MotionError> {
    // A comparison that is false for NaN refuses it too.
    if value >= range.0 && value <= range.1 {
        Ok(value)
    } else {
        Err(MotionError::Parameter { name, value, range })
    }
}
