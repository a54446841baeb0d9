//! How strong a law has to be to be seen: its effect in standard errors once the machine's own parameters are refitted.

use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::{InitialState, Physics, StateSpace};
use stillbeam_recording::Recording;

use crate::cases::Case;
use crate::truth::{Bench, Run};

/// Runs of one role without noise, and what nobody knows of each: offsets of its outputs, and how the machine was moving when it began.
struct Role {
    runs: Vec<Run>,
    clean: Vec<Recording>,
    unknown: Orthonormal,
}

/// What a machine would record without noise, and what a refit of its parameters could change.
pub struct Sensitivity {
    bench: Bench,
    trained: Role,
    /// Without runs where only training counts.
    held_out: Role,
    /// Noise of every output.
    pub noise_rms: Vec<f64>,
    /// What is unknown of the training runs, and what the parameters change in them.
    absorbing: Orthonormal,
    /// What the same columns are on the held-out runs, in their order.
    follows: Vec<Vec<f64>>,
}

/// Metres or metres per second, so small that everything stays linear and so large that rounding does not show.
const STATE: f64 = 1e-3;

/// A column this much of which, by power, others make too is one of them.
const REPEATED: f64 = 1e-8;

impl Role {
    fn new(bench: Bench, runs: &[Run], noise_rms: &[f64]) -> Self {
        let clean: Vec<Recording> = runs.iter().map(|run| bench.clean(*run, &[])).collect();
        let mut role = Self { runs: runs.to_vec(), clean, unknown: Orthonormal::default() };
        for output in 0..noise_rms.len() {
            for index in 0..role.clean.len() {
                let mut constants = role.clean.clone();
                for (k, recording) in constants.iter_mut().enumerate() {
                    for (column, c) in recording.columns.iter_mut().skip(1).enumerate() {
                        c.samples.fill(f64::from(k == index && column == output));
                    }
                }
                role.unknown.push(flat(&constants, noise_rms));
            }
        }
        let space = StateSpace::new(&bench.model()).unwrap();
        for coordinate in space.points().iter().filter(|point| point.is_coordinate) {
            for (displacement, velocity) in [(STATE, 0.0), (0.0, STATE)] {
                let begun = InitialState { displacement, velocity };
                for (index, run) in runs.iter().enumerate() {
                    let mut one = role.clean.clone();
                    one[index] = bench.clean_begun(*run, &coordinate.name, begun);
                    let column = role.against_clean(&one, noise_rms);
                    if is_new(&role.unknown, &column) {
                        role.unknown.push(column);
                    }
                }
            }
        }
        role
    }

    /// The change of these recordings from what the machine as it is would record.
    fn against_clean(&self, changed: &[Recording], noise_rms: &[f64]) -> Vec<f64> {
        difference(flat(changed, noise_rms), &flat(&self.clean, noise_rms))
    }

    /// The change that laws make.
    fn change(&self, bench: Bench, laws: &[Physics], noise_rms: &[f64]) -> Vec<f64> {
        let with: Vec<Recording> = self.runs.iter().map(|run| bench.clean(*run, laws)).collect();
        self.against_clean(&with, noise_rms)
    }

    /// The change that a parameter makes, per share of its value.
    fn slope(&self, bench: Bench, path: &str, noise_rms: &[f64]) -> Vec<f64> {
        let step = 1e-5;
        let moved = |factor: f64| -> Vec<f64> {
            let moved: Vec<Recording> =
                self.runs.iter().map(|run| bench.clean_with(*run, path, factor)).collect();
            flat(&moved, noise_rms)
        };
        let change = difference(moved(1.0 + step), &moved(1.0 - step));
        change.into_iter().map(|value| value / (2.0 * step)).collect()
    }
}

fn is_new(basis: &Orthonormal, column: &[f64]) -> bool {
    let mut rest = column.to_vec();
    basis.remove_from(&mut rest);
    dot(&rest, &rest) > REPEATED * dot(column, column)
}

fn difference(mut left: Vec<f64>, right: &[f64]) -> Vec<f64> {
    add_scaled(&mut left, -1.0, right);
    left
}

impl Sensitivity {
    /// `snr_db` is the power of the outputs over that of the noise, over the runs that are trained on. A law is seen as well as on the
    /// training runs or on those held out, whichever show it less: what only the former show nobody can confirm.
    pub fn new(bench: Bench, trained: &[Run], held_out: &[Run], snr_db: f64) -> Self {
        let clean: Vec<Recording> = trained.iter().map(|run| bench.clean(*run, &[])).collect();
        let outputs = clean[0].columns.len() - 1;
        let noise_rms: Vec<f64> = (0..outputs)
            .map(|output| {
                let samples = clean.iter().flat_map(|recording| &recording.columns[output + 1].samples);
                let (sum, count) = samples.fold((0.0, 0.0), |(sum, count), y| (sum + y * y, count + 1.0));
                10f64.powf(-snr_db / 20.0) * f64::sqrt(sum / count)
            })
            .collect();
        let trained = Role::new(bench, trained, &noise_rms);
        let held_out = Role::new(bench, held_out, &noise_rms);
        let mut absorbing = trained.unknown.clone();
        // What is unknown of one run is nothing on others.
        let nothing = vec![0.0; flat(&held_out.clean, &noise_rms).len()];
        let unknowns = absorbing.remove_from(&mut vec![0.0; flat(&trained.clean, &noise_rms).len()]).len();
        let mut follows = vec![nothing; unknowns];
        for parameter in bench.model().parameters() {
            if parameter.value == 0.0 || parameter.fixed || parameter.path == "beam.length_m" {
                continue;
            }
            let column = trained.slope(bench, &parameter.path, &noise_rms);
            if is_new(&absorbing, &column) {
                absorbing.push(column);
                follows.push(held_out.slope(bench, &parameter.path, &noise_rms));
            }
        }
        Self { bench, trained, held_out, noise_rms, absorbing, follows }
    }

