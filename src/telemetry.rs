//! What the interrupt tells the rest of the firmware.
//!
//! Two ways: [`Status`], the newest values, always there; and [`Sample`]s through a lock-free queue while
//! streaming is on. A sample that finds the queue full is dropped and counted, and its sequence number
//! is missing from the stream, so that a gap is seen by whoever records.

use core::fmt;
use core::sync::atomic::{AtomicI32, AtomicU8, AtomicU32, Ordering};

use crate::units::Nanometres;

/// One streamed sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// Counts every sample that was due since streaming began, dropped ones included.
    pub sequence: u32,
    /// The tick it was taken in.
    pub tick: u32,
    /// The command before shaping.
    pub command: Nanometres,
    /// The setpoint after shaping.
    pub setpoint: Nanometres,
}

/// The text form: `# SEQUENCE TICK COMMAND_NM SETPOINT_NM`.
impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "# {} {} {} {}", self.sequence, self.tick, self.command.0, self.setpoint.0)
    }
}

/// Why a line is not a [`Sample`] in text form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotASample;

impl fmt::Display for NotASample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not a sample; expected '# SEQUENCE TICK COMMAND_NM SETPOINT_NM'")
    }
}

impl core::error::Error for NotASample {}

impl core::str::FromStr for Sample {
    type Err = NotASample;

    fn from_str(line: &str) -> Result<Self, NotASample> {
        fn number<T: core::str::FromStr>(word: Option<&str>) -> Result<T, NotASample> {
            word.and_then(|word| word.parse().ok()).ok_or(NotASample)
        }
        let mut words = line.strip_prefix("# ").ok_or(NotASample)?.split(' ');
        let sample = Self {
            sequence: number(words.next())?,
            tick: number(words.next())?,
            command: Nanometres(number(words.next())?),
            setpoint: Nanometres(number(words.next())?),
        };
        if words.next().is_some() { Err(NotASample) } else { Ok(sample) }
    }
}

/// What the controller is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Command and setpoint are constant.
    Rest = 0,
    /// A move changes the command.
    Moving = 1,
    /// A sweep changes the command.
    Sweeping = 2,
    /// A controlled stop changes the command.
    Stopping = 3,
    /// The command is constant, the shaper still changes the setpoint.
    Settling = 4,
}

impl Activity {
    const ALL: [Self; 5] = [Self::Rest, Self::Moving, Self::Sweeping, Self::Stopping, Self::Settling];

    /// The word that `status` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Moving => "moving",
            Self::Sweeping => "sweeping",
            Self::Stopping => "stopping",
            Self::Settling => "settling",
        }
    }
}

/// The newest values, written by the interrupt and read by everybody.
///
/// Each field is one atomic word with relaxed ordering: on the one core the interrupt either has
/// run whole or not at all between two instructions of a reader, and no field guards another.
#[derive(Debug, Default)]
pub struct Status {
    activity: AtomicU8,
    tick: AtomicU32,
    command_nm: AtomicI32,
    setpoint_nm: AtomicI32,
    dropped: AtomicU32,
}

impl Status {
    /// At rest at zero, no tick yet.
    pub const fn new() -> Self {
        Self {
            activity: AtomicU8::new(Activity::Rest as u8),
            tick: AtomicU32::new(0),
            command_nm: AtomicI32::new(0),
            setpoint_nm: AtomicI32::new(0),
            dropped: AtomicU32::new(0),
        }
    }

    /// What the controller was doing in the last tick.
    pub fn activity(&self) -> Activity {
        let stored = self.activity.load(Ordering::Relaxed);
        Activity::ALL.into_iter().find(|activity| *activity as u8 == stored).unwrap_or(Activity::Rest)
    }

    /// How many ticks there have been; wraps after 2³².
    pub fn tick(&self) -> u32 {
        self.tick.load(Ordering::Relaxed)
    }

    /// The command of the last tick.
    pub fn command(&self) -> Nanometres {
        Nanometres(self.command_nm.load(Ordering::Relaxed))
    }

    /// The setpoint of the last tick.
    pub fn setpoint(&self) -> Nanometres {
        Nanometres(self.setpoint_nm.load(Ordering::Relaxed))
    }

    /// How many samples were dropped since the start.
    pub fn dropped(&self) -> u32 {
        self.dropped.load(Ordering::Relaxed)
    }

    pub(crate) fn publish(&self, activity: Activity, tick: u32, command: Nanometres, setpoint: Nanometres) {
        self.activity.store(activity as u8, Ordering::Relaxed);
        self.tick.store(tick, Ordering::Relaxed);
        self.command_nm.store(command.0, Ordering::Relaxed);
        self.setpoint_nm.store(setpoint.0, Ordering::Relaxed);
    }

    /// Only the interrupt writes, so reading and then writing loses nothing.
    pub(crate) fn count_dropped(&self) {
        self.dropped.store(self.dropped().wrapping_add(1), Ordering::Relaxed);
    }
}
