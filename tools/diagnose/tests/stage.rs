//! One body on a spring, pushed by a force: waves of any phase, what a parameter stands for, and friction
//! that may differ by direction.

use crate::truth;

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Cost, Diagnosis, Options, Verdict, diagnose};
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;
use truth::noisy;

const STAGE: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "slider"
    mass = 10.0
    [[spring]]
    between = ["slider", "ground"]
    stiffness = 1000.0
    [[damper]]
    between = ["slider", "ground"]
    damping = 8.0
    [input]
    column = "motor_force_N"
    body = "slider"
    [[output]]
    column = "slider_position_m"
    body = "slider"
    quantity = "position"
"#;

fn stage() -> Model {
    Model::from_toml("stage.toml", STAGE).unwrap()
}

/// The same with nothing that holds it.
fn free_stage() -> Model {
    let (before, after) = STAGE.split_once("[[spring]]").unwrap();
    let damper = after.split_once("[[damper]]").unwrap().1;
    Model::from_toml("stage.toml", &format!("{before}[[damper]]{damper}")).unwrap()
}

/// A force of this size whose sign changes at irregular times, another one for every seed.
fn random_force(size_n: f64, seed: u64) -> impl Fn(f64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(900 + seed);
    let mut sign = || {
        let drawn: f64 = StandardNormal.sample(&mut random);
        drawn.signum()
    };
    let signs: Vec<f64> = (0..64).map(|_| sign()).collect();
    move |t| size_n * signs[(t / 0.37) as usize % 64]
}

fn recorded(model: &Model, amplitude_n: f64, up: bool, seed: u64) -> Recording {
    recorded_beside(model, 0.0, amplitude_n, up, seed)
}

/// Twenty seconds of a sweep from 0.4 to 4 Hz, grown from nothing within a second, while a random force
/// pushes too.
fn recorded_beside(model: &Model, random_n: f64, amplitude_n: f64, up: bool, seed: u64) -> Recording {
    let pushed = random_force(random_n, seed);
    const FINER: usize = 20;
    let fine: Vec<f64> = (0..=2000 * FINER).map(|k| k as f64 / (100 * FINER) as f64).collect();
    let force = |t: &f64| {
        let swept = if up { *t } else { 20.0 - t };
        amplitude_n * t.min(1.0) * (TAU * (0.4 * swept + 0.09 * swept * swept)).sin()
    };
    let input: Vec<f64> = fine.iter().map(force).collect();
    let all = fine.iter().zip(&input).map(|(t, force)| force + pushed(*t)).collect();
    let truth = Recording::new("truth", fine).with_column("motor_force_N", all);
    let simulated = simulate(model, &truth).unwrap();
    let every = |samples: &[f64]| samples.iter().step_by(FINER).copied().collect::<Vec<f64>>();
    let clean = Recording::new(format!("{amplitude_n} N"), every(&truth.time_s))
        .with_column("motor_force_N", every(&input))
        .with_column("slider_position_m", every(simulated.column("slider_position_m").unwrap()));
    noisy(&clean, &[5e-5], 0.0, seed)
}

/// The stage as its drawing says on recordings of the stage as it is.
fn diagnosed(truth: &Model) -> Diagnosis {
    diagnosed_beside(truth, 0.0)
}

/// The same while a random force pushes too.
fn diagnosed_beside(truth: &Model, random_n: f64) -> Diagnosis {
    let recorded = |amplitude, up, seed| recorded_beside(truth, random_n, amplitude, up, seed);
    let train = [recorded(6.0, true, 1), recorded(10.0, false, 2)];
    let held_out = [recorded(8.0, true, 3)];
    let mut drawn = stage();
    for (path, factor) in [
        ("body.slider.mass", 1.03),
        ("spring.slider-ground.stiffness", 0.97),
        ("damper.slider-ground.damping", 1.04),
    ] {
        drawn.set_parameter(path, factor * drawn.parameter(path).unwrap()).unwrap();
    }
    diagnose(&drawn, &train, &held_out, &Options::default(), &mut |_| {}).unwrap()
}

