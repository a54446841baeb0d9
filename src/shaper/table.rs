//! A whole shaper, ready to run: the stages of all modes for one tick rate, or one sparse flat stage for all
//! of them.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

use super::MAX_MODES;
use super::cascade::Cascade;
use super::mode::{Mode, ModeError};
use super::stage::{MAX_TAPS, Stage, StageTaps, Tap, WEIGHT_ONE};
use crate::units::TickRate;

/// The most taps of all stages of a table together: four modes of the longest type, or a flat stage of as
/// many.
pub const MAX_TABLE_TAPS: usize = 64;
const _: () = assert!(MAX_TABLE_TAPS >= MAX_MODES * MAX_TAPS);

/// The largest sum of the absolute weights, in units of [`WEIGHT_ONE`]: how much larger than the command's
/// span that of the setpoint may become. Unit-magnitude shapers have 3. The filter's sums need it to stay
/// below 2⁶³.
pub const MAX_ABSOLUTE_SUM: i64 = 4;

/// The stages of a shaper in the order in which the cascade runs them.
#[derive(Clone, Debug, PartialEq)]
pub struct ShaperTable {
    tick_rate: TickRate,
    /// Of all stages, one after the other.
    taps: Vec<Tap, MAX_TABLE_TAPS>,
    /// For each stage the number of taps up to its end.
    ends: Vec<u8, MAX_MODES>,
}

/// Why a table could not be made of modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TableError {
    /// The mode at this place of the list cannot be shaped.
    Mode {
        /// Place in the list, from zero.
        index: usize,
        /// What is wrong with it.
        error: ModeError,
    },
    /// More modes than [`MAX_MODES`].
    TooManyModes {
        /// How many were given.
        count: usize,
    },
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mode { index, error } => write!(f, "mode {}: {error}", index + 1),
            Self::TooManyModes { count } => write!(f, "{count} modes; at most {MAX_MODES} can be shaped"),
        }
    }
}

impl core::error::Error for TableError {}

/// Why taps make no table. Stages and taps are counted from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TapsError {
    /// No stages, or more than [`MAX_MODES`].
    Stages {
        /// How many.
        count: usize,
    },
    /// A stage without taps.
    EmptyStage {
        /// The stage.
        stage: usize,
    },
    /// More than [`MAX_TABLE_TAPS`] in all.
    TooManyTaps,
    /// A delay that is not larger than the one before.
    NotAscending {
        /// The stage.
        stage: usize,
        /// The tap.
        tap: usize,
    },
    /// The weights of a stage do not sum to [`WEIGHT_ONE`]: a held command would move.
    Sum {
        /// The stage.
        stage: usize,
        /// What they sum to.
        sum: i64,
    },
    /// The absolute weights sum to more than [`MAX_ABSOLUTE_SUM`].
    AbsoluteSum {
        /// The stage.
        stage: usize,
    },
    /// A negative weight in a table of several stages: between two of them nothing bounds the setpoint.
    NegativeInCascade {
        /// The stage.
        stage: usize,
        /// The tap.
        tap: usize,
    },
    /// The bytes end within a stage.
    Truncated,
}

impl fmt::Display for TapsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stages { count } => write!(f, "{count} stages; a table has 1 to {MAX_MODES}"),
            Self::EmptyStage { stage } => write!(f, "stage {stage} has no taps"),
            Self::TooManyTaps => write!(f, "more than {MAX_TABLE_TAPS} taps"),
            Self::NotAscending { stage, tap } => {
                write!(f, "stage {stage}, tap {tap}: its delay is not larger than the one before")
            }
            Self::Sum { stage, sum } => {
                write!(f, "stage {stage}: the weights sum to {sum}, not to {WEIGHT_ONE}")
            }
            Self::AbsoluteSum { stage } => write!(
                f,
                "stage {stage}: the absolute weights sum to more than {MAX_ABSOLUTE_SUM} times {WEIGHT_ONE}"
            ),
            Self::NegativeInCascade { stage, tap } => write!(
                f,
                "stage {stage}, tap {tap}: a negative weight is for tables of one stage; multiply the stages out"
            ),
            Self::Truncated => f.write_str("the bytes end within a stage"),
        }
    }
}

impl core::error::Error for TapsError {}

impl ShaperTable {
    /// The table that changes nothing.
    pub fn identity(tick_rate: TickRate) -> Self {
        Self { tick_rate, taps: Vec::new(), ends: Vec::new() }
    }

    /// Designs one stage per mode.
    ///
    /// # Errors
    /// [`TableError`] names the mode that cannot be shaped at this tick rate, or the excess of modes.
    #[inline(never)]
    pub fn design(modes: &[Mode], tick_rate: TickRate) -> Result<Self, TableError> {
        let mut table = Self::identity(tick_rate);
        for (index, mode) in modes.iter().enumerate() {
            let stage = Stage::design(mode, tick_rate).map_err(|error| TableError::Mode { index, error })?;
            table.push(stage.taps()).map_err(|_| TableError::TooManyModes { count: modes.len() })?;
        }
        Ok(table)
    }

