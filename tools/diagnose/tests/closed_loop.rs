//! A known controller hides friction: the loop is simulated, or friction would be named as what the feedback
//! does.

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_diagnose::{Options, Verdict, diagnose};
use stillbeam_plant::{Model, Physics, simulate};
use stillbeam_recording::Recording;

const AXIS: &str = r#"
    schema = 1
    kind = "lumped"
    [[body]]
    name = "slider"
    mass = 95.0
    [[damper]]
    between = ["slider", "ground"]
    damping = 200.0
    [input]
    column = "motor_force_N"
    body = "slider"
    gain = 1.0
    [[output]]
    column = "position_m"
    body = "slider"
    quantity = "position"
    [controller]
    kind = "cascade_pd"
    kp = 60.0
    kv = 6000.0
    sample_s = 0.005
    reference_column = "reference_m"
    limit = 400.0
"#;

/// Moves there and back, of two frequencies, as the loop records them with an encoder of a micrometre.
fn recorded(model: &Model, frequency_hz: f64, seed: u64) -> Recording {
    recorded_with(model, frequency_hz, 1e-6, seed)
}

fn recorded_with(model: &Model, frequency_hz: f64, noise_m: f64, seed: u64) -> Recording {
    let time_s: Vec<f64> = (0..2400).map(|k| 0.005 * f64::from(k)).collect();
    let swing = |t: f64| t.min(1.0) * (0.08 * (TAU * frequency_hz * t).sin() + 0.02 * (TAU * 0.9 * t).sin());
    let reference = time_s.iter().map(|t| swing(*t)).collect();
    let commanded = Recording::new(format!("run {seed}"), time_s.clone())
        .with_column("reference_m", reference)
        .with_column("motor_force_N", vec![0.0; time_s.len()]);
    let mut recording = simulate(model, &commanded).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    for column in recording.columns.iter_mut().filter(|column| column.name == "position_m") {
        for value in &mut column.samples {
            let draw: f64 = StandardNormal.sample(&mut random);
            *value += noise_m * draw;
        }
    }
    recording
}

/// What an initial state does in a loop is the loop's doing: the free response of the axis alone would be
/// there for ever. Fits that took that for it ended somewhere between the drawing and the machine, and what
/// they left was named.
#[test]
fn a_refit_in_a_loop_finds_the_machine_from_a_wrong_drawing() {
    let mut truth = Model::from_toml("axis.toml", AXIS).unwrap();
    truth.set_parameter("damper.slider-ground.damping", 600.0).unwrap();
    let mut given = truth.clone();
    given.set_parameter("body.slider.mass", 85.0).unwrap();
    given.set_parameter("damper.slider-ground.damping", 720.0).unwrap();
    let noise_m = 2e-5;
    let train = [recorded_with(&truth, 0.2, noise_m, 1), recorded_with(&truth, 0.5, noise_m, 2)];
    let held_out = [recorded_with(&truth, 0.3, noise_m, 3)];
    let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Adequate, "{}", found.sentence);
    for (path, value) in [("body.slider.mass", 95.0), ("damper.slider-ground.damping", 600.0)] {
        let refitted = found.refitted_model.parameter(path).unwrap();
        assert!((refitted / value - 1.0).abs() < 0.02, "{path}: {refitted} for {value}");
    }
    let rms = found.fit.pooled[0].fits.refitted_linear.rms;
    assert!(rms < 1.01 * noise_m, "{rms} m of {noise_m} m");
}

