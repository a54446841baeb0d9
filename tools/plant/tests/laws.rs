//! Every law of the catalogue: no effect at zero, no energy out of nothing, and its fingerprint in closed
//! form.

use crate::support;

use std::f64::consts::{PI, TAU};

use stillbeam_plant::catalogue::{candidates, laws, parameters_of};
use stillbeam_plant::{Input, Model, Physics, ServoDrive, SimulateOptions, simulate, simulate_with};
use stillbeam_recording::Recording;

use support::model_texts::{LUMPED, MODAL, with};
use support::oscillator::{energy, free, oscillator, run, upward_crossings_s};
use support::{paper_beam, peak, smooth_move, ticks, worst};

/// Models that between them have every kind of place.
fn models() -> Vec<Model> {
    let mut forced = paper_beam();
    forced.input = Some(Input::new("force_N"));
    let mut served = paper_beam();
    served.drive = Some(ServoDrive { bandwidth_hz: 15.0, damping_ratio: 0.7 });
    let modal = with(MODAL, "quantity = \"velocity\"", "");
    let modal_served = with(&modal, "base_position_m", "setpoint_m")
        .replace("[input]", "[drive]\nbandwidth_hz = 20\n[input]");
    let pulled = with(LUMPED, "body = \"motor\"\ngain = 2.0", "body = \"motor\"\nquantity = \"position\"");
    let mut all = vec![Model::BeamOnBase(forced), Model::BeamOnBase(served), Model::BeamOnBase(paper_beam())];
    let turning = LUMPED.replace("_m\"", "_rad\"");
    let forced_modes = with(&modal, "base_position_m", "force_N");
    for text in [&modal, &modal_served, &forced_modes, LUMPED, &pulled, &turning] {
        all.push(Model::from_toml("m", text).unwrap());
    }
    all
}

fn recording_for(model: &Model) -> Recording {
    let time_s = ticks(150, 100.0);
    let smooth = smooth_move(&time_s, 0.8);
    let samples = smooth.iter().zip(&time_s).map(|(s, t)| s + 0.06 * (9.0 * t).sin());
    let samples = samples.collect();
    Recording::new("r", time_s).with_column(model.input().unwrap().column.clone(), samples)
}

#[test]
fn every_law_sits_somewhere_and_does_nothing_by_default() {
    let mut seen = std::collections::BTreeSet::new();
    for model in models() {
        let recording = recording_for(&model);
        let linear = simulate(&model, &recording).unwrap();
        let names = model.locations();
        for candidate in candidates(&model) {
            let location = &names[candidate.location];
            seen.insert((candidate.law.id(), format!("{:?}", candidate.law.places()[0])));
            let mut extended = model.clone();
            extended.setup_mut().physics.push(Physics::new(candidate.law.id(), location.as_str()));
            let result =
                simulate(&extended, &recording).unwrap_or_else(|error| panic!("{candidate:?}: {error}"));
            for column in model.output_columns() {
                let (found, expected) = (result.column(&column).unwrap(), linear.column(&column).unwrap());
                let error = worst(found, expected);
                let id = candidate.law.id();
                // A play behind a servo gets the servo's motion as a polygon of the sub-steps.
                let polygon = if id == "backlash" && model.parameter("drive.bandwidth_hz").is_some() {
                    1e-5
                } else {
                    0.0
                };
                assert!(
                    error <= (2e-11 + polygon) * peak(expected),
                    "{id} at {location} in {column}: {error:e} of {:e}",
                    peak(expected)
                );
            }
        }
    }
    assert_eq!(seen.len(), laws().len(), "{seen:?}");
}

#[test]
fn every_law_and_parameter_is_in_the_documentation() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/models.md");
    let text = std::fs::read_to_string(path).unwrap();
    for law in laws() {
        let line = text.lines().find(|line| {
            let place = format!("{:?}", law.places()[0]).to_lowercase();
            line.contains(&format!("`{}`", law.id())) && line.contains(&place)
        });
        let line = line.unwrap_or_else(|| panic!("{} at {:?}", law.id(), law.places()));
        for spec in law.parameters() {
            assert!(line.contains(&format!("`{}`", spec.name)), "{} {}", law.id(), spec.name);
        }
    }
}

