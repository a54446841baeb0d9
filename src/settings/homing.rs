//! Settings of homing.

use super::{Choice, Refusal, Value};
use crate::homing::{HomingPlan, HomingSpec, Sense};
use crate::motion::MoveLimits;
use crate::units::{MAX_TRAVEL_MM, Nanometres, TickRate};

/// How the machine finds its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HomingMethod {
    /// Not at all: somebody says where the machine is.
    #[default]
    None,
    /// By the limit switch of the lower end.
    LimitMin,
    /// By that of the upper end.
    LimitMax,
    /// By the home switch, downward.
    HomeMin,
    /// By the home switch, upward.
    HomeMax,
    /// By a stop at the lower end.
    StopMin,
    /// By a stop at the upper end.
    StopMax,
}

impl HomingMethod {
    /// Every method, in the order of their numbers in the flash.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::LimitMin,
        Self::LimitMax,
        Self::HomeMin,
        Self::HomeMax,
        Self::StopMin,
        Self::StopMax,
    ];

    /// Their words in settings.
    pub const WORDS: [&'static str; 7] =
        ["none", "limit_min", "limit_max", "home_min", "home_max", "stop_min", "stop_max"];
}

/// How the machine finds its reference, how fast, and what it may do before.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HomingSettings {
    method: HomingMethod,
    approach_mm_s: f64,
    creep_mm_s: f64,
    backoff_mm: f64,
    position_mm: f64,
    unreferenced_mm: f64,
}

impl Default for HomingSettings {
    /// None.
    fn default() -> Self {
        Self {
            method: HomingMethod::None,
            approach_mm_s: 20.0,
            creep_mm_s: 1.0,
            backoff_mm: 2.0,
            position_mm: 0.0,
            unreferenced_mm: 5.0,
        }
    }
}

/// Their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HomingKey {
    /// `home.method`
    Method,
    /// `home.approach_mm_s`
    Approach,
    /// `home.creep_mm_s`
    Creep,
    /// `home.backoff_mm`
    Backoff,
    /// `home.position_mm`
    Position,
    /// `home.unreferenced_mm`
    Unreferenced,
}

impl HomingKey {
    /// Every key, in the order in which they are listed.
    pub const ALL: [Self; 6] =
        [Self::Method, Self::Approach, Self::Creep, Self::Backoff, Self::Position, Self::Unreferenced];

    /// The number in the flash. The first four were spare behind those of the modes.
    pub(super) fn id(self) -> u8 {
        match self {
            Self::Method => 19,
            Self::Approach => 23,
            Self::Creep => 27,
            Self::Backoff => 31,
            Self::Position => 62,
            Self::Unreferenced => 63,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Method => "home.method",
            Self::Approach => "home.approach_mm_s",
            Self::Creep => "home.creep_mm_s",
            Self::Backoff => "home.backoff_mm",
            Self::Position => "home.position_mm",
            Self::Unreferenced => "home.unreferenced_mm",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Method => "",
            Self::Approach | Self::Creep => "mm/s",
            Self::Backoff | Self::Position | Self::Unreferenced => "mm",
        }
    }

    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Method => {
                "What 'home' looks for: a limit or home switch, or a stop, at the lower or upper end."
            }
            Self::Approach => {
                "Speed until the switch or stop is met; the axis passes it by what braking takes."
            }
            Self::Creep => {
                "Speed at which the switch is left or the stop met once more; the reference is as good."
            }
            Self::Backoff => "How far the axis then goes back.",
            Self::Position => "Position of the switch's edge, or of the stop.",
            Self::Unreferenced => {
                "How far from where it was enabled a machine may move that has yet to 'home'."
            }
        }
    }

    /// First and last accepted number; both zero for words.
    pub(super) fn range(self) -> (f64, f64) {
        match self {
            Self::Method => (0.0, 0.0),
            Self::Approach => (0.01, 1000.0),
            Self::Creep => (0.001, 100.0),
            Self::Backoff => (0.0, 100.0),
            Self::Position => (-MAX_TRAVEL_MM, MAX_TRAVEL_MM),
            Self::Unreferenced => (0.0, 1000.0),
        }
    }

    /// The accepted words; `None` for numbers. A word's place is its number in the flash, so the order stays.
    pub(super) fn words(self) -> Option<&'static [&'static str]> {
        match self {
            Self::Method => Some(&HomingMethod::WORDS),
            _ => None,
        }
    }
}

impl HomingSettings {
    /// How the machine finds its reference.
    pub fn method(&self) -> HomingMethod {
        self.method
    }

    /// The speed of the approach in mm/s.
    pub fn approach_mm_s(&self) -> f64 {
        self.approach_mm_s
    }

    /// How far a machine may move that has yet to find its reference, in mm; `None` where it has none to
    /// find.
    pub fn unreferenced_mm(&self) -> Option<f64> {
        (self.method != HomingMethod::None).then_some(self.unreferenced_mm)
    }

    /// The plan within these limits, of a machine that has met a stop when it is `error_mm` behind; `None`
    /// for no homing.
    pub fn plan(&self, limits: &MoveLimits, error_mm: f64, rate: TickRate) -> Option<HomingPlan> {
        let stop = Sense::Stop { error_nm: (error_mm * 1.0e6) as i32 };
        let (upward, sense) = match self.method {
            HomingMethod::None => return None,
            HomingMethod::LimitMin => (false, Sense::Limit),
            HomingMethod::LimitMax => (true, Sense::Limit),
            HomingMethod::HomeMin => (false, Sense::Home),
            HomingMethod::HomeMax => (true, Sense::Home),
            HomingMethod::StopMin => (false, stop),
            HomingMethod::StopMax => (true, stop),
        };
        let spec = HomingSpec {
            upward,
            sense,
            approach_mm_s: self.approach_mm_s,
            creep_mm_s: self.creep_mm_s,
            backoff_mm: self.backoff_mm,
            // Within its range a position is one.
            position: Nanometres::from_mm(self.position_mm).unwrap_or_default(),
        };
        Some(HomingPlan::new(&spec, limits, rate))
    }

    pub(super) fn get(&self, key: HomingKey) -> Value {
        Value::Number(match key {
            HomingKey::Method => {
                return Value::Word(Choice::new(&HomingMethod::WORDS, self.method as u8));
            }
            HomingKey::Approach => self.approach_mm_s,
            HomingKey::Creep => self.creep_mm_s,
            HomingKey::Backoff => self.backoff_mm,
            HomingKey::Position => self.position_mm,
            HomingKey::Unreferenced => self.unreferenced_mm,
        })
    }

    /// Sets a number that is within the range of its key.
    pub(super) fn put_number(&mut self, key: HomingKey, number: f64) -> Result<(), Refusal> {
        match key {
            HomingKey::Method => return Err(Refusal::NotAWord { words: &HomingMethod::WORDS }),
            HomingKey::Approach => self.approach_mm_s = number,
            HomingKey::Creep => self.creep_mm_s = number,
            HomingKey::Backoff => self.backoff_mm = number,
            HomingKey::Position => self.position_mm = number,
            HomingKey::Unreferenced => self.unreferenced_mm = number,
        }
        Ok(())
    }

    pub(super) fn put_word(&mut self, key: HomingKey, word: Choice) -> Result<(), Refusal> {
        let words = &HomingMethod::WORDS;
        match key {
            HomingKey::Method => {
                let method = HomingMethod::ALL.get(usize::from(word.place()));
                self.method = *method.ok_or(Refusal::NotAWord { words })?;
                Ok(())
            }
            _ => Err(Refusal::NotANumber),
        }
    }
}
