//! What a lab sends to the machine: smooth signals known at every instant, with their derivatives.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::jet::Jet;

/// Seconds over which an excitation grows from nothing, and dies away at its end.
const FADE_S: f64 = 1.0;

/// The shape of an excitation, of unit amplitude.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Sine whose frequency runs from one to another over the whole duration.
    Sweep {
        /// At the beginning, hertz.
        from_hz: f64,
        /// At the end, hertz.
        to_hz: f64,
        /// Equal ratios in equal times, rather than equal differences.
        exponential: bool,
    },
    /// Sines of fixed frequencies and phases; amplitudes add up to one over the square root of their number.
    Multisine {
        /// Frequency in hertz and phase in radians of every line.
        lines: Vec<(f64, f64)>,
    },
    /// Minimum-jerk moves there and back, with dwells in which the machine rings down.
    Moves {
        /// Where each dwell is, as shares of the amplitude.
        stops: Vec<f64>,
        /// Seconds of each move.
        move_s: f64,
        /// Seconds from the beginning of a move to that of the next.
        every_s: f64,
    },
    /// Nothing is sent: the machine is pulled aside by the amplitude and let go.
    Release,
    /// Short double pushes without net impulse, each followed by a free decay.
    Doublets {
        /// Size and sign of each.
        pushes: Vec<f64>,
        /// Seconds of each push.
        push_s: f64,
        /// Seconds from the beginning of a push to that of the next.
        every_s: f64,
    },
}

/// An excitation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Excitation {
    /// What it looks like.
    pub shape: Shape,
    /// Times this, in the input's unit.
    pub amplitude: f64,
    /// How long the recording is, seconds.
    pub duration_s: f64,
}

impl Excitation {
    /// A number that tells one run from another.
    pub fn mark(&self) -> u64 {
        self.amplitude.to_bits().rotate_left(17) ^ self.duration_s.to_bits()
    }

    /// Value and derivatives at a time; at rest before zero.
    pub fn at(&self, time_s: f64) -> Jet {
        if time_s <= 0.0 || self.shape == Shape::Release {
            return Jet::default();
        }
        let t = Jet::time(time_s);
        let fade = t.scaled(1.0 / FADE_S).smooth_step()
            * (Jet::constant(self.duration_s) - t).scaled(1.0 / FADE_S).smooth_step();
        let unit = match &self.shape {
            Shape::Sweep { from_hz, to_hz, exponential } => {
                let phase = if *exponential {
                    let rate = (to_hz / from_hz).ln() / self.duration_s;
                    (t.scaled(rate).exp() - Jet::constant(1.0)).scaled(from_hz / rate)
                } else {
                    t.scaled(*from_hz) + (t * t).scaled(0.5 * (to_hz - from_hz) / self.duration_s)
                };
                fade * phase.scaled(TAU).sin()
            }
            Shape::Multisine { lines } => {
                let share = 1.0 / (lines.len().max(1) as f64).sqrt();
                let sum = lines.iter().fold(Jet::default(), |sum, (frequency_hz, phase)| {
                    sum + (t.scaled(TAU * frequency_hz) + Jet::constant(*phase)).sin()
                });
                fade * sum.scaled(share)
            }
            Shape::Moves { stops, move_s, every_s } => {
                let mut position = Jet::default();
                let mut before = 0.0;
                for (number, stop) in stops.iter().enumerate() {
                    let begun = t - Jet::constant(1.0 + number as f64 * every_s);
                    position = position + begun.scaled(1.0 / move_s).smooth_step().scaled(stop - before);
                    before = *stop;
                }
                position
            }
            Shape::Release => Jet::default(),
            Shape::Doublets { pushes, push_s, every_s } => {
                let mut sum = Jet::default();
                for (number, push) in pushes.iter().enumerate() {
                    let s = (t - Jet::constant(1.0 + number as f64 * every_s)).scaled(1.0 / push_s);
                    if (0.0..=1.0).contains(&s.value) {
                        let bump = s.scaled(0.5 * TAU).sin();
                        sum = sum + (s.scaled(TAU).sin() * bump * bump).scaled(*push);
                    }
                }
                sum
            }
        };
        unit.scaled(self.amplitude)
    }

    /// How far the first coordinate is pulled aside before time 0.
    pub fn pulled_aside(&self) -> f64 {
        if self.shape == Shape::Release { self.amplitude } else { 0.0 }
    }

    /// Samples at `rate_hz` joined by straight lines: a reference as a controller follows it.
    pub fn joined(&self, time_s: f64, rate_hz: f64) -> f64 {
        // A time on a sample must not fall below it by rounding.
        let place = (time_s * rate_hz + 1e-9).floor();
        let (from, to) = (self.at(place / rate_hz).value, self.at((place + 1.0) / rate_hz).value);
        from + (to - from) * (time_s * rate_hz - place).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excitations() -> Vec<Excitation> {
        let of = |shape| Excitation { shape, amplitude: 2.0, duration_s: 20.0 };
        vec![
            of(Shape::Sweep { from_hz: 0.5, to_hz: 8.0, exponential: true }),
            of(Shape::Sweep { from_hz: 8.0, to_hz: 0.5, exponential: false }),
            of(Shape::Multisine { lines: vec![(0.7, 0.1), (2.3, 1.0), (6.1, 2.0)] }),
            of(Shape::Moves { stops: vec![1.0, -0.5, 0.0], move_s: 0.6, every_s: 5.0 }),
            of(Shape::Doublets { pushes: vec![1.0, -0.4], push_s: 0.5, every_s: 8.0 }),
        ]
    }

    #[test]
    fn they_start_at_rest_and_their_derivatives_are_their_own() {
        for excitation in excitations() {
            assert_eq!(excitation.at(0.0), Jet::default());
            for k in 1..190 {
                let (t, h) = (0.1 * f64::from(k) + 0.013, 1e-5);
                let slope = (excitation.at(t + h).value - excitation.at(t - h).value) / (2.0 * h);
                let scale = 2.0 * TAU * 8.0;
                assert!((excitation.at(t).rate - slope).abs() < 1e-6 * scale, "{excitation:?} at {t}");
                assert!(excitation.at(t).value.abs() < 2.0 * 3.0_f64.sqrt() + 1e-9);
            }
        }
    }

    #[test]
    fn pushes_leave_no_impulse() {
        let excitation = &excitations()[4];
        let sum: f64 = (0..20_000).map(|k| excitation.at(f64::from(k) * 1e-3).value * 1e-3).sum();
        assert!(sum.abs() < 1e-6, "{sum}");
    }
}