fn with(law: Physics) -> Model {
    let mut truth = stage();
    truth.setup_mut().physics.push(law);
    truth
}

fn named(found: &Diagnosis) -> Vec<&str> {
    found.effects.iter().map(|effect| effect.id.as_str()).collect()
}

#[test]
fn a_wave_between_the_phases_that_are_tried_is_named() {
    for law in [
        Physics::new("cogging", "slider").with("force", 0.5).with("period", 0.011).with("phase", -2.2),
        Physics::new("periodic_disturbance", "environment")
            .with("force", 0.3)
            .with("frequency", 2.7137)
            .with("phase", 0.8),
    ] {
        let found = diagnosed(&with(law.clone()));
        assert_eq!(named(&found), [law.id.as_str()], "{:?}: {}", found.verdict, found.sentence);
        assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
        for (name, truth) in &law.parameters {
            let estimate = &found.effects[0].parameters[name];
            assert!(
                (estimate.value - truth).abs() < 4.5 * estimate.stderr,
                "{name}: {estimate:?} for {truth}"
            );
        }
    }
}

#[test]
fn a_cable_beside_the_models_own_spring_is_told_from_no_wrong_stiffness_but_said() {
    let found = diagnosed(&with(Physics::new("cable_spring", "slider").with("stiffness", 260.0)));
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.effects.is_empty() && found.extended_model.is_none());
    let tie = found.ties.first().unwrap();
    assert_eq!(tie.candidates, [vec![], vec!["cable_spring at slider".to_owned()]], "{}", tie.sentence);
    assert!(tie.sentence.contains("spring.slider-ground.stiffness 30 % larger"), "{}", tie.sentence);
    assert!(found.caps.iter().any(|cap| cap.contains("spring.slider-ground.stiffness")), "{:?}", found.caps);
}

#[test]
fn a_stiffness_that_is_off_as_drawings_are_stands_for_nothing() {
    let mut truth = stage();
    truth.set_parameter("spring.slider-ground.stiffness", 1080.0).unwrap();
    let found = diagnosed(&truth);
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.ties.is_empty() && found.caps.is_empty(), "{:?} {:?}", found.ties, found.caps);
}

#[test]
fn friction_of_which_only_the_sum_is_seen_may_differ_by_direction() {
    let both: Vec<String> =
        ["coulomb_friction at slider", "asymmetric_friction at slider"].map(str::to_owned).to_vec();
    for (forward, backward) in [(0.05, 0.02), (0.035, 0.035), (0.15, 0.4)] {
        let law = Physics::new("asymmetric_friction", "slider");
        let law = law.with("force_forward", forward).with("force_backward", backward);
        let found = diagnosed(&with(law.with("viscous_forward", 0.0).with("viscous_backward", 0.0)));
        assert_eq!(named(&found), ["coulomb_friction"], "{:?}: {}", found.verdict, found.sentence);
        let tied: Vec<String> = found.ties.iter().flat_map(|tie| tie.candidates.concat()).collect();
        assert!(both.iter().all(|name| tied.contains(name)), "{forward} and {backward} N: {tied:?}");
    }
}

#[test]
fn a_spring_that_changes_at_any_point_of_the_travel_is_named() {
    for (contact, stiffness) in [(0.008, 40.0), (-0.012, 60.0), (-0.025, 80.0)] {
        let law = Physics::new("bilinear_stiffness", "slider").with("contact", contact);
        let found = diagnosed(&with(law.with("stiffness", stiffness)));
        assert_eq!(named(&found), ["bilinear_stiffness"], "{contact} m: {}", found.sentence);
        for (name, truth) in [("contact", contact), ("stiffness", stiffness)] {
            let estimate = &found.effects[0].parameters[name];
            assert!(
                (estimate.value - truth).abs() < 4.0 * estimate.stderr,
                "{name} {estimate:?} for {truth}"
            );
        }
    }
}

