//! A machine for tests of the search: one body on a spring, pushed.

use rand_distr::{Bernoulli, Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_identify::tall::dot;
use stillbeam_plant::{InitialState, Model, Physics, SimulateOptions, simulate_with};
use stillbeam_recording::{Recording, Role};

use super::scales::Scales;
use super::selection::Search;
use super::sets::Member;
use super::trials::{Candidate, all_candidates};
use crate::comparison::compare;
use crate::fit::{Fitted, Others};
use crate::options::Options;
use crate::simulation::Hypothesis;
use crate::study::Study;

const MACHINE: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "mass"
    mass = 2.0
    [[spring]]
    between = ["mass", "ground"]
    stiffness = 300.0
    [[damper]]
    between = ["mass", "ground"]
    damping = 3.0
    [input]
    column = "force_N"
    body = "mass"
    [[output]]
    column = "position_m"
    body = "mass"
"#;

pub(crate) fn machine() -> Model {
    Model::from_toml("machine.toml", MACHINE).unwrap()
}

/// A machine whose spring hardens.
pub(crate) fn hardening(mut machine: Model, stiffness: f64) -> Model {
    machine.setup_mut().physics = vec![Physics::new("cubic_stiffness", "mass").with("stiffness", stiffness)];
    machine
}

/// The same machine without an input: all that moves it is that it was let go.
pub(crate) fn unpushed() -> Model {
    let input = "    [input]\n    column = \"force_N\"\n    body = \"mass\"\n";
    Model::from_toml("unpushed.toml", &MACHINE.replace(input, "")).unwrap()
}

/// A body that a damper slows and nothing holds.
pub(crate) fn unheld() -> Model {
    let text = r#"
        schema = 1
        kind = "lumped"
        body = [{ name = "mass", mass = 2.5 }]
        damper = [{ between = ["mass", "ground"], damping = 10.0 }]
        input = { column = "force_N", body = "mass" }
        output = [{ column = "position_m", body = "mass" }]
    "#;
    Model::from_toml("unheld.toml", text).unwrap()
}

/// Runs of such a machine at these amplitudes, from 0.5 to 5 Hz, without noise.
pub(crate) fn runs(machine: &Model, amplitudes: &[f64]) -> Vec<Recording> {
    let recorded = |(k, amplitude): (usize, &f64)| driven(machine, k, &swept(*amplitude));
    amplitudes.iter().enumerate().map(recorded).collect()
}

/// The force of a run.
fn swept(amplitude: f64) -> Vec<f64> {
    let sweep = |t: f64| (std::f64::consts::TAU * (0.5 * t + 0.1125 * t * t)).sin();
    (0..2000).map(|k| amplitude * sweep(0.01 * f64::from(k))).collect()
}

fn driven(machine: &Model, number: usize, force: &[f64]) -> Recording {
    let time_s = (0..force.len()).map(|k| 0.01 * k as f64).collect();
    let commanded = Recording::new(format!("run {number}"), time_s).with_column("force_N", force.to_vec());
    // As a real machine moves: in steps much shorter than those of a fit.
    let options = SimulateOptions { longest_step_s: Some(1e-4), ..SimulateOptions::default() };
    simulate_with(machine, &commanded, &options).unwrap()
}

/// Runs in which a further force, which nobody recorded, pushes the machine one way or the other, turning at
/// random twice a second; and white noise.
pub(crate) fn shaken_runs(
    machine: &Model,
    amplitudes: &[f64],
    shaking_n: f64,
    noise_m: f64,
    seed: u64,
) -> Vec<Recording> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let noise = Normal::new(0.0, noise_m).unwrap();
    let mut run = |(k, amplitude): (usize, &f64)| {
        let force = swept(*amplitude);
        let shaking = turning(shaking_n, force.len(), &mut random);
        let both: Vec<f64> = force.iter().zip(shaking).map(|(force, push)| force + push).collect();
        let moved = driven(machine, k, &both);
        let position = moved.column("position_m").unwrap().iter();
        let read = position.map(|x| x + noise.sample(&mut random)).collect();
        Recording::new(moved.name.clone(), moved.time_s.clone())
            .with_column("force_N", force)
            .with_column("position_m", read)
    };
    amplitudes.iter().enumerate().map(&mut run).collect()
}

/// A force of this size at 100 Hz that turns at random twice a second.
pub(crate) fn turning(size: f64, samples: usize, random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let turns = Bernoulli::new(0.02).unwrap();
    let mut push = size;
    let mut next = || {
        push *= if turns.sample(random) { -1.0 } else { 1.0 };
        push
    };
    (0..samples).map(|_| next()).collect()
}

/// The same with white noise of this size.
pub(crate) fn noisy_runs(machine: &Model, amplitudes: &[f64], noise_m: f64) -> Vec<Recording> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let noise = Normal::new(0.0, noise_m).unwrap();
    let noisy = |recording: Recording| {
        let position = recording.column("position_m").unwrap().iter();
        let read = position.map(|x| x + noise.sample(&mut random)).collect();
        let force = recording.column("force_N").unwrap().to_vec();
        Recording::new(recording.name, recording.time_s)
            .with_column("force_N", force)
            .with_column("position_m", read)
    };
    runs(machine, amplitudes).into_iter().map(noisy).collect()
}

