//! Step pulses: whole steps whose sum follows the setpoint to half a step.
//!
//! Each tick puts out the difference between the steps that the setpoint stands for and those already made, at most
//! [`PulseScale::max_steps`]. Nothing is ever lost: what does not fit into a tick is made in the next ones. A velocity
//! below [`PulseScale::max_velocity_mm_s`] never has to wait.

use crate::machine::TIMER_CLOCK_HZ;
use crate::units::{Nanometres, TickRate};

/// The most steps per second, in every tick's share of it.
///
/// Pulses are half of their period long, so this one keeps them at 1 µs or longer.
pub const MAX_STEP_RATE_HZ: f64 = 500_000.0;

/// The most steps in one tick, whatever the rate: what the timer's repetition counter holds, with room to spare.
pub const MAX_STEPS_PER_TICK: u16 = 240;

/// How steps relate to nanometres at one tick rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseScale {
    /// Steps per nanometre, Q36.
    steps_per_nm: i64,
    max_steps: u16,
    timing: TrainTiming,
}

const FRACTION_BITS: u32 = 36;

impl PulseScale {
    /// The most steps per millimetre, either direction.
    pub const MAX_STEPS_PER_MM: f64 = 10_000.0;

    /// `steps_per_mm` steps per millimetre, negative for the other direction, up to ± [`Self::MAX_STEPS_PER_MM`]. Below
    /// 0.1 the scale is coarser than a hundredth of a step per metre.
    pub fn new(steps_per_mm: f64, tick_rate: TickRate) -> Self {
        let limited = steps_per_mm.clamp(-Self::MAX_STEPS_PER_MM, Self::MAX_STEPS_PER_MM);
        let steps_per_nm = libm::round(libm::scalbn(limited / 1.0e6, FRACTION_BITS as i32)) as i64;
        Self { steps_per_nm, max_steps: max_steps_per_tick(tick_rate), timing: TrainTiming::new(tick_rate) }
    }

    /// How the timer makes the steps.
    pub fn timing(&self) -> TrainTiming {
        self.timing
    }

    /// The most steps that one tick puts out.
    pub fn max_steps(&self) -> u16 {
        self.max_steps
    }

    /// The fastest setpoint that the steps can follow, in mm/s.
    pub fn max_velocity_mm_s(steps_per_mm: f64, tick_rate: TickRate) -> f64 {
        f64::from(max_steps_per_tick(tick_rate)) * tick_rate.hz() / libm::fabs(steps_per_mm)
    }

    /// The steps that stand for a position: the nearest whole number.
    #[inline]
    fn steps(&self, position: Nanometres) -> i64 {
        // At most 2³¹ · 10⁻² · 2³⁶: no overflow.
        (i64::from(position.0) * self.steps_per_nm + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS
    }
}

/// Evenly spread over most of the tick, so that each train ends before the next begins.
fn max_steps_per_tick(tick_rate: TickRate) -> u16 {
    let steps = MAX_STEP_RATE_HZ * tick_rate.period_s() * TRAIN_SHARE;
    (libm::floor(steps) as u16).clamp(1, MAX_STEPS_PER_TICK)
}

/// The clock of the timer that makes the pulses: twice that of the tick's timer.
const PULSE_TIMER_CLOCK_HZ: u32 = 2 * TIMER_CLOCK_HZ;

/// The part of a tick that a train of pulses may take.
pub const TRAIN_SHARE: f64 = 15.0 / 16.0;

/// The steps made so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulses {
    scale: PulseScale,
    made: i64,
}

/// The steps of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepTrain {
    /// How many, and in which direction; at most [`PulseScale::max_steps`] either way.
    pub steps: i16,
    /// Counts of the timer per step; zero for no steps.
    pub period: u16,
    /// Whether more were needed than fit.
    pub behind: bool,
}

impl Pulses {
    /// Starts in step with the setpoint at `position`.
    pub fn new(scale: PulseScale, position: Nanometres) -> Self {
        Self { scale, made: scale.steps(position) }
    }

    /// The steps of the tick that puts out `setpoint`; none while the output still is `busy` with earlier ones.
    #[inline]
    pub fn step(&mut self, setpoint: Nanometres, busy: bool) -> StepTrain {
        let wanted = self.scale.steps(setpoint) - self.made;
        let most = if busy { 0 } else { i64::from(self.scale.max_steps) };
        let made = wanted.max(-most).min(most);
        self.made += made;
        let steps = made as i16;
        StepTrain { steps, period: self.scale.timing.period(steps.unsigned_abs()), behind: made != wanted }
    }
}

/// How a timer makes the trains of one tick rate, each spread over [`TRAIN_SHARE`] of its tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainTiming {
    /// The timer counts every so many of its clocks, less one.
    pub prescaler: u16,
    /// Counts that a train may take.
    counts: u16,
}

#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler")]
/// ⌊2¹⁶ / n⌋, zero for n = 0, so that the tick multiplies where it would divide.
const RECIPROCALS: [u32; MAX_STEPS_PER_TICK as usize + 1] = {
    let mut table = [0; MAX_STEPS_PER_TICK as usize + 1];
    let mut steps = 1;
    while steps < table.len() {
        table[steps] = 65_536 / steps as u32;
        steps += 1;
    }
    table
};

impl TrainTiming {
    /// For a tick rate.
    pub fn new(tick_rate: TickRate) -> Self {
        let clocks = tick_rate.clocks_per_tick(PULSE_TIMER_CLOCK_HZ);
        let prescaler = clocks / 65_536;
        let counts = f64::from(clocks / (prescaler + 1)) * TRAIN_SHARE;
        // 200 Hz is a prescaler of 12; the counts of a tick are below 2¹⁶ by the line above.
        Self { prescaler: prescaler as u16, counts: counts as u16 }
    }

    /// Counts per step of a train of `steps`, from 1 to [`MAX_STEPS_PER_TICK`]. All of them together are within the share;
    /// zero for another number of steps.
    #[inline]
    pub fn period(&self, steps: u16) -> u16 {
        let reciprocal = RECIPROCALS.get(usize::from(steps)).copied().unwrap_or(0);
        ((u32::from(self.counts) * reciprocal) >> 16) as u16
    }
}
