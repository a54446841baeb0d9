//! What the interrupt tells the rest of the firmware.
//!
//! Two ways: [`Status`], the newest values, always there; and [`Sample`]s through a lock-free queue while
//! streaming is on. A sample that finds the queue full is dropped and counted, and its sequence number is
//! missing from the stream, so that a gap is seen by whoever records. Samples travel as text for people or in
//! [`frame`]s for programs.

pub mod frame;
pub mod sender;
mod source;

use core::fmt;
use core::sync::atomic::{AtomicBool, AtomicI32, AtomicU8, AtomicU32, Ordering};

use crate::drive::{Lacking, State};
use crate::fault::{Counters, Event, Fault};
use crate::units::Nanometres;

pub use source::SourceStatus;

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
    /// Where the encoder says the machine is, if there is one.
    pub encoder: Option<Nanometres>,
    /// What is wrong or switched off.
    pub flags: Flags,
    /// What the controller was doing.
    pub activity: Activity,
}

/// What telemetry is on, and how it travels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Streaming {
    /// Text or frames.
    pub format: Format,
    /// Ticks per sample; zero while the stream is off.
    pub decimation: u32,
}

/// How samples travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// A line each, for people.
    #[default]
    Text,
    /// Several in a [`frame`], for programs.
    Frames,
}

/// Bits that say what is wrong or switched off, none of which is set while all is well; and the levels of the
/// general inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(pub u8);

impl Flags {
    /// A fault holds the machine.
    pub const FAULT: Self = Self(1);
    /// The drive is disabled.
    pub const DRIVE_DISABLED: Self = Self(2);
    /// The emergency input is active.
    pub const EMERGENCY_INPUT: Self = Self(4);
    /// The encoder is off the setpoint by more than the window.
    pub const ENCODER_OFF: Self = Self(8);

    /// A fault holds the machine and the shaper has settled behind it, so that it can be cleared.
    pub const SETTLED: Self = Self(16);

    /// Input 1, 2 or 3 is high.
    pub const INPUTS: [Self; 3] = [Self(32), Self(64), Self(128)];
    /// The bits of the general inputs.
    pub const CONTACTS: Self = Self(32 | 64 | 128);

    /// The same with the general inputs of `contacts`.
    #[inline]
    pub fn with_contacts(self, contacts: Self) -> Self {
        Self(self.0 & !Self::CONTACTS.0 | contacts.0 & Self::CONTACTS.0)
    }

    /// Whether all bits of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// The text form: `# SEQUENCE TICK COMMAND_NM SETPOINT_NM STATE`, followed by ` ENCODER_NM FLAGS` where there
/// is an encoder or a flag is set, a high input among them; `ENCODER_NM` is `-` without an encoder.
impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sequence, tick, command, setpoint, activity, .. } = self;
        write!(f, "# {sequence} {tick} {} {} {}", command.0, setpoint.0, activity.name())?;
        match (self.encoder, self.flags) {
            (None, Flags(0)) => Ok(()),
            (None, flags) => write!(f, " - {}", flags.0),
            (Some(encoder), flags) => write!(f, " {} {}", encoder.0, flags.0),
        }
    }
}

/// Why a line is not a [`Sample`] in text form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotASample;

impl fmt::Display for NotASample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "not a sample; expected '# SEQUENCE TICK COMMAND_NM SETPOINT_NM STATE [ENCODER_NM FLAGS]'",
        )
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
        let mut sample = Self {
            sequence: number(words.next())?,
            tick: number(words.next())?,
            command: Nanometres(number(words.next())?),
            setpoint: Nanometres(number(words.next())?),
            activity: words.next().and_then(Activity::from_name).ok_or(NotASample)?,
            ..Self::default()
        };
        if let Some(encoder) = words.next() {
            sample.encoder = if encoder == "-" { None } else { Some(Nanometres(number(Some(encoder))?)) };
            sample.flags = Flags(number(words.next())?);
        }
        if words.next().is_some() { Err(NotASample) } else { Ok(sample) }
    }
}

/// What the controller is doing.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// Command and setpoint are constant.
    #[default]
    Rest = 0,
    /// A move changes the command.
    Moving = 1,
    /// A sweep changes the command.
    Sweeping = 2,
    /// A controlled stop changes the command.
    Stopping = 3,
    /// The command is constant, the shaper still changes the setpoint.
    Settling = 4,
    /// A fault holds the setpoint.
    Fault = 5,
    /// A multisine changes the command.
    Multisine = 6,
    /// A pulse changes the command.
    Pulsing = 7,
    /// A short move, and the hold after it in which the machine decays freely.
    Decaying = 8,
    /// An uploaded command is played.
    Playing = 9,
    /// Another controller's pulses move the setpoint, or did a moment ago.
    Following = 10,
    /// The machine looks for its reference.
    Homing = 11,
}

impl Activity {
    /// Every activity.
    pub const ALL: [Self; 12] = [
        Self::Rest,
        Self::Moving,
        Self::Sweeping,
        Self::Stopping,
        Self::Settling,
        Self::Fault,
        Self::Multisine,
        Self::Pulsing,
        Self::Decaying,
        Self::Playing,
        Self::Following,
        Self::Homing,
    ];

