//! Commands as functions of the tick: moves, sweeps and the controlled stop.
//!
//! A *plan* is computed and checked outside the interrupt, with floating point and divisions; a plan then
//! yields one position per tick with integer arithmetic only.

pub mod r#move;
pub mod sine;
pub mod stop;
pub mod sweep;

use core::fmt;

pub use r#move::{MoveLimits, MovePlan};
pub use stop::StopPlan;
pub use sweep::{SweepKind, SweepPlan, SweepSpec};

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
    /// A parameter of the motion is outside its range.
    Parameter {
        /// Its name, with its unit.
        name: &'static str,
        /// The refused value.
        value: f64,
        /// The permitted values.
        range: (f64, f64),
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
                "position {position_mm} mm is outside the travel {}..{} mm (and ±{MAX_TRAVEL_MM} mm)",
                range_mm.0, range_mm.1
            ),
            Self::Velocity { needed_mm_s, limit_mm_s } => {
                write!(f, "needs {needed_mm_s:.1} mm/s, the limit is {limit_mm_s} mm/s")
            }
            Self::Acceleration { needed_mm_s2, limit_mm_s2 } => {
                write!(f, "needs {needed_mm_s2:.1} mm/s2, the limit is {limit_mm_s2} mm/s2")
            }
            Self::Parameter { name, value, range } => {
                write!(f, "{name} {value} is outside {}..{}", range.0, range.1)
            }
            Self::TooLong { seconds } => write!(f, "would take {seconds:.0} s; slow moves must be split"),
        }
    }
}

impl core::error::Error for MotionError {}
