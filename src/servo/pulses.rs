//! Step pulses: whole steps whose sum follows the setpoint to half a step.
//!
//! Each tick puts out the difference between the steps that the setpoint stands for and those already made,
//! at most [`PulseScale::max_steps`]. Nothing is ever lost: what does not fit into a tick is made in the next
//! ones. A velocity below [`PulseScale::max_velocity_mm_s`] never has to wait.

use super::train::PulseConfiguration;
use crate::machine::TIMER_CLOCK_HZ;
use crate::settings::PulseKind;
use crate::units::{Nanometres, TickRate};

/// What a drive wants of its pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PulseTiming {
    /// The least length of a pulse and of the pause between two, in µs; of quadrature, the least distance of
    /// two edges.
    pub width_us: f64,
    /// The least time from a change of the direction to the first step, in µs.
    pub setup_us: f64,
    /// A pulse is a low level.
    pub active_low: bool,
}

impl PulseTiming {
    /// Accepted widths in µs.
    pub const WIDTH_RANGE_US: (f64, f64) = (1.0, 100.0);
    /// Accepted set-up times in µs.
    pub const SETUP_RANGE_US: (f64, f64) = (0.0, 1000.0);
}

impl Default for PulseTiming {
    /// 1 µs each, which is what most drives ask for, and high pulses.
    fn default() -> Self {
        Self { width_us: 1.0, setup_us: 1.0, active_low: false }
    }
}

/// The most steps in one tick, whatever the rate: what the timer's repetition counter holds, with room to
/// spare.
pub const MAX_STEPS_PER_TICK: u16 = 240;

/// How steps relate to nanometres at one tick rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PulseScale {
    /// Steps per nanometre, Q36.
    steps_per_nm: i64,
    max_steps: u16,
    timing: TrainTiming,
    configuration: PulseConfiguration,
    /// Ticks that pass between a change of the direction and the first step.
    setup_ticks: u8,
}

const FRACTION_BITS: u32 = 36;

impl PulseScale {
    /// The most steps per millimetre, either direction.
    pub const MAX_STEPS_PER_MM: f64 = 10_000.0;

    /// `steps_per_mm` steps per millimetre, negative for the other direction, up to ±
    /// [`Self::MAX_STEPS_PER_MM`]. Below 0.1 the scale is coarser than a hundredth of a step per metre.
    pub fn new(kind: PulseKind, steps_per_mm: f64, pulses: &PulseTiming, tick_rate: TickRate) -> Self {
        let limited = steps_per_mm.clamp(-Self::MAX_STEPS_PER_MM, Self::MAX_STEPS_PER_MM);
        let steps_per_nm = libm::round(libm::scalbn(limited / 1.0e6, FRACTION_BITS as i32)) as i64;
        let timing = TrainTiming::new(tick_rate);
        let max_steps = timing.max_steps(pulses);
        // A train begins with half a period of pause, the shortest with most steps.
        let pause_us = timing.microseconds(timing.period(max_steps) / 2);
        let needs_ticks = kind == PulseKind::Step && pulses.setup_us > pause_us;
        let setup_ticks = libm::ceil(pulses.setup_us * 1e-6 * tick_rate.hz()) as u8;
        Self {
            steps_per_nm,
            max_steps,
            timing,
            configuration: PulseConfiguration::new(kind, timing.prescaler, pulses.active_low),
            setup_ticks: if needs_ticks { setup_ticks } else { 0 },
        }
    }

