//! How strong a law has to be to be seen: its effect in standard errors once the machine's own parameters are
//! refitted.

use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::{InitialState, Physics, StateSpace};
use stillbeam_recording::Recording;

use crate::cases::Case;
use crate::truth::{Bench, Run};

/// Runs of one role without noise, and what nobody knows of each: offsets of its outputs, and how the machine
/// was moving when it began.
struct Role {
    runs: Vec<Run>,
    clean: Vec<Recording>,
    unknown: Orthonormal,
}

/// A change of all recordings, in standard deviations of the noise.
struct Change {
    trained: Vec<f64>,
    held_out: Vec<f64>,
}

impl Change {
    /// `factor` times what this change has more than another one.
    fn beyond(self, other: &Self, factor: f64) -> Self {
        let scaled = |left: Vec<f64>, right: &[f64]| -> Vec<f64> {
            difference(left, right).into_iter().map(|value| factor * value).collect()
        };
        Self {
            trained: scaled(self.trained, &other.trained),
            held_out: scaled(self.held_out, &other.held_out),
        }
    }
}

/// Standard errors at which a law is at its detection limit, and below which two sets of laws are the same
/// for the recordings.
pub const LIMIT: f64 = 5.0;

/// What a machine would record without noise, and what a refit of its parameters could change.
pub struct Sensitivity {
    pub bench: Bench,
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

/// Metres or metres per second, so small that everything stays linear and so large that rounding does not
/// show.
const STATE: f64 = 1e-3;

/// Share of a law's parameter that it is moved by to see what it changes.
const SHARE: f64 = 1e-3;

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
    /// `snr_db` is the power of the outputs over that of the noise, over the runs that are trained on. A law
    /// is seen as well as on the training runs or on those held out, whichever show it less: what only the
    /// former show nobody can confirm.
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

    /// A law as the sensors see it. Noise before a rounding blurs its steps: all that is seen of them is the
    /// mean over the noise, and of steps below the noise nothing but a little more noise.
    pub fn as_seen(&self, law: &Physics) -> Physics {
        if law.id == "quantisation" { law.clone().with("dither", self.noise_rms[0]) } else { law.clone() }
    }

    /// The change that laws make, as the sensors see them.
    fn change(&self, laws: &[Physics]) -> Change {
        let laws: Vec<Physics> = laws.iter().map(|law| self.as_seen(law)).collect();
        let of = |role: &Role| role.change(self.bench, &laws, &self.noise_rms);
        Change { trained: of(&self.trained), held_out: of(&self.held_out) }
    }

    /// The changes that the parameters of laws make, per share of their values.
    fn slopes(&self, laws: &[Physics]) -> Vec<Change> {
        let mut slopes = Vec::new();
        for (place, law) in laws.iter().enumerate() {
            for (name, value) in law.parameters.iter().filter(|(_, value)| **value != 0.0) {
                let moved = |factor: f64| {
                    let mut moved = laws.to_vec();
                    moved[place].parameters.insert(name.clone(), factor * value);
                    self.change(&moved)
                };
                slopes.push(moved(1.0 + SHARE).beyond(&moved(1.0 - SHARE), 0.5 / SHARE));
            }
        }
        slopes
    }

    /// Standard errors of what is left of a change, and the share of its power that is hidden, once a refit
    /// and multiples of `beside` have followed it on the training runs.
    fn left(&self, change: Change, beside: Vec<Change>) -> (f64, f64) {
        let mut absorbing = self.absorbing.clone();
        let mut follows = self.follows.clone();
        for column in beside {
            absorbing.push(column.trained);
            follows.push(column.held_out);
        }
        let mut left = change.trained;
        let whole = dot(&left, &left);
        let followed = absorbing.coefficients(&absorbing.remove_from(&mut left));
        let seen = dot(&left, &left);
        let hidden = 1.0 - seen / whole;
        if self.held_out.runs.is_empty() {
            return (seen.sqrt(), hidden);
        }
        let mut predicted = change.held_out;
        for (column, share) in follows.iter().zip(followed) {
            add_scaled(&mut predicted, -share, column);
        }
        self.held_out.unknown.remove_from(&mut predicted);
        (seen.min(dot(&predicted, &predicted)).sqrt(), hidden)
    }