    /// A law as the sensors see it. Noise before a rounding blurs its steps: all that is seen of them is the mean over the noise, and of
    /// steps below the noise nothing but a little more noise.
    pub fn as_seen(&self, law: &Physics) -> Physics {
        if law.id == "quantisation" { law.clone().with("dither", self.noise_rms[0]) } else { law.clone() }
    }

    /// Standard errors from no effect, and the share of the effect's power that a refit hides, together with laws that
    /// this one contains: what they could do is not its own.
    pub fn effect_beside(&self, laws: &[Physics], contained: &[Physics]) -> (f64, f64) {
        let laws: Vec<Physics> = laws.iter().map(|law| self.as_seen(law)).collect();
        let laws = &laws[..];
        let change = |role: &Role, laws: &[Physics]| role.change(self.bench, laws, &self.noise_rms);
        let mut absorbing = self.absorbing.clone();
        let mut follows = self.follows.clone();
        for law in contained.chunks(1) {
            absorbing.push(change(&self.trained, law));
            follows.push(change(&self.held_out, law));
        }
        let mut left = change(&self.trained, laws);
        let whole = dot(&left, &left);
        let followed = absorbing.coefficients(&absorbing.remove_from(&mut left));
        let seen = dot(&left, &left);
        let hidden = 1.0 - seen / whole;
        if self.held_out.runs.is_empty() {
            return (seen.sqrt(), hidden);
        }
        let mut predicted = change(&self.held_out, laws);
        for (column, share) in follows.iter().zip(followed) {
            add_scaled(&mut predicted, -share, column);
        }
        self.held_out.unknown.remove_from(&mut predicted);
        (seen.min(dot(&predicted, &predicted)).sqrt(), hidden)
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
        strength_of(&at, wanted)
    }
}

/// Steps to a strength at most.
const STEPS: usize = 20;

/// The strength at which an effect that grows with it is as large as wanted; `None` where that is not found. An effect may grow as
/// slowly as its root or as steeply as steps that rise out of the noise: where a guess from its size leaves what is known
/// to lie too low and too high, the middle is taken.
fn strength_of(effect: &dyn Fn(f64) -> f64, wanted: f64) -> Option<f64> {
    let (mut strength, mut too_weak, mut too_strong) = (1.0_f64, 0.0_f64, f64::INFINITY);
    let mut seen = f64::NAN;
    for _ in 0..STEPS {
        seen = effect(strength);
        if (seen / wanted).ln().abs() < 0.1 {
            return Some(strength);
        }
        if seen.is_finite() && seen < wanted {
            too_weak = too_weak.max(strength);
        } else {
            too_strong = too_strong.min(strength);
        }
        let guess = if seen.is_finite() {
            strength * (wanted / seen.max(1e-9 * wanted)).powf(0.8).clamp(0.02, 50.0)
        } else {
            0.1 * strength
        };
        let between = too_weak > 0.0 && too_strong.is_finite() && too_weak < too_strong;
        strength = if between && !(too_weak < guess && guess < too_strong) {
            (too_weak * too_strong).sqrt()
        } else {
            guess
        };
    }
    ((seen / wanted).ln().abs() < 0.4).then_some(strength)
}

fn flat(recordings: &[Recording], noise_rms: &[f64]) -> Vec<f64> {
    let columns = recordings.iter().flat_map(|recording| recording.columns.iter().skip(1).zip(noise_rms));
    columns.flat_map(|(column, rms)| column.samples.iter().map(move |value| value / rms)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;
    use crate::truth::RESULT_RUNS;

    #[test]
    fn a_rounding_is_at_its_limit_where_its_steps_rise_out_of_the_noise() {
        let sensitivity = Sensitivity::new(Bench::MovedBase, &RESULT_RUNS[..1], &[], 45.0);
        let noise = sensitivity.noise_rms[0];
        let case = cases().into_iter().find(|case| case.id == "quantisation").unwrap();
        let fine = Physics::new("quantisation", "sensor").with("step", noise);
        assert!(sensitivity.effect(&[fine]).0 < 0.1, "steps of one standard deviation are noise");
        let strength = sensitivity.strength(&case, 5.0).unwrap();
        let steps = (case.law)(strength).parameters["step"] / noise;
        assert!((1.5..4.0).contains(&steps), "{steps} standard deviations");
    }

    #[test]
    fn a_measured_beam_has_nothing_that_absorbs_a_mass_at_its_tip() {
        let mass = Physics::new("tip_mass", "beam").with("mass", 1e-4);
        let hidden = |bench: Bench| {
            Sensitivity::new(bench, &RESULT_RUNS[..2], &[], 45.0).effect(std::slice::from_ref(&mass)).1
        };
        let (drawn, measured) = (hidden(Bench::MovedBase), hidden(Bench::MeasuredBeam));
        assert!(drawn > 0.99 && measured < 0.5, "{drawn} and {measured}");
    }

    #[test]
    fn a_strength_is_found_where_the_effect_grows_slowly_or_rises_steeply() {
        for effect in [|s: f64| s.sqrt(), |s: f64| 30.0 * (-20.0 / (s * s)).exp() * s, |s: f64| s.powi(4)] {
            let strength = strength_of(&effect, 5.0).unwrap();
            assert!((effect(strength) / 5.0).ln().abs() < 0.1);
        }
        assert_eq!(strength_of(&|s: f64| s / (1.0 + s), 5.0), None);
    }
}
