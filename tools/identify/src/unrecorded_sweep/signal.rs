//! The sweeps that exciters and motion controllers make, as accelerations or forces over time.

use std::f64::consts::{PI, TAU};

use super::plan::SweepPlan;

/// What a sweep keeps the same while its frequency changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepShape {
    /// Pulses of constant acceleration, two of either sign a period, their size in proportion to the
    /// frequency: Klipper's resonance test.
    Pulses,
    /// The same pulses with a frequency that grows without a pause, where [`Self::Pulses`] keep it over each
    /// half period.
    GlidingPulses,
    /// A sine of constant force or acceleration.
    Force,
    /// A sine of constant velocity.
    Velocity,
    /// A sine of constant position.
    Position,
}

impl SweepShape {
    /// Whether it may start anywhere in a period.
    pub(super) fn starts_anywhere(self) -> bool {
        self != Self::Pulses
    }

    pub(super) const ALL: [Self; 5] =
        [Self::Pulses, Self::GlidingPulses, Self::Force, Self::Velocity, Self::Position];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pulses => "pulses of acceleration in proportion to the frequency",
            Self::GlidingPulses => {
                "pulses of acceleration in proportion to the frequency, which grows without a pause"
            }
            Self::Force => "a sine of constant force or acceleration",
            Self::Velocity => "a sine of constant velocity",
            Self::Position => "a sine of constant position",
        }
    }
}

/// A sweep with all its numbers, over time from its start.
#[derive(Debug, Clone)]
pub(super) struct SweepSignal {
    plan: SweepPlan,
    /// Hz/s of a linear sweep, 1/s of an exponential one.
    rate: f64,
    pub(super) duration_s: f64,
    shape: SweepShape,
    /// Where in a period the sweep starts, periods. The controller's pulses start where they do.
    phase: f64,
    /// Start and frequency of every half period, of pulses.
    halves: Vec<[f64; 2]>,
}

/// Half periods that a sweep may have: more are no sweep that a recorder has seen whole.
const MOST_HALVES: usize = 4_000_000;

impl SweepSignal {
    pub(super) fn new(plan: &SweepPlan, rate: f64, shape: SweepShape, phase: f64) -> Self {
        let span = match plan.exponential {
            true => (plan.to_hz / plan.from_hz).ln(),
            false => plan.to_hz - plan.from_hz,
        };
        let mut signal =
            Self { plan: *plan, rate, duration_s: span / rate, shape, phase, halves: Vec::new() };
        if shape == SweepShape::Pulses {
            let mut start_s = 0.0;
            while start_s < signal.duration_s && signal.halves.len() < MOST_HALVES {
                let hz = signal.frequency_hz(start_s);
                signal.halves.push([start_s, hz]);
                start_s += 0.5 / hz;
            }
        }
        signal
    }

    /// Frequency at a time from the start, s; that of the ends beyond them.
    pub(super) fn frequency_hz(&self, since_s: f64) -> f64 {
        let since_s = since_s.clamp(0.0, self.duration_s);
        match self.plan.exponential {
            true => self.plan.from_hz * (self.rate * since_s).exp(),
            false => self.plan.from_hz + self.rate * since_s,
        }
    }

    /// Number, start and frequency of the half period of pulses at a time: within it the frequency stays.
    fn half(&self, since_s: f64) -> (usize, [f64; 2]) {
        let next = self.halves.partition_point(|[start_s, _]| *start_s <= since_s);
        let half = next.saturating_sub(1);
        (half, self.halves.get(half).copied().unwrap_or([0.0, self.plan.from_hz]))
    }

    /// Periods since the start, between start and end.
    pub(super) fn periods(&self, since_s: f64) -> f64 {
        if self.shape == SweepShape::Pulses {
            let (half, [start_s, hz]) = self.half(since_s);
            return 0.5 * half as f64 + (since_s - start_s) * hz;
        }
        self.phase
            + match self.plan.exponential {
                true => self.plan.from_hz * (self.rate * since_s).exp_m1() / self.rate,
                false => since_s * (self.plan.from_hz + 0.5 * self.rate * since_s),
            }
    }

    /// Acceleration or force at a time from the start, 1 at the geometric middle of the band; of pulses the
    /// harmonics below a frequency. Nothing before the start and after the end.
    pub(super) fn value(&self, since_s: f64, below_hz: f64) -> f64 {
        if !(0.0..=self.duration_s).contains(&since_s) {
            return 0.0;
        }
        let hz = match self.shape {
            SweepShape::Pulses => self.half(since_s).1[1],
            _ => self.frequency_hz(since_s),
        };
        let periods = self.periods(since_s);
        let turn = TAU * (periods - periods.floor());
        let size = hz / (self.plan.from_hz * self.plan.to_hz).sqrt();
        match self.shape {
            SweepShape::Force => turn.sin(),
            SweepShape::Velocity => size * turn.cos(),
            SweepShape::Position => size * size * turn.sin(),
            SweepShape::Pulses | SweepShape::GlidingPulses => {
                // A square wave that is 1 around every whole period; each cosine follows from the two before.
                let double = 2.0 * (2.0 * turn).cos();
                let (mut before, mut here) = (turn.cos(), turn.cos());
                let (mut wave, mut n, mut sign) = (here, 1.0, 1.0);
                while (n + 2.0) * hz < below_hz {
                    (before, here) = (here, double * here - before);
                    n += 2.0;
                    sign = -sign;
                    wave += sign * here / n;
                }
                size * 4.0 / PI * wave
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The half periods as Klipper's `VibrationPulseTest` makes them.
    fn klipper(from_hz: f64, to_hz: f64, hz_per_s: f64) -> Vec<[f64; 2]> {
        let (mut time_s, mut hz, mut sign) = (0.0, from_hz, 1.0);
        let mut steps = Vec::new();
        while hz <= to_hz + 1e-6 {
            let quarter_s = 0.25 / hz;
            steps.push([time_s, sign * hz]);
            steps.push([time_s + quarter_s, -sign * hz]);
            time_s += 2.0 * quarter_s;
            hz += 2.0 * quarter_s * hz_per_s;
            sign = -sign;
        }
        steps
    }

    #[test]
    fn pulses_are_those_of_the_controllers_resonance_test() {
        let plan: SweepPlan = "5,95,2.5Hz/s".parse().unwrap();
        let signal = SweepSignal::new(&plan, 2.5, SweepShape::Pulses, 0.0);
        let middle_hz = (5.0_f64 * 95.0).sqrt();
        for pair in klipper(5.0, 94.0, 2.5).windows(2) {
            let [start_s, acceleration] = pair[0];
            let value = signal.value(0.5 * (start_s + pair[1][0]), 1e5);
            assert!(
                (value * middle_hz / acceleration - 1.0).abs() < 2e-2,
                "{start_s} {value} {acceleration}"
            );
        }
    }

    #[test]
    fn the_phase_is_the_integral_of_the_frequency() {
        for (text, rate) in [("2,40,60s", 38.0 / 60.0), ("40,2,60s,exponential", (0.05_f64).ln() / 60.0)] {
            let signal = SweepSignal::new(&text.parse().unwrap(), rate, SweepShape::Force, 0.0);
            assert!((signal.duration_s - 60.0).abs() < 1e-9);
            for k in 1..59 {
                let (t, h) = (f64::from(k), 1e-3);
                let slope = (signal.periods(t + h) - signal.periods(t - h)) / (2.0 * h);
                assert!((slope / signal.frequency_hz(t) - 1.0).abs() < 1e-5);
            }
        }
    }
}