    /// Standard errors from no effect, and the share of the effect's power that a refit hides, together with
    /// laws that this one contains: what they could do is not its own.
    pub fn effect_beside(&self, laws: &[Physics], contained: &[Physics]) -> (f64, f64) {
        self.left(self.change(laws), contained.chunks(1).map(|law| self.change(law)).collect())
    }

    /// Standard errors between what two sets of laws make, once a refit of the machine and of the others'
    /// parameters, along straight lines, has brought them together.
    pub fn distance(&self, laws: &[Physics], others: &[Physics]) -> f64 {
        self.left(self.change(laws).beyond(&self.change(others), 1.0), self.slopes(others)).0
    }

    /// Whether the recordings cannot tell one set of laws from another.
    pub fn are_twins(&self, laws: &[Physics], others: &[Physics]) -> bool {
        self.distance(laws, others) < LIMIT
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

/// The strength at which an effect that grows with it is as large as wanted; `None` where that is not found.
/// An effect may grow as slowly as its root or as steeply as steps that rise out of the noise: where a guess
/// from its size leaves what is known to lie too low and too high, the middle is taken.
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
    use crate::cases::{cases, twins};
    use crate::truth::{RESULT_RUNS, RESULT_TRAINED};

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
    fn a_blur_twice_as_long_as_a_delay_is_told_from_it_only_where_both_are_long() {
        let (trained, held_out) = RESULT_RUNS.split_at(RESULT_TRAINED);
        let sensitivity = Sensitivity::new(Bench::MovedBase, trained, held_out, 45.0);
        let delay = |seconds: f64| [Physics::new("delay", "sensor").with("delay", seconds)];
        let distance =
            |late: f64| sensitivity.distance(&delay(late), &twins(Bench::MovedBase, &delay(late)[0])[0]);
        let (short, long) = (distance(0.45e-3), distance(20e-3));
        assert!(short < LIMIT && long > LIMIT, "{short} and {long} standard errors");
    }

    #[test]
    fn a_soft_clamp_is_told_from_a_mass_at_the_tip_only_where_both_are_large() {
        let (trained, held_out) = RESULT_RUNS.split_at(RESULT_TRAINED);
        let sensitivity = Sensitivity::new(Bench::MeasuredBeam, trained, held_out, 45.0);
        let distance = |kilograms: f64| {
            let mass = Physics::new("tip_mass", "beam").with("mass", kilograms);
            let twin = &twins(Bench::MeasuredBeam, &mass)[0];
            sensitivity.distance(std::slice::from_ref(&mass), twin)
        };
        let (small, large) = (distance(1e-5), distance(1e-4));
        assert!(small < LIMIT && large > LIMIT, "{small} and {large} standard errors");
    }

    #[test]
    fn sensors_that_are_all_late_are_a_late_drive() {
        let sensitivity = Sensitivity::new(Bench::ForcedBase, &RESULT_RUNS[..1], &[], 45.0);
        let law = Physics::new("dead_time", "drive").with("delay", 3e-3);
        let late = &twins(Bench::ForcedBase, &law)[1];
        assert_eq!(late.len(), 2, "one delay for each sensor");
        let whole = std::slice::from_ref(&law);
        let (distance, alone) = (sensitivity.distance(whole, late), sensitivity.distance(whole, &late[..1]));
        assert!(distance < 0.5 && alone > 10.0 * LIMIT, "{distance} and {alone} standard errors");
    }

    #[test]
    fn friction_that_differs_by_direction_is_even_friction_with_a_constant_force() {
        let sensitivity = Sensitivity::new(Bench::ForcedBase, &RESULT_RUNS[..1], &[], 45.0);
        let law = Physics::new("asymmetric_friction", "base")
            .with("force_forward", 0.4)
            .with("force_backward", 0.2);
        let mut pair = twins(Bench::ForcedBase, &law).remove(0);
        let change = |laws: &[Physics]| sensitivity.change(laws);
        let apart = |pair: &[Physics]| {
            let apart = change(std::slice::from_ref(&law)).beyond(&change(pair), 1.0).trained;
            dot(&apart, &apart).sqrt()
        };
        let same = apart(&pair);
        assert!(same < 1e-3, "{same} standard errors");
        let force = pair[1].parameters["force"];
        pair[1].parameters.insert("force".to_owned(), -force);
        assert!(apart(&pair) > 100.0, "the other sign is another force");
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
