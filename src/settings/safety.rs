//! Settings of enabling and stopping.

use super::{Choice, Refusal, Value};
use crate::drive::Times;
use crate::fault::Reaction;
use crate::motion::MoveLimits;
use crate::units::TickRate;

/// How long enabling and stopping may take, and how an emergency stops the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SafetySettings {
    stop_limit_ms: f64,
    hold_ms: f64,
    release_ms: f64,
    engage_ms: f64,
    emergency_stop: Reaction,
}

impl Default for SafetySettings {
    /// A stop of category 1 that may take two seconds, and neither a slow drive nor a brake.
    fn default() -> Self {
        Self {
            stop_limit_ms: 2000.0,
            hold_ms: 0.0,
            release_ms: 0.0,
            engage_ms: 0.0,
            emergency_stop: Reaction::Category1,
        }
    }
}

/// Their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SafetyKey {
    /// `emergency.stop`
    EmergencyStop,
    /// `stop.limit_ms`
    StopLimit,
    /// `drive.hold_ms`
    Hold,
    /// `brake.release_ms`
    Release,
    /// `brake.engage_ms`
    Engage,
}

static EMERGENCY_STOPS: [&str; 2] = ["category_1", "category_0"];

impl SafetyKey {
    /// Every key, in the order in which they are listed.
    pub const ALL: [Self; 5] =
        [Self::EmergencyStop, Self::StopLimit, Self::Hold, Self::Release, Self::Engage];

    /// The number in the flash.
    pub(super) fn id(self) -> u8 {
        match self {
            Self::EmergencyStop => 11,
            Self::StopLimit => 12,
            Self::Hold => 13,
            Self::Release => 14,
            Self::Engage => 15,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::EmergencyStop => "emergency.stop",
            Self::StopLimit => "stop.limit_ms",
            Self::Hold => "drive.hold_ms",
            Self::Release => "brake.release_ms",
            Self::Engage => "brake.engage_ms",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::EmergencyStop => "",
            _ => "ms",
        }
    }

    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::EmergencyStop => {
                "How an emergency or a fault of the drive stops: braked and then off (1), or off at once (0)."
            }
            Self::StopLimit => "Longest time that a braked stop may take before the drive is switched off.",
            Self::Hold => "Time from the enable signal until the drive holds the axis.",
            Self::Release => "Time that the brake takes to open.",
            Self::Engage => "Time that the brake takes to close; the drive holds meanwhile.",
        }
    }

    /// First and last accepted number; both zero for words.
    pub(super) fn range(self) -> (f64, f64) {
        match self {
            Self::EmergencyStop => (0.0, 0.0),
            Self::StopLimit => (10.0, 60_000.0),
            Self::Hold | Self::Release | Self::Engage => (0.0, 10_000.0),
        }
    }

    /// The accepted words; `None` for numbers. A word's place is its number in the flash, so the order stays.
    pub(super) fn words(self) -> Option<&'static [&'static str]> {
        match self {
            Self::EmergencyStop => Some(&EMERGENCY_STOPS),
            _ => None,
        }
    }
}

impl SafetySettings {
    /// How an emergency stops the machine.
    pub fn emergency_stop(&self) -> Reaction {
        self.emergency_stop
    }

    /// Whether an emergency switches the drive off at once.
    pub fn stops_at_once(&self) -> bool {
        self.emergency_stop == Reaction::Category0
    }

    /// The times in ticks. A braked stop is given a quarter more than the limits need, and never more than
    /// its setting.
    pub fn times(&self, limits: &MoveLimits, tick_rate: TickRate) -> Times {
        let ticks = |ms: f64| libm::ceil(ms * 1e-3 * tick_rate.hz()) as u32;
        let needed_ms = 1e3 * limits.velocity_mm_s / limits.acceleration_mm_s2;
        let ramp = ticks((1.25 * needed_ms).min(self.stop_limit_ms)).saturating_add(4);
        Times {
            hold: ticks(self.hold_ms),
            release: ticks(self.release_ms),
            engage: ticks(self.engage_ms),
            ramp,
        }
    }

    pub(super) fn get(&self, key: SafetyKey) -> Value {
        Value::Number(match key {
            SafetyKey::EmergencyStop => {
                let place = u8::from(self.emergency_stop == Reaction::Category0);
                return Value::Word(Choice::new(&EMERGENCY_STOPS, place));
            }
            SafetyKey::StopLimit => self.stop_limit_ms,
            SafetyKey::Hold => self.hold_ms,
            SafetyKey::Release => self.release_ms,
            SafetyKey::Engage => self.engage_ms,
        })
    }

    /// Sets a number that is within the range of its key.
    pub(super) fn put_number(&mut self, key: SafetyKey, number: f64) -> Result<(), Refusal> {
        match key {
            SafetyKey::EmergencyStop => return Err(Refusal::NotAWord { words: &EMERGENCY_STOPS }),
            SafetyKey::StopLimit => self.stop_limit_ms = number,
            SafetyKey::Hold => self.hold_ms = number,
            SafetyKey::Release => self.release_ms = number,
            SafetyKey::Engage => self.engage_ms = number,
        }
        Ok(())
    }

    pub(super) fn put_word(&mut self, key: SafetyKey, word: Choice) -> Result<(), Refusal> {
        match key {
            SafetyKey::EmergencyStop => {
                self.emergency_stop =
                    if word.place() == 0 { Reaction::Category1 } else { Reaction::Category0 };
                Ok(())
            }
            _ => Err(Refusal::NotANumber),
        }
    }
}
