//! Refusals, as the last line of a reply: `err CODE NAME: reason`.

use core::fmt;

use super::line::{LineFault, MAX_LINE};
use super::upload::{UploadError, UploadKind};
use crate::brown_out::BrownOut;
use crate::decimal::Decimal;
use crate::drive::{Lacking, State};
use crate::fault::Fault;
use crate::motion::MotionError;
use crate::motion::spec::NotAMotion;
use crate::settings::{Key, Refusal, SourceMisfit, StoreError};
use crate::shaper::ModeError;
use crate::source::SourceKind;
use crate::telemetry::Activity;
use crate::units::TickRate;

/// Why a command was refused. Nothing was changed, but for what [`Self::Flash`] says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CommandError<'l> {
    /// The line could not be read.
    Line(LineFault),
    /// The line and its checksum do not fit together.
    Damaged,
    /// The line has no checksum, and has to have one.
    NoChecksum,
    /// There is no such command.
    UnknownCommand(&'l str),
    /// There is no such setting.
    UnknownName(&'l str),
    /// Arguments are missing, too many or not understood.
    Usage {
        /// The command.
        command: &'static str,
        /// How it is used.
        usage: &'static str,
    },
    /// A value was refused.
    Value {
        /// The setting.
        key: Key,
        /// Why.
        refusal: Refusal,
    },
    /// A mode cannot be shaped at the tick rate.
    Mode {
        /// The mode's number from zero.
        index: usize,
        /// Why.
        error: ModeError,
    },
    /// The table's history does not fit into the memory.
    Memory {
        /// Samples needed.
        needed: usize,
        /// Samples needed at rest, where there is no lag.
        at_rest: usize,
        /// Samples there are.
        available: usize,
        /// The rate at which that many are needed.
        tick_rate: TickRate,
    },
    /// The motion was refused.
    Motion {
        /// The command.
        command: &'static str,
        /// Why.
        error: MotionError,
    },
    /// The motion's table does not fit into the memory.
    MotionMemory {
        /// The command.
        command: &'static str,
        /// With both numbers.
        error: MotionError,
    },
    /// The command has to wait.
    Busy {
        /// The command.
        command: &'static str,
        /// For what.
        reason: Busy,
    },
    /// A fault stands in the way.
    Fault {
        /// The command.
        command: &'static str,
        /// What is in the way.
        reason: Refused,
    },
    /// The step pulses cannot follow the velocity limit.
    PulseRate {
        /// The velocity limit in mm/s.
        limit_mm_s: f64,
        /// What the pulses can follow, in mm/s.
        most_mm_s: f64,
    },
    /// An analog velocity cannot tell the velocity limit.
    AnalogVelocity {
        /// The velocity limit in mm/s.
        limit_mm_s: f64,
        /// What the output can tell, in mm/s.
        most_mm_s: f64,
    },
    /// A position loop needs another setting.
    PositionLoop {
        /// Which.
        lacks: &'static str,
    },
    /// Another controller's pulses do not fit the other settings.
    Source(SourceMisfit),
    /// A table or a plan was not taken.
    Upload {
        /// Which.
        kind: UploadKind,
        /// Why.
        error: UploadError,
    },
    /// The settings could not be stored. This one may have changed some of what is stored.
    Flash(StoreError),
    /// The option bytes do not hold the brown-out level that was wanted.
    BrownOut {
        /// What they hold.
        found: BrownOut,
    },
}

/// What stands in the way of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refused {
    /// A fault holds the machine.
    Held(Fault),
    /// The emergency input is still active.
    EmergencyInput,
    /// The encoder is still outside its window.
    EncoderOff {
        /// Encoder less setpoint, in nanometres.
        error_nm: i32,
    },
    /// There is no encoder.
    NoEncoder,
    /// The drive is off; enabling it may lack something.
    NotEnabled(Lacking),
    /// The drive could follow what the command changes.
    DriveOn,
    /// Enabling lacks something.
    Lacking(Lacking),
    /// The command comes from another controller.
    Source(SourceKind),
    /// Homing is not set up.
    Homing(HomingLacks),
}

/// What homing needs and is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HomingLacks {
    /// Something to look for.
    Method,
    /// An input of this role.
    Input(&'static str),
    /// An encoder with a window, to see that the machine is held by a stop.
    Window,
    /// A drive that does not care where zero is.
    RelativeDrive,
}

impl fmt::Display for HomingLacks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Method => f.write_str("there is nothing to look for; set home.method"),
            Self::Input(role) => write!(f, "no input has the role {role}; set input1.role"),
            Self::Window => f.write_str("a stop is felt by the encoder; set encoder.counts_per_mm and encoder.window_mm"),
            Self::RelativeDrive => f.write_str(
                "the drive is told where to stand, and would jump; set pulses.kind, or analog.quantity velocity",
            ),
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Held(fault) => write!(f, "a fault holds the machine: {}; 'clear' first", fault.name()),
            Self::EmergencyInput => f.write_str("the emergency input is still active; release it first"),
            Self::EncoderOff { error_nm } => write!(
                f,
                "the encoder is {error_nm} nm off the setpoint; move the machine back, or 'encoder reference'"
            ),
            Self::NoEncoder => f.write_str("there is no encoder; set encoder.counts_per_mm"),
            Self::NotEnabled(lacking) => match lacking.remedy() {
                None => f.write_str("the drive is off; 'enable' first"),
                Some(remedy) => write!(f, "the drive is off; before 'enable': {remedy}"),
            },
            Self::DriveOn => f.write_str("the drive is on; 'disable' first"),
            Self::Lacking(lacking) => f.write_str(lacking.remedy().unwrap_or("nothing is lacking any more")),
            Self::Source(kind) => write!(
                f,
                "the command comes from another controller (source {}); 'disable', 'set source moves' and 'apply' first",
                kind.name()
            ),
            Self::Homing(lacks) => lacks.fmt(f),
        }
    }
}

