//! The noise that readings show by themselves, whatever any model makes of them.
//!
//! From one sample to the next a sensor's noise changes and the motion goes on: third differences of the
//! readings hold the noise's twenty times and hardly anything of a motion that is well sampled. What a model
//! leaves over is an upper bound of the noise and nothing else: where it is far above what the readings
//! scatter by, the model is wrong. Of a motion with few samples per period, or noise that changes slowly, the
//! differences say too much or too little, so nothing is judged by them alone.

use crate::naming::sets::Member;
use crate::study::Study;

/// Sum of the squares of the weights of a third difference: 1, 3, 3, 1.
const POWER: f64 = 20.0;
/// Median of the absolute value of a normal deviate.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
/// What is left is far above the readings' own noise when it is so many times as large. Slow noise of a
/// correlation of 0.95 from sample to sample is 3 times as large as its differences say.
const FAR_ABOVE: f64 = 5.0;

/// Root mean square of the noise that readings at even times show, in their unit; 0 where most of them repeat
/// the one before.
pub(crate) fn own_noise(samples: &[f64]) -> f64 {
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let mut differences: Vec<f64> = samples.windows(4).map(third).collect();
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    // The median knows nothing of the moments at which a motion jumps.
    let median = *differences.select_nth_unstable_by(middle, f64::total_cmp).1;
    median / MEDIAN / POWER.sqrt()
}

impl Study {
    /// What an output's readings show of their noise, in its unit, at least what rounding to steps makes; of
    /// several recordings the least.
    pub(crate) fn own_noise(&self, output: usize) -> Option<f64> {
        let signals = self.train.iter().chain(&self.held_out).flat_map(|record| &record.outputs);
        let signals = signals.filter(|signal| signal.index == output);
        let levels = signals.map(|signal| {
            let rounding = signal.step.map_or(0.0, |step| step.value / 12f64.sqrt());
            own_noise(&signal.samples).max(rounding)
        });
        levels.reduce(f64::min).filter(|level| *level > 0.0)
    }

    /// Whether a set leaves far more of every output than its readings scatter by themselves.
    pub(crate) fn is_far_above_own_noise(&self, member: &Member) -> bool {
        let on_all = member.on_all();
        let outputs = (0..self.weights.len()).filter_map(|output| Some((output, self.own_noise(output)?)));
        let mut ratios = outputs.map(|(output, noise)| {
            let parts = self.parts(&on_all, output);
            let squares: f64 = parts.iter().flat_map(|part| &part.residual).map(|value| value * value).sum();
            let count: usize = parts.iter().map(|part| part.residual.len()).sum();
            (squares / count.max(1) as f64).sqrt() / noise
        });
        let first = ratios.next();
        first.is_some_and(|first| first > FAR_ABOVE && ratios.all(|ratio| ratio > FAR_ABOVE))
    }

    /// Weights every output by the noise that its own readings show.
    pub(crate) fn weigh_by_own_noise(&mut self) {
        for output in 0..self.weights.len() {
            if let Some(noise) = self.own_noise(output) {
                self.weights[output] = 1.0 / noise;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    use super::*;

    /// A decaying motion of 40 samples a period that is struck twice, with noise that remembers this share of
    /// itself.
    fn readings(seed: u64, noise: f64, memory: f64, step: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut last = 0.0;
        let innovation = noise * (1.0 - memory * memory).sqrt();
        (0..4000)
            .map(|k| {
                let t = f64::from(k);
                let white: f64 = StandardNormal.sample(&mut random);
                last = memory * last + innovation * white;
                let struck = f64::from(k > 1300) + f64::from(k > 2900);
                let value = (-t / 3000.0).exp() * (0.157 * t).sin() + struck + last;
                if step > 0.0 { (value / step).round() * step } else { value }
            })
            .collect()
    }

    #[test]
    fn readings_show_their_noise_beside_a_motion_a_thousand_times_as_large() {
        for seed in 1..6 {
            for noise in [1e-3, 3e-3, 2e-2] {
                let times = own_noise(&readings(seed, noise, 0.0, 0.0)) / noise;
                assert!((0.85..1.6).contains(&times), "{times} times {noise}");
            }
        }
    }

    #[test]
    fn slow_noise_is_never_taken_for_far_less_than_it_is() {
        for seed in 1..6 {
            for memory in [0.5, 0.8, 0.95] {
                let times = own_noise(&readings(seed, 2e-2, memory, 0.0)) / 2e-2;
                assert!((1.0 / FAR_ABOVE..1.3).contains(&times), "{times} times at {memory}");
            }
        }
    }

    #[test]
    fn noise_below_a_step_is_what_rounding_makes_of_it() {
        let times = own_noise(&readings(1, 1e-3, 0.0, 0.01)) / (0.01 / 12f64.sqrt());
        assert!((0.3..2.0).contains(&times), "{times}");
        assert_eq!(own_noise(&[1.0; 200]), 0.0);
        assert_eq!(own_noise(&[1.0; 3]), 0.0);
    }
}
