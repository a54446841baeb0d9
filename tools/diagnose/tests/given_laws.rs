//! Laws that the given model already has are its own: what is wrong with their numbers is a wrong parameter,
//! not missing physics.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Options, Verdict, diagnose};
use stillbeam_plant::{Model, simulate};
use stillbeam_recording::Recording;

const CARRIAGE: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "carriage"
    mass = 2.0
    [[spring]]
    between = ["carriage", "ground"]
    stiffness = 300.0
    [[damper]]
    between = ["carriage", "ground"]
    damping = 3.0
    [input]
    column = "force_N"
    body = "carriage"
    [[output]]
    column = "position_m"
    body = "carriage"
    [[physics]]
    id = "coulomb_friction"
    location = "carriage"
    parameters = { force = 1.0 }
"#;

fn recorded(model: &Model, amplitude: f64, frequency_hz: f64, seed: u64) -> Recording {
    let time_s: Vec<f64> = (0..20_000).map(|k| 0.001 * f64::from(k)).collect();
    let force = time_s.iter().map(|t| {
        amplitude * ((std::f64::consts::TAU * frequency_hz * t).sin() + (2.9 * t * (1.0 + 0.2 * t)).sin())
    });
    let driven =
        Recording::new(format!("run {seed}"), time_s.clone()).with_column("force_N", force.collect());
    let fine = simulate(model, &driven).unwrap();
    let every_tenth = |samples: &[f64]| samples.iter().step_by(10).copied().collect::<Vec<f64>>();
    let mut recording = Recording::new(format!("run {seed}"), every_tenth(&fine.time_s));
    for column in &fine.columns {
        recording = recording.with_column(&column.name, every_tenth(&column.samples));
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for column in recording.columns.iter_mut().filter(|column| column.name == "position_m") {
        for value in &mut column.samples {
            let draw: f64 = StandardNormal.sample(&mut random);
            *value += 1e-5 * draw;
        }
    }
    recording
}

#[test]
fn a_law_given_with_a_wrong_size_is_a_wrong_parameter() {
    let given = Model::from_toml("carriage.toml", CARRIAGE).unwrap();
    let mut truth = given.clone();
    truth.set_parameter("physics.1.force", 1.6).unwrap();
    truth.set_parameter("body.carriage.mass", 2.05).unwrap();
    let train = [recorded(&truth, 6.0, 1.1, 1), recorded(&truth, 12.0, 1.4, 2)];
    let held_out = [recorded(&truth, 9.0, 1.3, 3)];
    let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    let change = found.parameter_changes.iter().find(|change| change.path == "physics.1.force").unwrap();
    assert!((change.to - 1.6).abs() < 4.0 * change.stderr, "{} ± {}", change.to, change.stderr);
    assert!(change.stderr < 0.02, "{}", change.stderr);
    let refitted = found.refitted_model.setup().physics[0].parameters["force"];
    assert!((refitted - change.to).abs() < 1e-12);
}

#[test]
fn the_machine_without_what_was_found_keeps_what_was_given() {
    let given = Model::from_toml("carriage.toml", CARRIAGE).unwrap();
    let mut truth = given.clone();
    let hardening =
        "[[physics]]\nid = \"cubic_stiffness\"\nlocation = \"carriage\"\nparameters = { stiffness = 1e3 }\n";
    truth.setup_mut().physics.extend(
        Model::from_toml("truth.toml", &format!("{CARRIAGE}{hardening}")).unwrap().setup().physics[1..]
            .to_vec(),
    );
    let runs = [(6.0, 1.1, 1), (12.0, 1.4, 2), (9.0, 1.3, 3)];
    let recorded_of = |model: &Model| runs.map(|(amplitude, hz, seed)| recorded(model, amplitude, hz, seed));
    let [one, two, three] = recorded_of(&truth);
    let found = diagnose(&given, &[one, two], &[three], &Options::default(), &mut |_| {}).unwrap();
    let named: Vec<&str> = found.effects.iter().map(|effect| effect.id.as_str()).collect();
    assert_eq!(named, ["cubic_stiffness"], "{}", found.sentence);
    for bare in recorded_of(&given) {
        let overlay = found.overlays.iter().find(|overlay| overlay.recording == bare.name).unwrap();
        let without = overlay.without_effects.as_ref().expect("it can be simulated");
        let expected = bare.column("position_m").unwrap();
        let rms = |values: &mut dyn Iterator<Item = f64>| -> f64 {
            let squares: Vec<f64> = values.map(|value| value * value).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let apart = rms(&mut expected.iter().zip(without).map(|(expected, without)| expected - without));
        let change = rms(&mut overlay.recorded.iter().zip(expected).map(|(with, expected)| with - expected));
        assert!(apart < 1.2e-5 && change > 1e-3, "{}: {apart} of {change}", bare.name);
    }
}

/// Two bodies with a spring between them that hardens to ten times its stiffness.
const HARDENING_PAIR: &str = r#"
    schema = 1
    kind = "lumped"
    body = [{ name = "base", mass = 2.0 }, { name = "tip", mass = 0.5 }]
    spring = [
        { between = ["ground", "base"], stiffness = 400.0 },
        { between = ["base", "tip"], stiffness = 900.0 },
    ]
    damper = [
        { between = ["ground", "base"], damping = 3.0 },
        { between = ["base", "tip"], damping = 0.6 },
    ]
    input = { column = "force_N", body = "base", hold = "first" }
    output = [{ column = "base_m", body = "base" }, { column = "tip_m", body = "tip" }]
    [[physics]]
    id = "cubic_stiffness"
    location = "base-tip"
    parameters = { stiffness = 4e6 }
"#;

fn swept(model: &Model, amplitude: f64, until_hz: f64, seed: u64) -> Recording {
    let time_s: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
    let rate_hz_s = (until_hz - 0.5) / 40.0;
    let force = |t: f64| amplitude * t.min(1.0) * (std::f64::consts::TAU * (0.5 + rate_hz_s * t) * t).sin();
    let samples = time_s.iter().map(|t| force(*t)).collect();
    let driven = Recording::new(format!("run {seed}"), time_s).with_column("force_N", samples);
    let mut recording = simulate(model, &driven).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for column in recording.columns.iter_mut().filter(|column| column.name != "force_N") {
        for value in &mut column.samples {
            let draw: f64 = StandardNormal.sample(&mut random);
            *value += 3e-6 * draw;
        }
    }
    recording
}

#[test]
fn what_steps_get_wrong_of_a_strong_law_is_no_further_law_however_quiet_the_sensor() {
    let model = Model::from_toml("pair.toml", HARDENING_PAIR).unwrap();
    let train = [swept(&model, 60.0, 9.0, 1), swept(&model, 40.0, 7.0, 2)];
    let held_out = [swept(&model, 50.0, 8.0, 3)];
    let found = diagnose(&model, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    assert!(found.effects.is_empty(), "{}", found.sentence);
}