/// What a command has to wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Busy {
    /// The controller to come to rest.
    Activity(Activity),
    /// The drive to be enabled or off.
    Drive(State),
    /// Earlier requests to be taken by the interrupt.
    Requests,
    /// An earlier table to run out.
    Handover,
}

impl fmt::Display for Busy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Activity(activity) => write!(f, "not at rest but {}; wait or 'stop'", activity.name()),
            Self::Drive(state) => write!(f, "the drive is {}; try again", state.name()),
            Self::Requests => f.write_str("earlier commands are still to be taken; is the timer running?"),
            Self::Handover => f.write_str("the table before the last is still running out; try again"),
        }
    }
}

impl fmt::Display for CommandError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("err ")?;
        match self {
            Self::Line(LineFault::TooLong) => {
                write!(f, "syntax line: longer than {MAX_LINE} characters")
            }
            Self::Line(LineFault::NotPrintable(byte)) => {
                write!(f, "syntax line: byte 0x{byte:02x} is not printable ASCII")
            }
            Self::Line(LineFault::Lost) => {
                f.write_str("crc line: bytes of it were lost on the way; send it again")
            }
            Self::Damaged => f.write_str("crc line: the checksum does not match; send it again"),
            Self::NoChecksum => {
                f.write_str("crc line: no checksum; send it again, or 'checksum off' to do without")
            }
            Self::UnknownCommand(name) => {
                write!(f, "unknown-command {name}: no such command; 'help' lists them")
            }
            Self::UnknownName(name) => {
                write!(f, "unknown-name {name}: no such setting; 'get' lists them, 'help' the commands")
            }
            Self::Usage { command, usage } => write!(f, "syntax {command}: usage: {usage}"),
            Self::Value {
                key,
                refusal: refusal @ (Refusal::NotANumber | Refusal::UnknownType | Refusal::NotAWord { .. }),
            } => {
                write!(f, "syntax {key}: {refusal}")
            }
            Self::Value { key, refusal } => write!(f, "range {key}: {refusal}"),
            Self::Mode { index, error: error @ ModeError::DampingRatio { .. } } => {
                write!(f, "range mode{}.damping_ratio: {error}", index + 1)
            }
            Self::Mode { index, error } => write!(f, "range mode{}.frequency_hz: {error}", index + 1),
            Self::Memory { needed, at_rest, available, tick_rate } if at_rest <= available => write!(
                f,
                "memory shaper: needs {needed} samples of history at {} Hz while the machine moves, {at_rest} at rest, \
                 there are {available}; wait for rest",
                Decimal(tick_rate.hz())
            ),
            Self::Memory { needed, available, tick_rate, .. } => write!(
                f,
                "memory shaper: needs {needed} samples of history at {} Hz, there are {available}; \
                 lower tick.rate_hz or use shorter shapers",
                Decimal(tick_rate.hz())
            ),
            Self::Motion { command, error } => write!(f, "range {command}: {error}"),
            Self::MotionMemory { command, error } => write!(f, "memory {command}: {error}"),
            Self::Busy { command, reason } => write!(f, "busy {command}: {reason}"),
            Self::Fault { command, reason } => write!(f, "fault {command}: {reason}"),
            Self::PulseRate { limit_mm_s, most_mm_s } => write!(
                f,
                "range pulses.steps_per_mm: follows at most {:.3} mm/s at this tick rate, \
                 move.velocity_mm_s is {}",
                Decimal(*most_mm_s),
                Decimal(*limit_mm_s)
            ),
            Self::AnalogVelocity { limit_mm_s, most_mm_s } => write!(
                f,
                "range analog.full_scale_mm_s: the output tells at most {:.3} mm/s with its gain and offset, \
                 move.velocity_mm_s is {}",
                Decimal(*most_mm_s),
                Decimal(*limit_mm_s)
            ),
            Self::PositionLoop { lacks } => {
                write!(
                    f,
                    "range loop.gain_per_s: a position loop needs {lacks}; set it, or loop.gain_per_s 0"
                )
            }
            Self::Source(misfit) => write!(f, "range {misfit}"),
            Self::Upload { kind, error } => write!(f, "{} {}: {error}", error.code(), kind.word()),
            Self::Flash(error) => write!(f, "flash save: {error}"),
            Self::BrownOut { found } => {
                write!(f, "flash brownout: the level is still {found}; is the supply above 2.7 V?")
            }
        }
    }
}

impl core::error::Error for CommandError<'_> {}

impl From<NotAMotion> for CommandError<'_> {
    fn from(NotAMotion { command, usage }: NotAMotion) -> Self {
        Self::Usage { command, usage }
    }
}
