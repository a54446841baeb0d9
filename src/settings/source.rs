//! Settings of where the command comes from.

use core::fmt;

use super::{Choice, Refusal, Value};
use crate::decimal::Decimal;
use crate::motion::MoveLimits;
use crate::source::{Average, Gearing, SetpointLimits, SourceKind, SourceSetup};
use crate::units::{Nanometres, TickRate};

/// Where the command comes from, and what a count of another controller is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SourceSettings {
    kind: SourceKind,
    /// So many nanometres …
    gear_nm: i32,
    /// … for so many counts.
    gear_counts: u32,
    /// The logarithm of the ticks of the mean.
    average_bits: u8,
}

impl Default for SourceSettings {
    /// The board's own moves; a micrometre per count and a mean over sixteen ticks where that changes.
    fn default() -> Self {
        Self { kind: SourceKind::Moves, gear_nm: 1000, gear_counts: 1, average_bits: 4 }
    }
}

/// Their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SourceKey {
    /// `source`
    Kind,
    /// `source.gear_nm`
    GearNanometres,
    /// `source.gear_counts`
    GearCounts,
    /// `source.average_ticks`
    AverageTicks,
}

/// Powers of two: their place is the logarithm.
static AVERAGES: [&str; Average::MOST_BITS as usize + 1] = ["1", "2", "4", "8", "16", "32", "64"];

/// Why a source cannot be used with the other settings.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SourceMisfit {
    /// A count is more than a gearing may make of it, or nothing.
    Gear {
        /// Nanometres for …
        gear_nm: i32,
        /// … so many counts.
        gear_counts: u32,
    },
    /// A single count would be faster than the limit of acceleration.
    Coarse {
        /// What a count takes, in mm/s².
        needed_mm_s2: f64,
        /// The limit.
        limit_mm_s2: f64,
    },
}

impl fmt::Display for SourceMisfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gear { gear_nm, gear_counts } => write!(
                f,
                "source.gear_nm: {gear_nm} nm for {gear_counts} counts are more than {} nm for one",
                Gearing::MOST_NM_PER_COUNT
            ),
            Self::Coarse { needed_mm_s2, limit_mm_s2 } => write!(
                f,
                "source.average_ticks: a single count takes {:.0} mm/s2, move.acceleration_mm_s2 is {}; \
                 raise source.average_ticks or lower tick.rate_hz",
                Decimal(*needed_mm_s2),
                Decimal(*limit_mm_s2)
            ),
        }
    }
}

impl SourceKey {
    /// Every key, in the order in which they are listed.
    pub const ALL: [Self; 4] = [Self::Kind, Self::GearNanometres, Self::GearCounts, Self::AverageTicks];

    /// The number in the flash.
    pub(super) fn id(self) -> u8 {
        match self {
            Self::Kind => 58,
            Self::GearNanometres => 59,
            Self::GearCounts => 60,
            Self::AverageTicks => 61,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Kind => "source",
            Self::GearNanometres => "source.gear_nm",
            Self::GearCounts => "source.gear_counts",
            Self::AverageTicks => "source.average_ticks",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Kind => "",
            Self::GearNanometres => "nm",
            Self::GearCounts => "counts",
            Self::AverageTicks => "ticks",
        }
    }

    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Kind => {
                "Where the command comes from: the moves said here, or another controller's pulses."
            }
            Self::GearNanometres => {
                "Way of the command for source.gear_counts counts of the source; negative turns it round."
            }
            Self::GearCounts => "Counts of the source (steps, or edges of quadrature) for source.gear_nm.",
            Self::AverageTicks => {
                "The source's command is the mean of so many ticks, which smooths its counts."
            }
        }
    }

    /// First and last accepted number; both zero for words.
    pub(super) fn range(self) -> (f64, f64) {
        let most = f64::from(Gearing::MOST);
        match self {
            Self::GearNanometres => (-most, most),
            Self::GearCounts => (1.0, most),
            Self::Kind | Self::AverageTicks => (0.0, 0.0),
        }
    }

    /// The accepted words; `None` for numbers. A word's place is its number in the flash, so the order stays.
    pub(super) fn words(self) -> Option<&'static [&'static str]> {
        match self {
            Self::Kind => Some(&SourceKind::WORDS),
            Self::AverageTicks => Some(&AVERAGES),
            Self::GearNanometres | Self::GearCounts => None,
        }
    }
}