#[test]
fn every_parameter_has_an_effect_and_a_unit() {
    for model in models() {
        let recording = recording_for(&model);
        let linear = simulate(&model, &recording).unwrap();
        let names = model.locations();
        for candidate in candidates(&model) {
            let (id, location) = (candidate.law.id(), names[candidate.location].as_str());
            for (spec, unit) in parameters_of(&model, candidate.law, location) {
                assert!(!unit.contains('{'), "{id} {}: {unit}", spec.name);
                assert!(spec.lower <= spec.default && spec.default <= spec.upper, "{id} {}", spec.name);
            }
            let mut extended = model.clone();
            let mut physics = Physics::new(id, location);
            // Sizes that show in this small motion, whatever the unit; thresholds and periods to match.
            for spec in candidate.law.parameters() {
                let value = match spec.name {
                    "limit" => 1e-4,
                    "threshold" => 0.003,
                    "distance" => 1e-6,
                    "contact" => -1e-6,
                    "delay" | "time_constant" | "exposure" => 0.013,
                    "gap" => 0.002,
                    "rate" | "skew" => 0.005,
                    "damping_ratio" => continue,
                    "frequency" => 3.0,
                    "period" => 0.03,
                    "share" | "participation" | "ripple" => 0.5,
                    "compliance" | "mass" => 0.01,
                    "step" => 1e-3,
                    "dither" => 2e-4,
                    "phase" | "rest_position" => 0.0011,
                    "velocity" => 0.01,
                    "beta" | "gamma" => 50.0,
                    "stiffness" if id == "cubic_stiffness" => 1e7,
                    "stiffness" if id == "quadratic_stiffness" && location.starts_with("mode") => 30.0,
                    "stiffness" if id == "quadratic_stiffness" => 1.0,
                    "stiffness" if id == "pendulum" => -1e4,
                    "drag" => 100.0,
                    "damping" if id == "amplitude_damping" => 1e5,
                    _ => 2.0,
                };
                physics = physics.with(spec.name, value);
            }
            extended.setup_mut().physics.push(physics);
            let result =
                simulate(&extended, &recording).unwrap_or_else(|error| panic!("{id} at {location}: {error}"));
            let effects = model.output_columns().into_iter().map(|column| {
                let (found, expected) = (result.column(&column).unwrap(), linear.column(&column).unwrap());
                assert!(found.iter().all(|value| value.is_finite()), "{id} at {location}");
                let never_negative = id == "rectification" && expected.iter().all(|y| *y >= 0.0);
                never_negative || worst(found, expected) > 1e-9 * peak(expected)
            });
            assert!(effects.collect::<Vec<_>>().contains(&true), "{id} at {location} does nothing");
        }
    }
}

#[test]
fn dissipative_laws_never_add_energy() {
    for law in laws().iter().filter(|law| law.is_dissipative()) {
        for (scale, rate_hz) in [(0.3, 100.0), (3.0, 100.0), (30.0, 1000.0)] {
            let mut physics = Physics::new(law.id(), "body");
            for spec in law.parameters() {
                let value = match spec.name {
                    "velocity" => 0.02,
                    "beta" => 200.0,
                    "gamma" => -60.0,
                    "static_force" | "force_backward" => 1.5 * scale,
                    _ => scale,
                };
                physics = physics.with(spec.name, value);
            }
            let model = oscillator(1.0, 40.0, 0.0, vec![physics], 0.1, -0.3);
            let result = free(&model, 2000, rate_hz);
            let energies = energy(&result, 1.0, 40.0);
            let start = energies[0];
            for (index, now) in energies.iter().enumerate() {
                assert!(*now <= start * (1.0 + 1e-9), "{} {scale}: {now} of {start} at {index}", law.id());
            }
            assert!(energies[1999] < 0.999 * start, "{} {scale}", law.id());
        }
    }
}