    /// What the hardware has to be set up for.
    #[inline]
    pub fn configuration(&self) -> PulseConfiguration {
        self.configuration
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
    pub fn max_velocity_mm_s(steps_per_mm: f64, pulses: &PulseTiming, tick_rate: TickRate) -> f64 {
        f64::from(TrainTiming::new(tick_rate).max_steps(pulses)) * tick_rate.hz() / libm::fabs(steps_per_mm)
    }

    /// The steps that stand for a position: the nearest whole number.
    #[inline]
    fn steps(&self, position: Nanometres) -> i64 {
        // At most 2³¹ · 10⁻² · 2³⁶: no overflow.
        (i64::from(position.0) * self.steps_per_nm + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS
    }
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
    /// The last train went up; at first nobody knows.
    up: Option<bool>,
    /// Ticks that still have to pass before the next train.
    wait_ticks: u8,
}

/// The steps of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepTrain {
    /// How many, and in which direction; at most [`PulseScale::max_steps`] either way.
    pub steps: i16,
    /// Counts of the timer per step; zero for no steps.
    pub period: u16,
    /// The direction of the steps, or of those to come.
    pub up: bool,
    /// Whether more were needed than fit.
    pub behind: bool,
}

impl Pulses {
    /// Starts in step with the setpoint at `position`.
    pub fn new(scale: PulseScale, position: Nanometres) -> Self {
        // The hardware gets a tick to be found out of date by whoever compares configurations.
        Self { scale, made: scale.steps(position), up: None, wait_ticks: 1 }
    }

    /// The same output with another scale, from `setpoint` on. Steps that are still to be made stay so.
    pub fn rescaled(&self, scale: PulseScale, setpoint: Nanometres) -> Self {
        let owed = self.scale.steps(setpoint) - self.made;
        Self { made: scale.steps(setpoint) - owed, ..Self::new(scale, setpoint) }
    }

    /// What the hardware has to be set up for.
    #[inline]
    pub fn configuration(&self) -> PulseConfiguration {
        self.scale.configuration
    }

    /// The steps of the tick that puts out `setpoint`; none while the output still is `busy` with earlier
    /// ones.
    #[inline]
    pub fn step(&mut self, setpoint: Nanometres, busy: bool) -> StepTrain {
        let wanted = self.scale.steps(setpoint) - self.made;
        if wanted == 0 {
            self.wait_ticks = self.wait_ticks.saturating_sub(1);
            return StepTrain { steps: 0, period: 0, up: self.up.unwrap_or(true), behind: false };
        }
        let up = wanted > 0;
        let ready = !busy && self.is_set_up(up);
        let most = if ready { i64::from(self.scale.max_steps) } else { 0 };
        let made = wanted.max(-most).min(most);
        self.made += made;
        let steps = made as i16;
        // A direction that is being set up holds steps back, which is no more than it is there for.
        let behind = made != wanted && (busy || ready);
        StepTrain {
            steps,
            period: self.scale.timing.period(steps.unsigned_abs()),
            up: self.up == Some(true),
            behind,
        }
    }

    /// Whether the direction has been what it has to be for long enough. Changes it where it is not.
    #[inline]
    fn is_set_up(&mut self, up: bool) -> bool {
        if self.up != Some(up) {
            self.up = Some(up);
            self.wait_ticks = self.wait_ticks.max(self.scale.setup_ticks);
        }
        let ready = self.wait_ticks == 0;
        self.wait_ticks = self.wait_ticks.saturating_sub(1);
        ready
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

    fn microseconds(&self, counts: u16) -> f64 {
        f64::from(counts) * f64::from(self.prescaler + 1) / (f64::from(PULSE_TIMER_CLOCK_HZ) * 1e-6)
    }

    /// The most steps of a train whose edges are as far apart as `pulses` asks for, evenly spread over most
    /// of the tick, so that each train ends before the next begins.
    fn max_steps(&self, pulses: &PulseTiming) -> u16 {
        let train_us = self.microseconds(self.counts);
        let mut steps = ((train_us / (2.0 * pulses.width_us)) as u16).clamp(1, MAX_STEPS_PER_TICK);
        // Whole counts may be a little short of it.
        while steps > 1 && self.microseconds(self.period(steps) / 2) < pulses.width_us {
            steps -= 1;
        }
        steps
    }

    /// Counts per step of a train of `steps`, from 1 to [`MAX_STEPS_PER_TICK`]. All of them together are
    /// within the share; zero for another number of steps.
    #[inline]
    pub fn period(&self, steps: u16) -> u16 {
        let reciprocal = RECIPROCALS.get(usize::from(steps)).copied().unwrap_or(0);
        ((u32::from(self.counts) * reciprocal) >> 16) as u16
    }
}