#[test]
fn friction_and_offset_are_named_in_a_known_loop() {
    let given = Model::from_toml("axis.toml", AXIS).unwrap();
    let mut truth = given.clone();
    truth.set_parameter("body.slider.mass", 97.0).unwrap();
    truth.setup_mut().physics = vec![
        Physics::new("coulomb_friction", "slider").with("force", 20.0),
        Physics::new("constant_force", "slider").with("force", 3.0),
    ];
    let train = [recorded(&truth, 0.2, 1), recorded(&truth, 0.35, 2)];
    let held_out = [recorded(&truth, 0.27, 3)];
    let found = diagnose(&given, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    // While it slides, friction that differs with the direction is dry friction with an offset: half the sum
    // and half the difference of its two forces.
    let force = |id: &str, name: &str| {
        let effect = found.effects.iter().find(|effect| effect.id == id);
        effect.map(|effect| (effect.parameters[name].value, effect.parameters[name].stderr))
    };
    let both =
        force("asymmetric_friction", "force_backward").zip(force("asymmetric_friction", "force_forward"));
    let apart = force("coulomb_friction", "force").zip(force("constant_force", "force"));
    let halves = |((back, e), (forth, g)): ((f64, f64), (f64, f64))| {
        ((0.5 * (back + forth), 0.5 * (e + g)), (0.5 * (back - forth), 0.5 * (e + g)))
    };
    let (dry, offset) = apart.or(both.map(halves)).unwrap_or_else(|| panic!("{}", found.sentence));
    assert_eq!(found.effects.len(), if apart.is_some() { 2 } else { 1 }, "{}", found.sentence);
    // What is the same force under another name is a tie of its own, and makes the finding no less certain.
    assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
    assert!((dry.0 - 20.0).abs() < 4.0 * dry.1, "{dry:?}");
    assert!((offset.0.abs() - 3.0).abs() < 4.0 * offset.1, "{offset:?}");
}

/// The recordings of the real axis at 200 Hz: what its builders found, and nothing else.
#[test]
fn the_real_axis_has_dry_friction_and_an_offset() {
    let data = std::env::var("STILLBEAM_DATA").map_or_else(
        |_| std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        std::path::PathBuf::from,
    );
    let Ok(text) = std::fs::read_to_string(data.join("emps/emps_estimation.csv")) else {
        println!(
            "not run: the recordings of the axis are not there; set STILLBEAM_DATA to the folder that holds them"
        );
        return;
    };
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/emps.toml");
    let model = Model::read(model).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .step_by(5)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    let part = |name: &str, rows: &[Vec<f64>]| {
        let column = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        Recording::new(name, column(0).iter().map(|t| t - rows[0][0]).collect())
            .with_column("reference_m", column(1))
            .with_column("position_m", column(2))
            .with_column("motor_force_N", column(4))
    };
    let (first, second) = rows.split_at(rows.len() / 2);
    let (train, held_out) = ([part("first half", first)], [part("second half", second)]);
    let found = diagnose(&model, &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
    let of = |id: &str| found.effects.iter().find(|effect| effect.id == id);
    let value = |id: &str, name: &str| of(id).map(|effect| effect.parameters[name].value);
    // The same force in either form: dry friction with an offset, or friction that differs with the
    // direction.
    let apart = value("coulomb_friction", "force").zip(value("constant_force", "force"));
    let both =
        value("asymmetric_friction", "force_backward").zip(value("asymmetric_friction", "force_forward"));
    let halves = both.map(|(back, forth)| (0.5 * (back + forth), 0.5 * (back - forth)));
    // Or the viscous part differs: 166.7 N s/m forwards and 240.4 backwards in the builders' own fit.
    let uneven = value("coulomb_friction", "force").zip(value("bilinear_damping", "damping"));
    if let Some((dry, forwards)) = uneven {
        let backwards =
            found.extended_model.as_ref().unwrap().parameter("damper.slider-ground.damping").unwrap();
        assert!((18.0..23.0).contains(&dry), "{}", found.sentence);
        assert!((backwards / 240.4 - 1.0).abs() < 0.05, "{backwards} N s/m backwards");
        assert!(
            ((backwards + forwards) / 166.7 - 1.0).abs() < 0.05,
            "{} N s/m forwards",
            backwards + forwards
        );
        assert!(
            found.ties.iter().any(|tie| tie.sentence.contains("asymmetric_friction")),
            "{:?}",
            found.ties
        );
    } else {
        let (dry, offset) = apart.or(halves).unwrap_or_default();
        assert!((18.0..23.0).contains(&dry), "{}", found.sentence);
        assert!((2.0..4.5).contains(&offset), "{}", found.sentence);
    }
    for wrong in ["stribeck_friction", "quadratic_drag", "force_ripple", "cogging"] {
        assert!(of(wrong).is_none(), "{wrong}: {}", found.sentence);
    }
}
