//! A whole shaper, ready to run: the stages of all modes for one tick rate.

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

use super::MAX_MODES;
use super::mode::{Mode, ModeError};
use super::stage::Stage;
use crate::units::TickRate;

/// The stages of a shaper in the order in which the cascade runs them.
#[derive(Clone, Debug, PartialEq)]
pub struct ShaperTable {
    tick_rate: TickRate,
    stages: Vec<Stage, MAX_MODES>,
}

/// Why a table could not be made.
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

impl ShaperTable {
    /// The table that changes nothing.
    pub fn identity(tick_rate: TickRate) -> Self {
        Self { tick_rate, stages: Vec::new() }
    }

    /// Designs one stage per mode.
    ///
    /// # Errors
    /// [`TableError`] names the mode that cannot be shaped at this tick rate, or the excess of modes.
    pub fn design(modes: &[Mode], tick_rate: TickRate) -> Result<Self, TableError> {
        let mut stages = Vec::new();
        for (index, mode) in modes.iter().enumerate() {
            let stage = Stage::design(mode, tick_rate).map_err(|error| TableError::Mode { index, error })?;
            stages.push(stage).map_err(|_| TableError::TooManyModes { count: modes.len() })?;
        }
        Ok(Self { tick_rate, stages })
    }

    /// The stages, in the order of the modes they were designed from.
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// The tick rate that the stages are meant for.
    pub fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// How many ticks after a change of the command the setpoint stops changing.
    pub fn duration_ticks(&self) -> u32 {
        self.stages.iter().map(Stage::duration_ticks).sum()
    }

    /// How far a ramp is delayed, in seconds.
    pub fn delay_s(&self) -> f64 {
        // Not `sum`: of nothing at all that is −0, and would be printed so.
        self.stages.iter().fold(0.0, |sum, stage| sum + stage.delay_ticks()) * self.tick_rate.period_s()
    }

    /// How long the shaper lasts, in seconds.
    pub fn duration_s(&self) -> f64 {
        self.tick_rate.seconds(self.duration_ticks())
    }

    /// How many samples of history the cascade needs for this table.
    pub fn history_samples(&self) -> usize {
        self.stages.iter().map(history_of).sum()
    }

    /// CRC-32 (ISO-HDLC, the one of zip and Ethernet) over the table as it runs: for each stage the number
    /// of taps, then each tap's delay in ticks and its Q30 weight, all as 32-bit little-endian words.
    pub fn crc32(&self) -> u32 {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        for stage in &self.stages {
            digest.update(&(stage.taps().len() as u32).to_le_bytes());
            for tap in stage.taps() {
                digest.update(&tap.delay_ticks.to_le_bytes());
                digest.update(&tap.weight.to_le_bytes());
            }
        }
        digest.finalize()
    }
}

/// A stage looks back `duration_ticks` ticks and at the sample of this tick.
pub(super) fn history_of(stage: &Stage) -> usize {
    stage.duration_ticks() as usize + 1
}