#[test]
fn conservative_laws_keep_their_energy_at_any_step() {
    type Potential = fn(f64) -> f64;
    let cases: [(Physics, Potential); 5] = [
        (Physics::new("cubic_stiffness", "body").with("stiffness", 4000.0), |z| 1000.0 * z.powi(4)),
        (Physics::new("quadratic_stiffness", "body").with("stiffness", 100.0), |z| 100.0 / 3.0 * z.powi(3)),
        (Physics::new("end_stop", "body").with("distance", 0.05).with("stiffness", 2e4), |z| {
            1e4 * (z.abs() - 0.05).max(0.0).powi(2)
        }),
        (Physics::new("bilinear_stiffness", "body").with("stiffness", 60.0).with("contact", 0.01), |z| {
            30.0 * (z - 0.01).max(0.0).powi(2)
        }),
        (Physics::new("cogging", "body").with("force", 2.0).with("period", 0.03).with("phase", 0.4), |z| {
            -2.0 * 0.03 / TAU * (TAU * z / 0.03 + 0.4).cos()
        }),
    ];
    for (physics, potential) in cases {
        let id = physics.id.clone();
        let model = oscillator(1.0, 40.0, 0.0, vec![physics], 0.1, 0.2);
        let result = free(&model, 5000, 100.0);
        let z = result.column("z_m").unwrap();
        let total = energy(&result, 1.0, 40.0);
        let total: Vec<f64> = total.iter().zip(z).map(|(energy, z)| energy + potential(*z)).collect();
        for (index, now) in total.iter().enumerate() {
            assert!((now / total[0] - 1.0).abs() < 1e-9, "{id} at {index}: {now} of {}", total[0]);
        }
    }
}

/// A mass on a spring with dry friction loses 4 Fc/k of its amplitude per cycle, and stops inside the dead
/// band.
#[test]
fn dry_friction_takes_the_same_amplitude_from_every_cycle() {
    let (k, force) = (40.0_f64, 0.21);
    let model = oscillator(
        1.0,
        k,
        0.0,
        vec![Physics::new("coulomb_friction", "body").with("force", force)],
        0.1,
        0.0,
    );
    let result = free(&model, 4000, 500.0);
    let z = result.column("z_m").unwrap();
    let period = TAU / k.sqrt();
    for cycle in 0..4 {
        let at = (f64::from(cycle) * period * 500.0).round() as usize;
        let top = z[at.saturating_sub(3)..at + 4].iter().copied().fold(0.0, f64::max);
        let expected = 0.1 - 4.0 * force / k * f64::from(cycle);
        assert!((top - expected).abs() < 1e-5, "cycle {cycle}: {top} {expected}");
    }
    // 0.1 - 0.0105 (n half cycles): it stops at the first turn inside ±Fc/k = ±0.00525.
    let rest = *z.last().unwrap();
    assert!(rest.abs() <= force / k + 1e-9, "{rest}");
    let v = result.column("v_m_s").unwrap();
    assert!(v[3000..].iter().all(|v| v.abs() < 1e-15), "it stands still, exactly");
}

#[test]
fn friction_holds_exactly_what_it_can_hold() {
    for (id, parameter) in [("coulomb_friction", "force"), ("stribeck_friction", "static_force")] {
        let model = oscillator(1.0, 0.0, 0.0, vec![Physics::new(id, "body").with(parameter, 1.0)], 0.0, 0.0);
        let time_s = ticks(2000, 200.0);
        let constant = run(&model, &time_s, |_| 0.999_999);
        assert!(constant.column("z_m").unwrap().iter().all(|z| *z == 0.0), "{id}");
        let swinging = run(&model, &time_s, |t| 0.99 * (7.0 * t).sin());
        let drift = peak(swinging.column("z_m").unwrap());
        // Within a sub-step the force is a constant and the load a line: h³ F' / 12 m per step, which adds up
        // to h² F / 12 m with h = 2 ms, and comes back.
        assert!(drift < 4e-6 * 0.99 / 12.0, "{id}: {drift:e}");
        let beyond = run(&model, &time_s, |_| 1.5);
        let expected = if id == "coulomb_friction" { 0.25 * 9.995_f64.powi(2) } else { 0.0 };
        let moved = beyond.column("z_m").unwrap()[1999];
        assert!(
            if expected > 0.0 { (moved / expected - 1.0).abs() < 1e-9 } else { moved > 30.0 },
            "{id}: {moved}"
        );
    }
}

