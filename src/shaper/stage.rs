//! The shaper of one mode as an integer finite impulse response on the tick grid.
//!
//! Rounding the impulses' times to whole ticks would move the shaper off the mode. Instead each is spread
//! over the two ticks around it with weights that are right for the mode's pole (`tick_grid`, which has the
//! formulas). At the mode ZV, ZVD, ZVDD, ZVDDD, EI2 and MZV leave nothing but rounding at every tick rate, EI
//! and EI3 at most what their impulses leave; all go to their impulses as the ticks get finer
//! (docs/derivations/shapers.md).

use heapless::Vec;

use super::design::{self, Impulse};
use super::mode::{Mode, ModeError};
use super::tick_grid::{RealTaps, SampledPole};
use crate::units::TickRate;

/// The weight that stands for one: taps are Q30.
pub const WEIGHT_ONE: i32 = 1 << 30;

/// The most taps of a stage: the fourth power of a trinomial has 15 terms.
pub const MAX_TAPS: usize = 15;

/// One tap of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tap {
    /// How many ticks ago the sample was taken that this tap weighs.
    pub delay_ticks: u32,
    /// Its weight; [`WEIGHT_ONE`] stands for one.
    pub weight: i32,
}

/// The taps of one mode, delays increasing from zero, weights summing to [`WEIGHT_ONE`] exactly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    taps: Vec<Tap, MAX_TAPS>,
}

/// A stage's taps wherever they come from, designed or uploaded: delays increasing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageTaps<'t> {
    taps: &'t [Tap],
}

impl<'t> StageTaps<'t> {
    pub(super) fn new(taps: &'t [Tap]) -> Self {
        Self { taps }
    }

    /// The taps, delays increasing.
    pub fn taps(self) -> &'t [Tap] {
        self.taps
    }

    /// The delay of the last tap: for how many ticks the stage remembers.
    pub fn duration_ticks(self) -> u32 {
        self.taps.last().map_or(0, |tap| tap.delay_ticks)
    }

    /// The centroid of the taps in ticks: how far a ramp is delayed.
    pub fn delay_ticks(self) -> f64 {
        self.impulses(1.0).map(|impulse| impulse.amplitude * impulse.time_s).sum()
    }

    /// The taps as impulses in continuous time, for [`super::residual`].
    pub fn impulses(self, tick_period_s: f64) -> impl Iterator<Item = Impulse> + Clone + 't {
        self.taps.iter().map(move |tap| Impulse {
            amplitude: f64::from(tap.weight) / f64::from(WEIGHT_ONE),
            time_s: f64::from(tap.delay_ticks) * tick_period_s,
        })
    }
}

impl Stage {
    /// Designs the stage of `mode` for a tick rate.
    ///
    /// # Errors
    /// [`ModeError::AboveNyquist`] when the mode's frequency is not below half the tick rate.
    pub fn design(mode: &Mode, tick_rate: TickRate) -> Result<Self, ModeError> {
        // The damped frequency would do for the mathematics; this is the rule that a person can apply.
        if 2.0 * mode.frequency_hz() >= tick_rate.hz() {
            return Err(ModeError::AboveNyquist { frequency_hz: mode.frequency_hz(), tick_rate });
        }
        let pole = SampledPole::new(mode, tick_rate);
        let real = match mode.shaper().power_of_zv() {
            Some(power) => pole.power_of_zv(mode, power),
            None => pole.split(design::single_mode(mode)),
        };
        Ok(Self { taps: round_to_sum_one(&real) })
    }

    /// The taps, delays increasing.
    pub fn taps(&self) -> &[Tap] {
        &self.taps
    }

    /// See [`StageTaps::duration_ticks`].
    pub fn duration_ticks(&self) -> u32 {
        StageTaps::new(&self.taps).duration_ticks()
    }

    /// See [`StageTaps::impulses`].
    pub fn impulses(&self, tick_period_s: f64) -> impl Iterator<Item = Impulse> + Clone + '_ {
        StageTaps::new(&self.taps).impulses(tick_period_s)
    }
}

/// Rounds the weights to Q30 and gives what rounding took or added to the largest tap, where it
/// weighs least, so that a constant passes unchanged.
fn round_to_sum_one(real: &RealTaps) -> Vec<Tap, MAX_TAPS> {
    let mut taps: Vec<Tap, MAX_TAPS> = real
        .iter()
        .map(|(delay_ticks, weight)| Tap {
            delay_ticks: *delay_ticks,
            weight: libm::round(weight * f64::from(WEIGHT_ONE)) as i32,
        })
        .collect();
    let excess: i32 = taps.iter().map(|tap| tap.weight).sum::<i32>() - WEIGHT_ONE;
    if let Some(largest) = taps.iter_mut().max_by_key(|tap| tap.weight) {
        largest.weight -= excess;
    }
    taps.retain(|tap| tap.weight != 0);
    taps
}
