//! Linear machines whose parameters are wrong, recorded as laboratories record them: nothing of them is
//! missing.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{Hold, Model};
use stillbeam_recording::Recording;

const MODEL: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "stage"
    mass = 2.2
    [[spring]]
    between = ["stage", "ground"]
    stiffness = 900.0
    [[damper]]
    between = ["stage", "ground"]
    damping = 0.5
    [input]
    column = "force_N"
    body = "stage"
    [[output]]
    column = "stage_position_m"
    body = "stage"
    quantity = "position"
"#;
/// The true frequency, damping ratio and mass, and the share of a force that a stiff mode beyond adds, m/N.
const FREQUENCY_HZ: f64 = 3.4;
const DAMPING_RATIO: f64 = 0.006;
const MASS_KG: f64 = 2.0;
const RATE_HZ: f64 = 100.0;
const DURATION_S: f64 = 24.0;

/// What a laboratory's recording has beside the machine.
#[derive(Clone, Copy, Default)]
struct Lab {
    force_noise_n: f64,
    force_step_n: f64,
    is_held: bool,
    beyond_m_per_n: f64,
}

/// A force of three sines that differ from run to run, its response by steps so fine that nothing is between
/// them, and readings.
fn run(lab: Lab, amplitude_n: f64, seed: u64) -> Recording {
    const PARTS: usize = 20;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let tones = [1.1 + 0.17 * seed as f64, 2.9 - 0.1 * seed as f64, 3.5 + 0.13 * seed as f64];
    let force = |t: f64| {
        let fade = (t / 2.0).min(1.0);
        amplitude_n * fade * fade * tones.iter().map(|hz| (TAU * hz * t + hz).sin()).sum::<f64>()
    };
    let omega = TAU * FREQUENCY_HZ;
    let step_s = 1.0 / RATE_HZ / PARTS as f64;
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let (mut time_s, mut forces, mut positions) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(DURATION_S * RATE_HZ) as usize {
        let start_s = k as f64 / RATE_HZ;
        let here = force(start_s);
        let seen = here + lab.force_noise_n * normal();
        time_s.push(start_s);
        forces.push(if lab.force_step_n > 0.0 {
            (seen / lab.force_step_n).round() * lab.force_step_n
        } else {
            seen
        });
        positions.push(x + lab.beyond_m_per_n * here + 2e-6 * normal());
        for part in 0..PARTS {
            let acts = if lab.is_held { here } else { force(start_s + (part as f64 + 0.5) * step_s) };
            let pull = |x: f64, v: f64| acts / MASS_KG - omega * omega * x - 2.0 * DAMPING_RATIO * omega * v;
            let (half_x, half_v) = (x + 0.5 * step_s * v, v + 0.5 * step_s * pull(x, v));
            (x, v) = (x + step_s * half_v, v + step_s * pull(half_x, half_v));
        }
    }
    Recording::new(format!("run {seed}"), time_s)
        .with_column("force_N", forces)
        .with_column("stage_position_m", positions)
}

fn diagnosed(lab: Lab) -> Diagnosis {
    diagnosed_with(&Model::from_toml("stage.toml", MODEL).unwrap(), lab)
}

fn diagnosed_with(model: &Model, lab: Lab) -> Diagnosis {
    let train = [run(lab, 0.4, 1), run(lab, 0.9, 2)];
    diagnose(model, &train, &[run(lab, 0.6, 3)], &Options::default(), &mut |_| {}).unwrap()
}

fn assert_nothing_is_missing(found: &Diagnosis) {
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.effects.is_empty());
    let mass = found.parameter_changes.iter().find(|change| change.path == "body.stage.mass").unwrap();
    assert!((mass.to / MASS_KG - 1.0).abs() < 0.01, "{mass:?}");
}

#[test]
fn noise_and_steps_of_a_measured_force_are_no_missing_physics() {
    let lab = Lab { force_noise_n: 0.01, force_step_n: 0.02, ..Lab::default() };
    assert_nothing_is_missing(&diagnosed(lab));
}

#[test]
fn a_force_that_is_held_is_no_lag_of_the_drive() {
    let found = diagnosed(Lab { is_held: true, ..Lab::default() });
    assert_nothing_is_missing(&found);
    assert!(found.caps.iter().any(|cap| cap.contains("held from sample to sample")), "{:?}", found.caps);
}

#[test]
fn a_force_that_the_model_says_is_held_needs_no_finding() {
    let model = Model::from_toml("stage.toml", MODEL).unwrap().with_hold(Hold::ZeroOrder);
    let found = diagnosed_with(&model, Lab { is_held: true, ..Lab::default() });
    assert_nothing_is_missing(&found);
    assert!(!found.caps.iter().any(|cap| cap.contains("held from sample to sample")), "{:?}", found.caps);
}

#[test]
fn a_stiff_mode_beyond_the_model_is_no_law() {
    let found = diagnosed(Lab { beyond_m_per_n: 2e-5, ..Lab::default() });
    assert_nothing_is_missing(&found);
    assert!(found.caps.iter().any(|cap| cap.contains("too few modes")), "{:?}", found.caps);
    let same = ["crosstalk at sensor".to_owned()];
    let is_tied =
        found.ties.iter().any(|tie| tie.candidates[0].is_empty() && tie.candidates.contains(&same.to_vec()));
    assert!(is_tied, "a share of the force in the reading does the same: {:?}", found.ties);
}

#[test]
fn an_adequate_model_says_what_may_be_overlooked() {
    let found = diagnosed(Lab::default());
    assert_nothing_is_missing(&found);
    assert!(found.excess_power_share.is_some_and(|share| share < 0.15), "{:?}", found.excess_power_share);
    let friction = found.smallest_visible.iter().find(|law| law.id == "coulomb_friction").unwrap();
    // The spring is wound up by some millimetres and 900 N/m; friction of a few thousandths of that shows.
    assert!(friction.size > 1e-6 && friction.size < 0.05 && friction.unit == "N", "{friction:?}");
}

/// The same recording without its rows between these times.
fn without_rows(recording: &Recording, gaps_s: &[(f64, f64)]) -> Recording {
    let is_kept = |t: &f64| gaps_s.iter().all(|(from, to)| !(*from..*to).contains(t));
    let kept: Vec<usize> = (0..recording.len()).filter(|&k| is_kept(&recording.time_s[k])).collect();
    let of = |samples: &[f64]| kept.iter().map(|&k| samples[k]).collect::<Vec<f64>>();
    let mut thinner = recording.clone();
    thinner.time_s = of(&recording.time_s);
    thinner.columns.iter_mut().for_each(|column| column.samples = of(&column.samples));
    thinner
}

#[test]
fn what_drove_a_machine_while_rows_are_missing_is_no_missing_physics() {
    let model = Model::from_toml("stage.toml", MODEL).unwrap();
    for gaps_s in [&[(11.0, 11.4)][..], &[(8.3, 8.5), (16.1, 16.9)]] {
        let stopped =
            |amplitude_n: f64, seed: u64| without_rows(&run(Lab::default(), amplitude_n, seed), gaps_s);
        let (train, held_out) = ([stopped(0.4, 1), stopped(0.9, 2)], [stopped(0.6, 3)]);
        let found = diagnose(&model, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
        assert_nothing_is_missing(&found);
        let said = found.set_aside.iter().filter(|line| line.contains("rows are missing")).count();
        assert_eq!(said, 3 * gaps_s.len(), "{:?}", found.set_aside);
    }
}