/// Two bodies dragged one by the other: each friction holds or slides on its own.
#[test]
fn several_frictions_find_their_balance_together() {
    let text = with(LUMPED, "parameters = { force = 0.0 }", "parameters = { force = 0.3 }")
        + "[[physics]]\nid = \"coulomb_friction\"\nlocation = \"motor\"\nparameters = { force = 1.0 }\n\
           [[physics]]\nid = \"coulomb_friction\"\nlocation = \"motor-load\"\nparameters = { force = 0.2 }\n";
    let model = Model::from_toml("m", &text).unwrap();
    let time_s = ticks(1000, 200.0);
    let held = run_column(&model, &time_s, |_| 0.49);
    assert!(
        peak(held.column("load_position_m").unwrap()) < 1e-15,
        "0.98 N is held by the motor's friction alone"
    );
    let moved = run_column(&model, &time_s, |t| 3.0 * (2.0 * t).sin());
    let fine = {
        let options = SimulateOptions { longest_step_s: Some(2e-5), ..SimulateOptions::default() };
        simulate_with(&model, &record(&model, &time_s, |t| 3.0 * (2.0 * t).sin()), &options).unwrap()
    };
    for column in ["motor_position_m", "load_position_m"] {
        let (a, b) = (moved.column(column).unwrap(), fine.column(column).unwrap());
        assert!(worst(a, b) < 2e-4 * peak(b), "{column}: {:e} of {:e}", worst(a, b), peak(b));
    }
}

fn record(model: &Model, time_s: &[f64], input: impl Fn(f64) -> f64) -> Recording {
    let samples = time_s.iter().map(|t| input(*t)).collect();
    Recording::new("r", time_s.to_vec()).with_column(model.input().unwrap().column.clone(), samples)
}

fn run_column(model: &Model, time_s: &[f64], input: impl Fn(f64) -> f64) -> Recording {
    simulate(model, &record(model, time_s, input)).unwrap()
}

#[test]
fn a_cubic_spring_bends_the_backbone() {
    for k3 in [2000.0, -800.0] {
        let k = 100.0_f64;
        for amplitude in [0.01, 0.02, 0.04] {
            let law = Physics::new("cubic_stiffness", "body").with("stiffness", k3);
            let model = oscillator(1.0, k, 0.0, vec![law], amplitude, 0.0);
            let result = free(&model, 8000, 400.0);
            let crossings = upward_crossings_s(&result);
            let period = (crossings.last().unwrap() - crossings[0]) / (crossings.len() - 1) as f64;
            let omega = k.sqrt();
            let shift = TAU / period - omega;
            let expected = 3.0 * k3 * amplitude * amplitude / (8.0 * omega);
            // The next order is (k3 A²/k)² of it.
            let next = (k3 * amplitude * amplitude / k).abs();
            assert!(
                (shift / expected - 1.0).abs() < 0.5 * next + 2e-3,
                "{k3} {amplitude}: {shift} {expected}"
            );
        }
    }
}

#[test]
fn drag_and_amplitude_damping_have_their_equivalent_damping_ratios() {
    let omega = 10.0_f64;
    for amplitude in [0.01, 0.05] {
        for (id, parameter, value, ratio) in [
            ("quadratic_drag", "drag", 0.3, 4.0 * 0.3 * amplitude / (3.0 * PI)),
            ("amplitude_damping", "damping", 20.0, 20.0 * amplitude * amplitude / (8.0 * omega)),
            ("viscous_friction", "damping", 0.05, 0.05 / (2.0 * omega)),
            ("coulomb_friction", "force", 2e-3, 2.0 * 2e-3 / (PI * omega * omega * amplitude)),
        ] {
            let model = oscillator(
                1.0,
                omega * omega,
                0.0,
                vec![Physics::new(id, "body").with(parameter, value)],
                amplitude,
                0.0,
            );
            let cycles = 2.0;
            let rate_hz = 200.0 * omega / TAU;
            let result = free(&model, (200.0 * cycles) as usize + 1, rate_hz);
            let energies = energy(&result, 1.0, omega * omega);
            // Energy falls by the factor e^(-4 pi zeta) per cycle; half a cycle's loss is half way to the
            // next order.
            let decrement = -0.5 * (energies.last().unwrap() / energies[0]).ln() / cycles;
            let found = decrement / TAU;
            assert!((found / ratio - 1.0).abs() < 0.02 + 20.0 * ratio, "{id} {amplitude}: {found} {ratio}");
        }
    }
}

