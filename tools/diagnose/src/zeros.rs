//! Zeros of velocity sensors, as recordings that begin at rest show them: known no better than the noise of
//! their samples at rest.

use stillbeam_identify::tall::dot;
use stillbeam_recording::Role;

use crate::input_noise::flat_power;
use crate::noise::NoiseFloor;
use crate::record::Record;
use crate::stacking::{RecordFit, Stack};
use crate::study::{OnAll, Study};

/// A zero lies within so many standard errors of the mean of its samples at rest.
const WITHIN: f64 = 3.0;

/// What a sensor reads where nothing moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zero {
    /// The mean of the samples at rest, in the output's unit.
    pub(crate) mean: f64,
    /// How many they are.
    pub(crate) samples: usize,
    /// By how much the zero was moved since, as the rest of the recording asks.
    pub(crate) moved: f64,
}

impl Zero {
    /// The zero is not moved further than the noise of the samples at rest (its root mean square) allows.
    fn move_by(&mut self, asked: f64, noise_rms: f64) -> f64 {
        let reach = WITHIN * noise_rms / (self.samples.max(1) as f64).sqrt();
        let before = self.moved;
        self.moved = (before + asked).clamp(-reach, reach);
        self.moved - before
    }
}

impl Study {
    /// Moves every zero that was seen to where a model on all recordings would have it. A zero from one
    /// sample is as wrong as that one; a free one would take up what always brakes in one direction.
    pub(crate) fn trim_zeros(&mut self, on_all: &OnAll, floors: &[Option<NoiseFloor>]) {
        let asked = [(Role::Train, &on_all.train), (Role::HeldOut, &on_all.held_out)]
            .map(|(role, fits)| asked(&self.stack(role), fits));
        for (record, asked) in self.train.iter_mut().chain(&mut self.held_out).zip(asked.concat()) {
            record.trim_zeros(&asked, floors);
        }
    }
}

/// By how much more every output of every recording reads than its model, as far as neither an initial state
/// nor an offset that is free makes that.
fn asked(stack: &Stack<'_>, fits: &[RecordFit]) -> Vec<Vec<f64>> {
    let of_record = |(index, fit): (usize, &RecordFit)| {
        let outputs = &stack.records[index].outputs;
        let of_output = |which: usize| {
            let steady = |(k, output): (usize, &crate::record::OutputSignal)| {
                vec![f64::from(k == which); output.at.len()]
            };
            let signals: Vec<Vec<f64>> = outputs.iter().enumerate().map(steady).collect();
            let mut own = stack.weighted(index, &signals);
            fit.nuisances.remove_from(&mut own);
            let length = dot(&own, &own);
            if length > 0.0 { dot(&own, &fit.residuals) / length } else { 0.0 }
        };
        (0..outputs.len()).map(of_output).collect()
    };
    fits.iter().enumerate().map(of_record).collect()
}

impl Record {
    fn trim_zeros(&mut self, asked: &[f64], floors: &[Option<NoiseFloor>]) {
        for (output, asked) in self.outputs.iter_mut().zip(asked) {
            let floor = floors.get(output.index).and_then(Option::as_ref);
            if let (Some(zero), Some(floor)) = (&mut output.zero, floor) {
                // What a wrong model leaves is no noise of its sensor.
                let own_rms = flat_power(&output.samples).sqrt();
                let moved = zero.move_by(*asked, floor.rms.min(own_rms));
                output.samples.iter_mut().for_each(|sample| *sample -= moved);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;
    use stillbeam_plant::{Model, simulate};
    use stillbeam_recording::Recording;

    use super::*;
    use crate::noise::NoiseSource;
    use crate::simulation::Hypothesis;

    const OSCILLATOR: &str = "schema = 1\nkind = \"lumped\"\nbody = [{ name = \"a\", mass = 1.0 }]\n\
        spring = [{ between = [\"a\", \"ground\"], stiffness = 150.0 }]\n\
        damper = [{ between = [\"a\", \"ground\"], damping = 0.5 }]\n\
        input = { column = \"force_N\", body = \"a\" }\n\
        output = [{ column = \"a_m_s\", body = \"a\", quantity = \"velocity\" }]";

    /// The noise of the sensor, root mean square.
    const NOISE_M_S: f64 = 3e-4;

    /// A run of the oscillator that begins at rest, its first sample off by `first_m_s`.
    fn run(first_m_s: f64, seed: u64) -> Recording {
        let model = Model::from_toml("oscillator.toml", OSCILLATOR).unwrap();
        let times: Vec<f64> = (0..1200).map(|k| 0.01 * f64::from(k)).collect();
        let force = times.iter().map(|t| (7.0 * t).sin() + (13.0 * t).sin()).collect();
        let run = simulate(&model, &Recording::new("run", times).with_column("force_N", force)).unwrap();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let noise = Normal::new(0.0, NOISE_M_S).unwrap();
        let speed = run.column("a_m_s").unwrap().iter();
        let mut read: Vec<f64> = speed.map(|v| v + noise.sample(&mut random)).collect();
        read[0] = first_m_s;
        Recording::new("run", run.time_s.clone())
            .with_column("force_N", run.column("force_N").unwrap().to_vec())
            .with_column("a_m_s", read)
    }

    /// The zero after the trim beside a floor of this root mean square, and by how much it was moved.
    fn trimmed(first_m_s: f64, floor_m_s: f64) -> (f64, f64) {
        let model = Model::from_toml("oscillator.toml", OSCILLATOR).unwrap();
        let runs = [run(first_m_s, 1), run(0.0, 2)];
        let mut study = Study::new(&model, &runs[..1], &runs[1..]).unwrap();
        let on_all = study.on_all(&Hypothesis::given(&model), &[], &[]).unwrap();
        let floor = NoiseFloor { rms: floor_m_s, source: NoiseSource::QuietStretches, samples: 1200.0 };
        study.trim_zeros(&on_all, &[Some(floor)]);
        let zero = study.train[0].outputs[0].zero.expect("it begins at rest");
        (zero.mean + zero.moved, zero.moved)
    }

    #[test]
    fn a_zero_seen_in_one_noisy_sample_is_moved_to_where_the_rest_of_the_recording_has_it() {
        for first_m_s in [2e-4, -5e-4] {
            let (zero, _) = trimmed(first_m_s, NOISE_M_S);
            assert!(zero.abs() < 3e-5, "{zero}");
        }
    }

    #[test]
    fn a_zero_is_moved_no_further_than_the_sensor_is_noisy_whatever_the_model_leaves() {
        for floor_m_s in [NOISE_M_S, 0.1] {
            let (_, moved) = trimmed(5e-3, floor_m_s);
            let reach = WITHIN * NOISE_M_S;
            assert!(moved < -0.7 * reach && moved > -1.3 * reach, "{moved}");
        }
    }
}
