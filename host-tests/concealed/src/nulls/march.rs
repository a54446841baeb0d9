//! A linear machine's answer to a signal that is smooth, straight or held between its samples.

use crate::truth::excitation::Excitation;
use crate::truth::plant::{LinearPlant, Vector};

/// What the true input does between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Between {
    /// It goes on as the curve that it is.
    Smooth,
    /// In a straight line to the next sample.
    Lines,
    /// It stays until the next sample.
    Held,
}

impl Between {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::Lines => "lines",
            Self::Held => "held",
        }
    }
}

/// Radians that the fastest mode turns in a step: the fourth order is then good to 1e-6.
const TURN: f64 = 0.15;

/// Input and outputs at the samples, from rest.
pub struct Track {
    /// The true input.
    pub input: Vec<f64>,
    /// Every output of the plant.
    pub outputs: Vec<Vec<f64>>,
}

/// Marches by the method of Runge and Kutta of fourth order, whose steps end at the samples.
pub fn march(plant: &LinearPlant, excitation: &Excitation, between: Between, rate_hz: f64) -> Track {
    let count = (excitation.duration_s * rate_hz).floor() as usize;
    let interval_s = 1.0 / rate_hz;
    let cuts = (interval_s * plant.fastest_rad_s / TURN).ceil().max(1.0) as usize;
    let step_s = interval_s / cuts as f64;
    let at = |time_s: f64| excitation.at(time_s);
    let mut track = Track { input: Vec::new(), outputs: vec![Vec::new(); plant.outputs.len()] };
    let (mut x, mut v) = (Vector::zeros(), Vector::zeros());
    for k in 0..=count {
        let start_s = k as f64 * interval_s;
        let here = at(start_s).value;
        track.input.push(here);
        for ((_, row, share), samples) in plant.outputs.iter().zip(&mut track.outputs) {
            samples.push(row.dot(&x) + share * here);
        }
        let slope = (at(start_s + interval_s).value - here) / interval_s;
        let input = |since_s: f64| match between {
            Between::Smooth => {
                let jet = at(start_s + since_s);
                (jet.value, jet.rate)
            }
            Between::Lines => (here + slope * since_s, slope),
            Between::Held => (here, 0.0),
        };
        for cut in 0..cuts {
            step(plant, (&mut x, &mut v), &input, cut as f64 * step_s, step_s);
        }
    }
    track
}

fn step(
    plant: &LinearPlant,
    (x, v): (&mut Vector, &mut Vector),
    input: &dyn Fn(f64) -> (f64, f64),
    from_s: f64,
    step_s: f64,
) {
    let pushed = |since_s: f64| {
        let (value, rate) = input(since_s);
        plant.input * value + plant.input_rate * rate
    };
    let pull = |x: &Vector, v: &Vector, push: &Vector| push - plant.spring * x - plant.damper * v;
    let half = 0.5 * step_s;
    let [first, middle, last] = [pushed(from_s), pushed(from_s + half), pushed(from_s + step_s)];
    let (x1, v1) = (*v, pull(x, v, &first));
    let (x2, v2) = (*v + half * v1, pull(&(*x + half * x1), &(*v + half * v1), &middle));
    let (x3, v3) = (*v + half * v2, pull(&(*x + half * x2), &(*v + half * v2), &middle));
    let (x4, v4) = (*v + step_s * v3, pull(&(*x + step_s * x3), &(*v + step_s * v3), &last));
    *x += step_s / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
    *v += step_s / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nulls::machine::{Chain, Machine};
    use crate::truth::excitation::Shape;

    /// One body of 2 kg on a spring with a resonance at 3 Hz.
    fn body() -> LinearPlant {
        let omega = 3.0 * std::f64::consts::TAU;
        let chain = Chain {
            mass_kg: vec![2.0],
            stiffness: vec![2.0 * omega * omega],
            damping: vec![0.1 * omega],
            moved: false,
        };
        Machine::Chain(chain).plant().unwrap()
    }

    #[test]
    fn a_held_signal_lags_by_half_a_sample() {
        let shape = Shape::Sweep { from_hz: 0.2, to_hz: 1.0, exponential: false };
        let excitation = Excitation { shape, amplitude: 10.0, duration_s: 20.0 };
        let smooth = march(&body(), &excitation, Between::Smooth, 200.0).outputs.remove(0);
        let held = march(&body(), &excitation, Between::Held, 200.0).outputs.remove(0);
        let lines = march(&body(), &excitation, Between::Lines, 200.0).outputs.remove(0);
        let size = smooth.iter().map(|y| y * y).sum::<f64>();
        let off = |other: &[f64], late: f64| {
            let differences = (2..smooth.len() - 2).map(|k| {
                let slope = 0.5 * (smooth[k + 1] - smooth[k - 1]);
                (other[k] - smooth[k] + late * slope).powi(2)
            });
            (differences.sum::<f64>() / size).sqrt()
        };
        assert!(off(&held, 0.5) < 0.1 * off(&held, 0.0), "{} {}", off(&held, 0.5), off(&held, 0.0));
        assert!(off(&lines, 0.0) < 1e-3, "{}", off(&lines, 0.0));
    }

    #[test]
    fn a_steady_sine_has_the_textbook_response() {
        let shape = Shape::Multisine { lines: vec![(2.0, 0.0)] };
        let excitation = Excitation { shape, amplitude: 10.0, duration_s: 60.0 };
        let y = march(&body(), &excitation, Between::Smooth, 100.0).outputs.remove(0);
        let most = y[3000..5000].iter().copied().fold(0.0, f64::max);
        let omega = 3.0 * std::f64::consts::TAU;
        let r: f64 = 2.0 / 3.0;
        let wanted = 10.0 / (2.0 * omega * omega) / ((1.0 - r * r).powi(2) + (0.05 * r).powi(2)).sqrt();
        assert!((most / wanted - 1.0).abs() < 3e-3, "{most} {wanted}");
    }
}