/// The error falls with the square of the sub-step, for smooth laws and for sticking and stopping ones.
#[test]
fn forces_are_of_second_order_in_the_step() {
    for (id, parameters) in [
        ("cubic_stiffness", vec![("stiffness", 3e4)]),
        ("quadratic_drag", vec![("drag", 20.0)]),
        ("coulomb_friction", vec![("force", 0.8)]),
        ("stribeck_friction", vec![("force", 0.6), ("static_force", 0.9), ("velocity", 0.05)]),
        ("hysteresis", vec![("stiffness", 60.0), ("beta", 100.0), ("gamma", -30.0)]),
        ("end_stop", vec![("distance", 0.02), ("stiffness", 3e3)]),
        ("bilinear_stiffness", vec![("stiffness", 60.0)]),
    ] {
        let mut physics = Physics::new(id, "body");
        for (name, value) in parameters {
            physics = physics.with(name, value);
        }
        let model = oscillator(1.0, 100.0, 0.3, vec![physics], 0.0, 0.0);
        let time_s = ticks(500, 100.0);
        let input = |t: f64| 2.5 * (8.3 * t).sin() + 0.7 * (3.1 * t).cos();
        let with_step = |step_s: f64| {
            let options = SimulateOptions { longest_step_s: Some(step_s), ..SimulateOptions::default() };
            let result = simulate_with(&model, &record(&model, &time_s, input), &options).unwrap();
            result.column("z_m").unwrap().to_vec()
        };
        let exact = with_step(1.0 / 64_000.0);
        let errors: Vec<f64> =
            [500.0, 2000.0, 8000.0].map(|rate| worst(&with_step(1.0 / rate), &exact)).to_vec();
        let order = (errors[0] / errors[2]).log2() / 4.0;
        assert!(order > 1.6, "{id}: order {order:.2}, errors {errors:?}");
        assert!(errors[0] < 2e-3 * peak(&exact), "{id}: {:e} of {:e}", errors[0], peak(&exact));
    }
}

#[test]
fn stamps_anywhere_give_what_a_grid_gives() {
    let law = Physics::new("coulomb_friction", "body").with("force", 0.4);
    let model = oscillator(1.0, 100.0, 0.3, vec![law], 0.0, 0.0);
    let grid_s = ticks(4001, 1000.0);
    let input = |t: f64| 2.5 * (8.3 * t).sin();
    let on_grid = run(&model, &grid_s, input);
    // Every third to twelfth tick of the same input, which is a polygon with corners at all ticks: close, not
    // equal.
    let picked: Vec<usize> = (0..4001)
        .scan(3, |next, tick| {
            Some((tick, {
                if tick == *next {
                    *next += 3 + (tick * 7) % 10;
                    true
                } else {
                    tick == 0
                }
            }))
        })
        .filter(|(_, keep)| *keep)
        .map(|(tick, _)| tick)
        .collect();
    let irregular_s: Vec<f64> = picked.iter().map(|tick| grid_s[*tick]).collect();
    let result = run(&model, &irregular_s, input);
    let expected: Vec<f64> = picked.iter().map(|tick| on_grid.column("z_m").unwrap()[*tick]).collect();
    let found = result.column("z_m").unwrap();
    assert!(
        worst(found, &expected) < 2e-3 * peak(&expected),
        "{:e} of {:e}",
        worst(found, &expected),
        peak(&expected)
    );
    let again = run(&model, &irregular_s, input);
    assert_eq!(found, again.column("z_m").unwrap(), "the same every time");
}

#[test]
fn a_load_that_rattles_in_a_gap_is_followed_over_a_sweep() {
    let text = "schema = 1\nkind = \"lumped\"\n[[body]]\nname = \"motor\"\nmass = 5.4\n[[body]]\nname = \"load\"\nmass = 2.3\n\
        [[spring]]\nbetween = [\"motor\", \"ground\"]\nstiffness = 850\n[[damper]]\nbetween = [\"motor\", \"ground\"]\ndamping = 8.6\n\
        [[spring]]\nbetween = [\"motor\", \"load\"]\nstiffness = 2100\n[[damper]]\nbetween = [\"motor\", \"load\"]\ndamping = 2.0\n\
        [input]\ncolumn = \"force_N\"\nbody = \"motor\"\n[[output]]\ncolumn = \"load_m\"\nbody = \"load\"\nquantity = \"position\"\n\
        [[physics]]\nid = \"backlash\"\nlocation = \"motor-load\"\nparameters = { gap = 0.00076 }";
    let model = Model::from_toml("m", text).unwrap();
    // Down from 7.2 to 0.5 Hz in 28 s, through the resonances of both bodies.
    let time_s = ticks(2800, 100.0);
    let rate = (0.5_f64 / 7.2).ln() / 28.0;
    let force = |t: f64| 4.7 * (TAU * 7.2 * ((rate * t).exp() - 1.0) / rate).sin();
    let recording = Recording::new("r", time_s.clone())
        .with_column("force_N", time_s.iter().map(|t| force(*t)).collect());
    let load_m = |longest_step_s| {
        let options = SimulateOptions { longest_step_s: Some(longest_step_s), ..SimulateOptions::default() };
        simulate_with(&model, &recording, &options).unwrap().column("load_m").unwrap().to_vec()
    };
    let (usual, fine) = (load_m(2e-3), load_m(2e-5));
    let error = worst(&usual, &fine);
    // With the whole sub-step it is 0.16 mm, with a quarter 8 micrometres of 45 mm.
    assert!(error < 3e-5, "{error}");
}