#[test]
fn a_law_beside_a_random_force_is_named_alone() {
    let found =
        diagnosed_beside(&with(Physics::new("cubic_stiffness", "slider").with("stiffness", 3e4)), 0.1);
    assert_eq!(named(&found), ["cubic_stiffness"], "{:?}: {}", found.verdict, found.sentence);
}

#[test]
fn of_laws_that_are_nearly_one_beside_a_random_force_the_right_one_is_named_or_tied() {
    for (id, location, name) in [
        ("servo_lag", "drive", "time_constant"),
        ("dead_time", "drive", "delay"),
        ("delay", "sensor", "delay"),
        ("exposure_blur", "sensor", "exposure"),
    ] {
        let found = diagnosed_beside(&with(Physics::new(id, location).with(name, 0.01)), 0.1);
        let tied = found.ties.iter().flat_map(|tie| tie.candidates.concat());
        let all: Vec<String> = named(&found).iter().map(|id| (*id).to_owned()).chain(tied).collect();
        assert!(all.iter().any(|said| said.starts_with(id)), "{id}: {all:?} {}", found.sentence);
    }
}

#[test]
fn a_random_force_alone_has_no_name() {
    let found = diagnosed_beside(&stage(), 0.1);
    // It never pauses, so no recording tells how much of what is left is noise: `adequate` is right too.
    assert!(found.effects.is_empty() && found.ties.is_empty(), "{}", found.sentence);
    assert!(found.verdict != Verdict::Adequate || found.sentence.contains("not white"), "{}", found.sentence);
}

#[test]
fn a_cable_on_what_nothing_else_holds_is_named_with_where_it_pulls_to() {
    let mut truth = free_stage();
    let cable = Physics::new("cable_spring", "slider").with("stiffness", 4.0).with("rest_position", -0.08);
    truth.setup_mut().physics.push(cable);
    let train = [recorded(&truth, 6.0, true, 1), recorded(&truth, 10.0, false, 2)];
    let found =
        diagnose(&free_stage(), &train, &[recorded(&truth, 8.0, true, 3)], &Options::default(), &mut |_| {})
            .unwrap();
    assert_eq!(named(&found), ["cable_spring"], "{:?}: {}", found.verdict, found.sentence);
    for (name, truth) in [("stiffness", 4.0), ("rest_position", -0.08)] {
        let estimate = &found.effects[0].parameters[name];
        assert!((estimate.value - truth).abs() < 4.5 * estimate.stderr, "{name}: {estimate:?} for {truth}");
        assert!(estimate.stderr < 0.05 * truth.abs(), "{name}: {estimate:?}");
    }
}

#[test]
fn two_laws_of_which_neither_passes_alone_are_found_together() {
    let mut truth =
        with(Physics::new("gain_nonlinearity", "drive").with("quadratic", 4e-4).with("cubic", 0.0));
    truth.setup_mut().physics.push(Physics::new("quadratic_drag", "slider").with("drag", 6.0));
    let found = diagnosed(&truth);
    let mut names = named(&found);
    names.sort_unstable();
    assert_eq!(names, ["gain_nonlinearity", "quadratic_drag"], "{:?}: {}", found.verdict, found.sentence);
}

#[test]
fn an_answer_does_not_depend_on_the_number_of_threads() {
    let truth = with(Physics::new("cubic_stiffness", "slider").with("stiffness", 2e5));
    let answer = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| diagnosed(&truth));
        assert_eq!(named(&found), ["cubic_stiffness"], "{}", found.sentence);
        // In words, for what is not a number is not equal to itself.
        format!("{:#?}", Diagnosis { seconds: 0.0, cost: Cost::default(), overlays: Vec::new(), ..found })
    };
    let (one, three) = (answer(1), answer(3));
    let different = one.lines().zip(three.lines()).find(|(one, three)| one != three);
    assert_eq!(different, None, "with one thread and with three");
}
