//! How strong a law has to be to be seen: its effect in standard errors once the machine's own parameters are refitted.

use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::{InitialState, Physics, StateSpace};
use stillbeam_recording::Recording;

use crate::cases::Case;
use crate::truth::{Bench, Run};

/// What a machine would record without noise, and what a refit of its parameters could change.
pub struct Sensitivity {
    bench: Bench,
    runs: Vec<Run>,
    clean: Vec<Recording>,
    /// Noise of every output.
    pub noise_rms: Vec<f64>,
    absorbing: Orthonormal,
}

/// Metres or metres per second, so small that everything stays linear and so large that rounding does not show.
const STATE: f64 = 1e-3;

impl Sensitivity {
    /// `snr_db` is the power of the outputs over that of the noise, over the runs that are trained on.
    pub fn new(bench: Bench, runs: &[Run], snr_db: f64) -> Self {
        let clean: Vec<Recording> = runs.iter().map(|run| bench.clean(*run, &[])).collect();
        let outputs = clean[0].columns.len() - 1;
        let noise_rms: Vec<f64> = (0..outputs)
            .map(|output| {
                let samples = clean.iter().flat_map(|recording| &recording.columns[output + 1].samples);
                let (sum, count) = samples.fold((0.0, 0.0), |(sum, count), y| (sum + y * y, count + 1.0));
                10f64.powf(-snr_db / 20.0) * f64::sqrt(sum / count)
            })
            .collect();
        let mut absorbing = Orthonormal::default();
        let flat = |recordings: &[Recording]| flat(recordings, &noise_rms);
        for output in 0..outputs {
            for index in 0..clean.len() {
                let mut constants = clean.clone();
                for (k, recording) in constants.iter_mut().enumerate() {
                    for (column, c) in recording.columns.iter_mut().skip(1).enumerate() {
                        c.samples.fill(f64::from(k == index && column == output));
                    }
                }
                absorbing.push(flat(&constants));
            }
        }
        // Nobody knows how the machine was moving when a recording began.
        let space = StateSpace::new(&bench.model()).unwrap();
        for coordinate in space.points().iter().filter(|point| point.is_coordinate) {
            for (displacement, velocity) in [(STATE, 0.0), (0.0, STATE)] {
                let begun = InitialState { displacement, velocity };
                for (index, run) in runs.iter().enumerate() {
                    let mut one = clean.clone();
                    one[index] = bench.clean_begun(*run, &coordinate.name, begun);
                    let mut column = flat(&one);
                    add_scaled(&mut column, -1.0, &flat(&clean));
                    let mut rest = column.clone();
                    absorbing.remove_from(&mut rest);
                    if dot(&rest, &rest) > 1e-8 * dot(&column, &column) {
                        absorbing.push(column);
                    }
                }
            }
        }
        for parameter in bench.model().parameters() {
            if parameter.value == 0.0 || parameter.path == "beam.length_m" {
                continue;
            }
            let step = 1e-5;
            let moved = |sign: f64| -> Vec<Recording> {
                let factor = 1.0 + sign * step;
                runs.iter().map(|run| bench.clean_with(*run, &parameter.path, factor)).collect()
            };
            let (after, before) = (flat(&moved(1.0)), flat(&moved(-1.0)));
            let column: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * step)).collect();
            let mut rest = column.clone();
            absorbing.remove_from(&mut rest);
            if dot(&rest, &rest) > 1e-8 * dot(&column, &column) {
                absorbing.push(column);
            }
        }
        Self { bench, runs: runs.to_vec(), clean, noise_rms, absorbing }
    }

    /// Standard errors from no effect, and the share of the effect's power that a refit hides, together with laws that
    /// this one contains: what they could do is not its own.
    pub fn effect_beside(&self, laws: &[Physics], contained: &[Physics]) -> (f64, f64) {
        let mut absorbing = self.absorbing.clone();
        for law in contained {
            absorbing.push(self.change(std::slice::from_ref(law)));
        }
        let mut change = self.change(laws);
        let whole = dot(&change, &change);
        absorbing.remove_from(&mut change);
        let left = dot(&change, &change);
        (left.sqrt(), 1.0 - left / whole)
    }

    fn change(&self, laws: &[Physics]) -> Vec<f64> {
        let with: Vec<Recording> = self.runs.iter().map(|run| self.bench.clean(*run, laws)).collect();
        let (after, before) = (flat(&with, &self.noise_rms), flat(&self.clean, &self.noise_rms));
        after.iter().zip(&before).map(|(a, b)| a - b).collect()
    }

    /// The same without any.
    pub fn effect(&self, laws: &[Physics]) -> (f64, f64) {
        self.effect_beside(laws, &[])
    }

    /// The strength at which the effect has this many standard errors; `None` where none does.
    pub fn strength(&self, case: &Case, wanted: f64) -> Option<f64> {
        let at = |strength: f64| {
            let law = (case.law)(strength);
            let contained: Vec<Physics> = case.contained.iter().map(|make| make(&law)).collect();
            self.effect_beside(&[law], &contained).0
        };
        let mut strength = 1.0;
        for _ in 0..14 {
            let seen = at(strength);
            if (seen / wanted).ln().abs() < 0.1 {
                return Some(strength);
            }
            if !seen.is_finite() {
                strength *= 0.1;
                continue;
            }
            strength *= (wanted / seen.max(1e-9 * wanted)).powf(0.8).clamp(0.02, 50.0);
        }
        let seen = at(strength);
        ((seen / wanted).ln().abs() < 0.4).then_some(strength)
    }
}

fn flat(recordings: &[Recording], noise_rms: &[f64]) -> Vec<f64> {
    let columns = recordings.iter().flat_map(|recording| recording.columns.iter().skip(1).zip(noise_rms));
    columns.flat_map(|(column, rms)| column.samples.iter().map(move |value| value / rms)).collect()
}