#[test]
fn a_gap_in_a_spring_carries_nothing_and_takes_its_width() {
    let text = with(
        LUMPED,
        "id = \"coulomb_friction\"\nlocation = \"load\"\nparameters = { force = 0.0 }",
        "id = \"backlash\"\nlocation = \"motor-load\"\nparameters = { gap = 0.01 }",
    );
    let text = with(&text, "damping = 0.4", "damping = 0.0");
    // The motor is pulled very slowly: its load hangs on the ground by a spring, and on the motor across the
    // gap.
    let text = with(&text, "body = \"motor\"\ngain = 2.0", "body = \"motor\"\nquantity = \"position\"");
    let text = with(&text, "between = [\"motor\", \"ground\"]", "between = [\"load\", \"ground\"]")
        + "[[damper]]\nbetween = [\"load\", \"ground\"]\ndamping = 4.0\n";
    let model = Model::from_toml("m", &text).unwrap();
    let time_s = ticks(4001, 20.0);
    let pulled = run_column(&model, &time_s, |t| 0.02 * (TAU * t / 100.0).sin());
    let load = pulled.column("load_position_m").unwrap();
    let motor = |t: f64| 0.02 * (TAU * t / 100.0).sin();
    for (t, z) in time_s.iter().zip(load).skip(200) {
        let beyond = motor(*t).signum() * (motor(*t).abs() - 0.005).max(0.0);
        let expected = beyond * 800.0 / 840.0;
        assert!((z - expected).abs() < 6e-5, "{t}: {z} {expected}");
    }
}

#[test]
fn refusals_say_what_to_do() {
    let mut beam = paper_beam();
    beam.input = Some(Input::new("force_N"));
    let forced = Model::BeamOnBase(beam);
    let moved = Model::BeamOnBase(paper_beam());
    let modal = Model::from_toml("m", MODAL).unwrap();
    let lumped = Model::from_toml("m", LUMPED).unwrap();
    for (model, physics, words) in [
        (&forced, Physics::new("magic", "base"), vec!["magic", "coulomb_friction"]),
        (&forced, Physics::new("coulomb_friction", "bass"), vec!["bass", "base, beam"]),
        (&forced, Physics::new("delay", "base"), vec!["delay", "sensor"]),
        (&forced, Physics::new("backlash", "base"), vec!["backlash", "pair of bodies"]),
        (&moved, Physics::new("coulomb_friction", "base"), vec!["prescribes", "[drive]"]),
        (&modal, Physics::new("quadratic_drag", "beam"), vec!["mode 1"]),
        (&modal, Physics::new("tip_mass", "beam"), vec!["mode"]),
        (&lumped, Physics::new("extra_mode", "load"), vec!["further body"]),
        (&forced, Physics::new("coulomb_friction", "base").with("force", -1.0), vec!["-1", "0 to inf N"]),
        (&forced, Physics::new("coulomb_friction", "base").with("size", 1.0), vec!["size", "force"]),
        (&forced, Physics::new("delay", "sensor").with("delay", 9.0), vec!["-1 to 1 s"]),
    ] {
        let mut bad = model.clone();
        bad.setup_mut().physics.push(physics);
        let message = bad.check().unwrap_err().to_string();
        assert!(message.starts_with("`physics.1.") || message.starts_with("`physics.2."), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{words:?} in {message}");
    }
}