impl SourceSettings {
    /// Where the command comes from.
    pub fn kind(&self) -> SourceKind {
        self.kind
    }

    /// So many nanometres for so many counts.
    pub fn gear(&self) -> (i32, u32) {
        (self.gear_nm, self.gear_counts)
    }

    /// By how many ticks the mean is behind.
    pub fn delay_ticks(&self) -> f64 {
        f64::from((1_u32 << self.average_bits) - 1) * 0.5
    }

    /// The source, ready for a tick rate; `None` for the board's own moves, and where [`Self::misfit`] is
    /// not.
    pub fn setup(
        &self,
        limits: &MoveLimits,
        travel: [Nanometres; 2],
        tick_rate: TickRate,
    ) -> Option<SourceSetup> {
        if self.kind == SourceKind::Moves {
            return None;
        }
        let nm_per_tick = 1.0e6 * tick_rate.period_s();
        Some(SourceSetup {
            kind: self.kind,
            gearing: Gearing::new(self.gear_nm, self.gear_counts)?,
            average_bits: self.average_bits.into(),
            limits: SetpointLimits::new(
                limits.velocity_mm_s * nm_per_tick,
                limits.acceleration_mm_s2 * nm_per_tick * tick_rate.period_s(),
                travel,
            ),
        })
    }

    /// Why the source cannot be used with these limits, if it cannot.
    pub fn misfit(&self, limits: &MoveLimits, tick_rate: TickRate) -> Option<SourceMisfit> {
        if self.kind == SourceKind::Moves {
            return None;
        }
        let Self { gear_nm, gear_counts, .. } = *self;
        let Some(gearing) = Gearing::new(gear_nm, gear_counts) else {
            return Some(SourceMisfit::Gear { gear_nm, gear_counts });
        };
        let ticks = f64::from(1_u32 << self.average_bits);
        let needed_mm_s2 =
            1.0e-6 * f64::from(gearing.most_nm_per_count()) / ticks * tick_rate.hz() * tick_rate.hz();
        let limit_mm_s2 = limits.acceleration_mm_s2;
        (needed_mm_s2 > limit_mm_s2).then_some(SourceMisfit::Coarse { needed_mm_s2, limit_mm_s2 })
    }

    pub(super) fn get(&self, key: SourceKey) -> Value {
        match key {
            SourceKey::Kind => Value::Word(Choice::new(&SourceKind::WORDS, self.kind as u8)),
            SourceKey::GearNanometres => Value::Number(self.gear_nm.into()),
            SourceKey::GearCounts => Value::Number(self.gear_counts.into()),
            SourceKey::AverageTicks => Value::Word(Choice::new(&AVERAGES, self.average_bits)),
        }
    }

    /// Sets a number that is within the range of its key.
    pub(super) fn put_number(&mut self, key: SourceKey, number: f64) -> Result<(), Refusal> {
        if libm::trunc(number) != number {
            return Err(Refusal::NotWhole { number });
        }
        match key {
            SourceKey::GearNanometres if number == 0.0 => {
                return Err(Refusal::TooSmall { number, least: 1.0 });
            }
            SourceKey::GearNanometres => self.gear_nm = number as i32,
            SourceKey::GearCounts => self.gear_counts = number as u32,
            SourceKey::Kind => return Err(Refusal::NotAWord { words: &SourceKind::WORDS }),
            SourceKey::AverageTicks => return Err(Refusal::NotAWord { words: &AVERAGES }),
        }
        Ok(())
    }

    pub(super) fn put_word(&mut self, key: SourceKey, word: Choice) -> Result<(), Refusal> {
        match key {
            SourceKey::Kind => {
                let words = &SourceKind::WORDS;
                let kind = SourceKind::ALL.get(usize::from(word.place()));
                self.kind = *kind.ok_or(Refusal::NotAWord { words })?;
            }
            SourceKey::AverageTicks => self.average_bits = word.place().min(Average::MOST_BITS as u8),
            SourceKey::GearNanometres | SourceKey::GearCounts => return Err(Refusal::NotANumber),
        }
        Ok(())
    }
}