    /// The activity of this number, if there is one.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|activity| *activity as u8 == number)
    }

    /// The activity that `status` prints so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|activity| activity.name() == name)
    }

    /// The word that `status` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Moving => "moving",
            Self::Sweeping => "sweeping",
            Self::Stopping => "stopping",
            Self::Settling => "settling",
            Self::Fault => "fault",
            Self::Multisine => "multisine",
            Self::Pulsing => "pulsing",
            Self::Decaying => "decaying",
            Self::Playing => "playing",
            Self::Following => "following",
            Self::Homing => "homing",
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
    fault: AtomicU8,
    flags: AtomicU8,
    encoder_nm: AtomicI32,
    drive: AtomicU8,
    lacking: AtomicU8,
    source: SourceStatus,
    referenced: AtomicBool,
    anchor_nm: AtomicI32,
    counters: Counters,
    /// Clocks of the tick's timer from when the tick was due to its end: of the last one, and of the longest
    /// so far.
    last_duration: AtomicU32,
    worst_duration: AtomicU32,
}

impl Status {
    /// At rest at zero, no tick yet.
    pub const fn new() -> Self {
        Self {
            activity: AtomicU8::new(Activity::Rest as u8),
            tick: AtomicU32::new(0),
            command_nm: AtomicI32::new(0),
            setpoint_nm: AtomicI32::new(0),
            fault: AtomicU8::new(0),
            flags: AtomicU8::new(0),
            encoder_nm: AtomicI32::new(0),
            drive: AtomicU8::new(State::NotReady as u8),
            lacking: AtomicU8::new(0),
            source: SourceStatus::new(),
            referenced: AtomicBool::new(false),
            anchor_nm: AtomicI32::new(0),
            counters: Counters::new(),
            last_duration: AtomicU32::new(0),
            worst_duration: AtomicU32::new(0),
        }
    }

    /// What the controller was doing in the last tick.
    pub fn activity(&self) -> Activity {
        let stored = self.activity.load(Ordering::Relaxed);
        Activity::from_number(stored).unwrap_or_default()
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
        self.counters.count(Event::SampleLost)
    }

    /// The fault that holds the machine, if one does.
    pub fn fault(&self) -> Option<Fault> {
        Fault::from_number(self.fault.load(Ordering::Relaxed))
    }

    /// What was wrong or switched off in the last tick.
    pub fn flags(&self) -> Flags {
        Flags(self.flags.load(Ordering::Relaxed))
    }

    /// Where the encoder said the machine was in the last tick; without one, in the last tick that had one.
    pub fn encoder(&self) -> Nanometres {
        Nanometres(self.encoder_nm.load(Ordering::Relaxed))
    }

    /// The drive's state.
    pub fn drive(&self) -> State {
        State::from_number(self.drive.load(Ordering::Relaxed)).unwrap_or_default()
    }

    /// What enabling the drive needs and is not there; as it was when the drive was off last.
    pub fn lacking(&self) -> Lacking {
        Lacking(self.lacking.load(Ordering::Relaxed))
    }

    /// Whether positions count from a reference: homing has found it, or somebody has said where the machine
    /// is.
    pub fn is_referenced(&self) -> bool {
        self.referenced.load(Ordering::Relaxed)
    }

    /// Where the drive was enabled last.
    pub fn anchor(&self) -> Nanometres {
        Nanometres(self.anchor_nm.load(Ordering::Relaxed))
    }

    /// What another controller's pulses have made, where they are the command.
    pub fn source(&self) -> &SourceStatus {
        &self.source
    }

    /// How often what has happened.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Says how long the tick took, in clocks of its timer. By the tick.
    #[inline]
    pub fn note_duration(&self, clocks: u32) {
        self.last_duration.store(clocks, Ordering::Relaxed);
        if clocks > self.worst_duration.load(Ordering::Relaxed) {
            self.worst_duration.store(clocks, Ordering::Relaxed);
        }
    }

    /// How long the last tick took and how long the longest so far, in clocks of its timer.
    pub fn durations(&self) -> (u32, u32) {
        (self.last_duration.load(Ordering::Relaxed), self.worst_duration.load(Ordering::Relaxed))
    }

    pub(crate) fn publish(&self, activity: Activity, tick: u32, command: Nanometres, setpoint: Nanometres) {
        self.activity.store(activity as u8, Ordering::Relaxed);
        self.tick.store(tick, Ordering::Relaxed);
        self.command_nm.store(command.0, Ordering::Relaxed);
        self.setpoint_nm.store(setpoint.0, Ordering::Relaxed);
    }

    pub(crate) fn publish_drive(&self, state: State) {
        self.drive.store(state as u8, Ordering::Relaxed);
    }

    pub(crate) fn publish_reference(&self, referenced: bool, anchor: Nanometres) {
        self.anchor_nm.store(anchor.0, Ordering::Relaxed);
        self.referenced.store(referenced, Ordering::Relaxed);
    }

    pub(crate) fn publish_lacking(&self, lacking: Lacking) {
        self.lacking.store(lacking.0, Ordering::Relaxed);
    }

    pub(crate) fn publish_faults(&self, fault: Option<Fault>, flags: Flags, encoder: Option<Nanometres>) {
        self.fault.store(fault.map_or(0, |fault| fault as u8), Ordering::Relaxed);
        self.flags.store(flags.0, Ordering::Relaxed);
        if let Some(encoder) = encoder {
            self.encoder_nm.store(encoder.0, Ordering::Relaxed);
        }
    }
}