    /// A table of taps that somebody else designed: one stage per mode, or a flat one with all taps of the
    /// shaper. Weights may be negative if there is one stage only; then the setpoint may leave the span of
    /// the command, by at most half of (sum of absolute weights − 1) of it on either side.
    ///
    /// # Errors
    /// [`TapsError`] says which tap is wrong, and how.
    pub fn from_stages<'t>(
        tick_rate: TickRate,
        stages: impl ExactSizeIterator<Item = &'t [Tap]>,
    ) -> Result<Self, TapsError> {
        let mut table = Self::identity(tick_rate);
        let count = stages.len();
        if !(1..=MAX_MODES).contains(&count) {
            return Err(TapsError::Stages { count });
        }
        for (taps, stage) in stages.zip(1..) {
            check_stage(taps, stage, count)?;
            table.push(taps)?;
        }
        Ok(table)
    }

    fn push(&mut self, taps: &[Tap]) -> Result<(), TapsError> {
        let count = self.ends.len() + 1;
        self.taps.extend_from_slice(taps).map_err(|_| TapsError::TooManyTaps)?;
        // MAX_TABLE_TAPS is below 256.
        self.ends.push(self.taps.len() as u8).map_err(|_| TapsError::Stages { count })
    }

    /// The stages, in the order of the modes they were designed from.
    pub fn stages(&self) -> impl ExactSizeIterator<Item = StageTaps<'_>> + Clone {
        let mut start = 0;
        self.ends.iter().map(move |end| {
            let end = usize::from(*end);
            StageTaps::new(self.taps.get(core::mem::replace(&mut start, end)..end).unwrap_or_default())
        })
    }

    /// The tick rate that the stages are meant for.
    pub fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// How many ticks after a change of the command the setpoint stops changing.
    pub fn duration_ticks(&self) -> u32 {
        self.stages().map(StageTaps::duration_ticks).fold(0, u32::saturating_add)
    }

    /// How far a ramp is delayed, in seconds.
    pub fn delay_s(&self) -> f64 {
        // Not `sum`: of nothing at all that is −0, and would be printed so.
        self.stages().fold(0.0, |sum, stage| sum + stage.delay_ticks()) * self.tick_rate.period_s()
    }

    /// How long the shaper lasts, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.tick_rate.seconds(self.duration_ticks())
    }

    /// How many words of memory the cascade needs for this table: past samples and the taps themselves.
    pub fn history_samples(&self) -> usize {
        Cascade::words(self)
    }

    /// A bound of the sum of the magnitudes of the whole shaper's taps: the product of the stages' sums. It
    /// is one where no tap is negative, and bounds how much larger than the command's the setpoint's
    /// derivatives can be.
    pub fn absolute_gain(&self) -> f64 {
        self.stages().fold(1.0, |gain, stage| {
            let sum: u64 = stage.taps().iter().map(|tap| u64::from(tap.weight.unsigned_abs())).sum();
            gain * (sum as f64 / f64::from(WEIGHT_ONE))
        })
    }

    /// The table as bytes, in 32-bit little-endian words: for each stage the number of taps, then each tap's
    /// delay in ticks and its Q30 weight. [`super::wire`] reads them.
    pub fn words(&self) -> impl Iterator<Item = [u8; 4]> + '_ {
        self.stages().flat_map(|stage| {
            let count = (stage.taps().len() as u32).to_le_bytes();
            let taps = stage.taps().iter();
            let taps = taps.flat_map(|tap| [tap.delay_ticks.to_le_bytes(), tap.weight.to_le_bytes()]);
            core::iter::once(count).chain(taps)
        })
    }

    /// CRC-32 (ISO-HDLC, the one of zip and Ethernet) over [`Self::words`].
    pub fn crc32(&self) -> u32 {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        self.words().for_each(|word| digest.update(&word));
        digest.finalize()
    }
}

fn check_stage(taps: &[Tap], stage: usize, stages: usize) -> Result<(), TapsError> {
    if taps.is_empty() {
        return Err(TapsError::EmptyStage { stage });
    }
    if taps.len() > MAX_TABLE_TAPS {
        return Err(TapsError::TooManyTaps);
    }
    for ((earlier, later), tap) in taps.iter().zip(taps.iter().skip(1)).zip(2..) {
        if earlier.delay_ticks >= later.delay_ticks {
            return Err(TapsError::NotAscending { stage, tap });
        }
    }
    if stages > 1
        && let Some(place) = taps.iter().position(|tap| tap.weight < 0)
    {
        return Err(TapsError::NegativeInCascade { stage, tap: place + 1 });
    }
    let sum: i64 = taps.iter().map(|tap| i64::from(tap.weight)).sum();
    if sum != i64::from(WEIGHT_ONE) {
        return Err(TapsError::Sum { stage, sum });
    }
    let absolute: i64 = taps.iter().map(|tap| i64::from(tap.weight).abs()).sum();
    if absolute > MAX_ABSOLUTE_SUM * i64::from(WEIGHT_ONE) {
        return Err(TapsError::AbsoluteSum { stage });
    }
    Ok(())
}