/// The same with readings rounded to multiples of a step.
pub(crate) fn rounded_runs(machine: &Model, amplitudes: &[f64], noise_m: f64, step_m: f64) -> Vec<Recording> {
    let round = |recording: Recording| {
        let position = recording.column("position_m").unwrap().iter();
        let read = position.map(|x| (x / step_m).round() * step_m).collect();
        let force = recording.column("force_N").unwrap().to_vec();
        Recording::new(recording.name, recording.time_s)
            .with_column("force_N", force)
            .with_column("position_m", read)
    };
    noisy_runs(machine, amplitudes, noise_m).into_iter().map(round).collect()
}

/// Such a machine let go this far from where it rests, 20 s at 100 Hz, nothing pushing it; and white noise.
pub(crate) fn let_go(machine: &Model, from_m: &[f64], noise_m: f64) -> Vec<Recording> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let noise = Normal::new(0.0, noise_m).unwrap();
    let mut decay = |from_m: &f64| {
        let mut held = machine.clone();
        let state = InitialState { displacement: *from_m, velocity: 0.0 };
        held.setup_mut().initial.insert("mass".to_owned(), state);
        let moved = driven(&held, 0, &[0.0; 2000]);
        let position = moved.column("position_m").unwrap().iter();
        let read = position.map(|x| x + noise.sample(&mut random)).collect();
        Recording::new(format!("from {from_m} m"), moved.time_s).with_column("position_m", read)
    };
    from_m.iter().map(&mut decay).collect()
}

/// A fit of one law on top of a set, begun from this one.
pub(crate) fn fitted_with(search: &Search<'_>, base: &Member, law: &Physics) -> Member {
    let is_it = |c: &Candidate| c.law.id() == law.id && c.location == law.location;
    let candidate = search.candidates.iter().position(is_it).unwrap();
    let names = search.candidates[candidate].amplitude_names();
    let number = base.laws.len() + 1;
    let begun = search.extended(base, candidate, law, number, &names, Others::Searched).unwrap();
    search.finished(search.member([&base.laws[..], &[candidate]].concat(), begun).unwrap())
}

/// The same set as a fit would have it that stopped elsewhere: every value times a factor, by its path.
pub(crate) fn stopped_at(search: &Search<'_>, set: &Member, factor: impl Fn(&str) -> f64) -> Member {
    let fitted = &set.fitted;
    let values = fitted.free.iter().zip(&fitted.values);
    let values: Vec<f64> = values.map(|(free, value)| factor(&free.path) * value).collect();
    let hypothesis = fitted.hypothesis.with_values(&fitted.free, &values).unwrap();
    let stack = search.study.stack(Role::Train);
    let records = stack.evaluate(&hypothesis, &fitted.initial_states()).unwrap();
    let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
    let stopped = Fitted { hypothesis, values, records, sum_of_squares, ..fitted.clone() };
    search.member(set.laws.clone(), stopped).unwrap()
}

/// A search around the machine, beside the refit to what was recorded of another one; and that refit.
pub(crate) fn searched<T>(
    recorded: &[Recording],
    held_out: &[Recording],
    look: impl FnOnce(&mut Search<'_>, Member) -> T,
) -> T {
    searched_around(&machine(), recorded, held_out, look)
}

/// The same around another machine.
pub(crate) fn searched_around<T>(
    given: &Model,
    recorded: &[Recording],
    held_out: &[Recording],
    look: impl FnOnce(&mut Search<'_>, Member) -> T,
) -> T {
    let mut study = Study::new(given, recorded, held_out).unwrap();
    let compared = compare(&mut study, &Hypothesis::given(given)).unwrap();
    let options = Options::default();
    let starts = compared.refitted.initial_states();
    let scales = Scales::new(&compared.refitted.hypothesis, &study.train, &starts).unwrap();
    let candidates = all_candidates(&compared.refitted.hypothesis, &scales, &study.train, &[], &[]);
    let mut search = Search {
        given_laws: 0,
        given,
        candidates: &candidates,
        options: &options,
        floors: compared.floors.clone(),
        weighed_again: false,
        in_pieces: false,
        rounds: std::sync::Mutex::default(),
        held_out_starts: Vec::new(),
        study: &mut study,
    };
    let refitted = search.member(Vec::new(), compared.refitted).unwrap();
    look(&mut search, refitted)
}

/// The same beside runs of a machine whose spring hardens, and that law.
pub(crate) fn searched_beside_a_hardening_spring<T>(
    look: impl FnOnce(&mut Search<'_>, Member, &Physics) -> T,
) -> T {
    let spring = Physics::new("cubic_stiffness", "mass").with("stiffness", 3e4);
    let noisy = |amplitudes: &[f64]| noisy_runs(&hardening(machine(), 3e4), amplitudes, 1e-5);
    searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| look(search, refitted, &spring))
}
