//! The truth simulator against closed forms: dry friction, energy, resonance, base motion, and convergence in
//! step size.

use std::f64::consts::{PI, TAU};

use stillbeam_concealed::refit::linear_readings;
use stillbeam_concealed::truth::excitation::{Excitation, Shape};
use stillbeam_concealed::truth::integrator::{Force, Machine, Track};
use stillbeam_concealed::truth::jet::Jet;
use stillbeam_concealed::truth::law::{Dry, Physics, Smooth};
use stillbeam_concealed::truth::plant::{
    BeamMachine, InputKind, LinearPlant, PositionLoop, SlideMachine, Vector,
};
use stillbeam_concealed::truth::run::{Kind, Rig};

const MASS: f64 = 2.0;
const STIFFNESS: f64 = 2.0 * TAU * TAU;

/// A body of 2 kg that oscillates once a second.
fn oscillator() -> LinearPlant {
    let slide = SlideMachine {
        bodies: vec![("slider".to_owned(), MASS)],
        ground_stiffness: STIFFNESS,
        ground_damping: 0.0,
        coupling: [0.0, 0.0],
        position_loop: None,
        let_go: false,
    };
    slide.plant().unwrap()
}

fn at_rest_from(place: f64) -> (Vector, Vector) {
    (Vector::from_fn(|row, _| if row == 0 { place } else { 0.0 }), Vector::zeros())
}

fn released(force: Force, place: f64, step_s: f64, duration_s: f64) -> Track {
    let plant = oscillator();
    let machine = Machine::new(&plant, vec![(0, force)], 0.0).unwrap();
    let count = (duration_s / step_s).round() as usize;
    machine.run(at_rest_from(place), &|_| Jet::default(), step_s, count)
}

/// Dry friction takes 2F/k off every half period, each of them lasting exactly half a second, and lets the
/// body rest once the spring is too weak.
#[test]
fn dry_friction_has_the_half_periods_of_its_closed_form() {
    let force = 3.0;
    let way = force / STIFFNESS;
    let begin = 9.3 * way;
    let track = released(Force::Dry(Dry::Coulomb(force)), begin, 1e-3, 4.0);
    let mut amplitude = begin;
    for half in 0..4 {
        let index = 500 * half;
        let wanted = if half % 2 == 0 { amplitude } else { -amplitude };
        assert!((track.positions[index][0] - wanted).abs() < 1e-9, "half period {half}");
        amplitude -= 2.0 * way;
        // In between it is a cosine around the friction's offset.
        let t = 0.2;
        let side = if half % 2 == 0 { 1.0 } else { -1.0 };
        let between = side * (way + (amplitude + way) * (TAU * t).cos());
        assert!((track.positions[index + 200][0] - between).abs() < 1e-9, "in half period {half}");
    }
    // 9.3 − 8 − 2 = −0.7: it turns once more, at 1.3 on the other side, and then stays for good.
    let last = track.positions.last().unwrap()[0];
    assert!((last.abs() - 0.7 * way).abs() < 1e-9, "{}", last / way);
    assert_eq!(track.velocities.last().unwrap()[0], 0.0);
}

/// A force that grows slowly moves the body only beyond the static force, at the right moment.
#[test]
fn a_body_breaks_loose_when_the_force_exceeds_what_holds_it() {
    let plant = oscillator();
    let force = Force::Dry(Dry::Stribeck(2.0, 5.0, 0.05));
    let machine = Machine::new(&plant, vec![(0, force)], 0.0).unwrap();
    // 4 N per second: loose after 1.25 s.
    let track = machine.run(at_rest_from(0.0), &|t| Jet::time(t).scaled(4.0), 1e-3, 1400);
    assert_eq!(track.positions[1250][0], 0.0);
    assert!(track.positions[1400][0] > 1e-5);
}

/// Energy of spring and mass plus the work of friction stays what it was, through every stick and slip.
#[test]
fn friction_takes_exactly_the_energy_that_is_lost() {
    let plant = oscillator();
    let size = 1.5;
    let forces = vec![(0, Force::Dry(Dry::Coulomb(size)))];
    let machine = Machine::new(&plant, forces, 0.0).unwrap();
    let push = |t: f64| Jet::time(t).scaled(TAU * 0.7).sin().scaled(8.0);
    let step_s = 2e-4;
    let track = machine.run(at_rest_from(0.0), &push, step_s, 50_000);
    let (mut given, mut taken) = (0.0, 0.0);
    for k in 1..track.positions.len() {
        let way = track.positions[k][0] - track.positions[k - 1][0];
        let mean = 0.5 * (track.velocities[k][0] + track.velocities[k - 1][0]);
        given += 0.5 * (track.input[k].value + track.input[k - 1].value) * way;
        taken += size * way.abs();
        assert!((mean * step_s - way).abs() < 1e-5);
    }
    let (x, v) = (track.positions.last().unwrap()[0], track.velocities.last().unwrap()[0]);
    let stored = 0.5 * STIFFNESS * x * x + 0.5 * MASS * v * v;
    assert!(given > 5.0, "{given}");
    assert!((given - taken - stored).abs() < 1e-5 * given, "{given} {taken} {stored}");
    assert!(track.events > 10);
}

/// Equivalent damping and frequency of weak laws: drag 4cA/(3π), z²v-damping cA²/8, cubic spring 3kA²/8.
#[test]
fn weak_laws_have_their_textbook_decays_and_shifts() {
    let amplitude = 0.1;
    let omega = TAU;
    let decay = |force| {
        let track = released(force, amplitude, 1e-3, 1.0);
        1.0 - track.positions[1000][0] / amplitude
    };
    let drag = 0.8;
    let wanted = 8.0 * drag * amplitude / (3.0 * MASS);
    let found = decay(Force::Smooth(Smooth::Drag(drag)));
    // To first order in the loss per period.
    assert!((found / (wanted / (1.0 + wanted)) - 1.0).abs() < 2e-3, "{found} {wanted}");
    let damping = 10.0;
    let wanted = PI * damping * amplitude * amplitude / (4.0 * MASS * omega);
    let found = decay(Force::Smooth(Smooth::AmplitudeDamping(damping)));
    assert!((found / wanted - 1.0).abs() < 0.05, "{found} {wanted}");
    let cubic = 30.0;
    let track = released(Force::Smooth(Smooth::Cubic(cubic)), amplitude, 1e-3, 3.0);
    let crossing = (1..2500).rev().find(|&k| track.positions[k - 1][0] < 0.0 && track.positions[k][0] >= 0.0);
    let k = crossing.unwrap();
    let (before, after) = (track.positions[k - 1][0], track.positions[k][0]);
    let time_s = 1e-3 * (k as f64 - after / (after - before));
    let shift = 2.75 / time_s * (if k > 2000 { 1.0 } else { 1.75 / 2.75 }) - 1.0;
    let wanted = 3.0 * cubic * amplitude * amplitude / (8.0 * STIFFNESS);
    assert!((shift / wanted - 1.0).abs() < 0.02, "{shift} {wanted}");
}

/// A Dahl element (gamma 0) saturates at k/beta and its loop is there however slow the motion.
#[test]
fn hysteresis_saturates_where_it_should() {
    let plant = SlideMachine {
        bodies: vec![("slider".to_owned(), 1.0)],
        ground_stiffness: 1e4,
        ground_damping: 200.0,
        coupling: [0.0, 0.0],
        position_loop: None,
        let_go: false,
    }
    .plant()
    .unwrap();
    let (k, beta) = (2e3, 1e3);
    let machine = Machine::new(&plant, vec![(0, Force::Hysteresis([k, beta, 0.0]))], 0.0).unwrap();
    let push = |t: f64| Jet::time(t).scaled(TAU * 0.05).sin().scaled(100.0);
    let track = machine.run(at_rest_from(0.0), &push, 1e-3, 40_000);
    // At 5 and 15 s of the second round the push is at its extremes, the body at rest, and the element at
    // ±k/beta = ±2 N.
    for (index, side) in [(25_000, 1.0), (35_000, -1.0)] {
        let wanted = side * (100.0 - 2.0) / 1e4;
        assert!((track.positions[index][0] - wanted).abs() < 2e-6, "{}", track.positions[index][0]);
    }
}

fn beam(input: InputKind) -> BeamMachine {
    BeamMachine {
        strip: stillbeam_concealed::truth::beam_elements::Strip {
            length_m: 0.9,
            density_kg_m3: 8190.0,
            young_pa: 1.9e11,
            width_m: [0.02, 0.03],
            thickness_m: [0.00126, 0.00103],
            tip_mass_kg: 0.0,
            clamp_compliance: 0.0,
        },
        damping_ratio: vec![0.01; 5],
        base_mass_kg: 2.5,
        base_viscous: 4.0,
        input,
        servo: None,
    }
}

fn sweep(amplitude: f64, duration_s: f64) -> Excitation {
    let shape = Shape::Sweep { from_hz: 0.5, to_hz: 8.0, exponential: true };
    Excitation { shape, amplitude, duration_s }
}

/// Without friction or damping momentum is conserved: the centre of mass of base and beam moves as a rigid
/// body does.
#[test]
fn a_force_moves_the_centre_of_mass_as_newton_says() {
    let mut machine = beam(InputKind::Force);
    machine.base_viscous = 0.0;
    let plant = machine.plant().unwrap();
    let modes = machine.strip.modes(5).unwrap();
    let push = |t: f64| Jet::time(t).scaled(TAU * 1.3).sin().scaled(2.0);
    let machine = Machine::new(&plant, Vec::new(), 0.0).unwrap();
    let track = machine.run(at_rest_from(0.0), &push, 2.5e-4, 8000);
    let total = 2.5 + modes.mass_kg;
    for k in [3000, 5000, 8000] {
        let t = k as f64 * 2.5e-4;
        let w = TAU * 1.3;
        let momentum = 2.0 * (1.0 - (w * t).cos()) / w;
        let of_beam: f64 = (0..5).map(|mode| modes.base[mode] * track.velocities[k][mode + 1]).sum();
        let found = total * track.velocities[k][0] + of_beam;
        assert!((found - momentum).abs() < 1e-8, "{found} {momentum}");
    }
}

/// The same beam, its base prescribed as the freely moving base moved, does the same: two formulations, one
/// answer.
#[test]
fn prescribed_and_free_base_agree() {
    let free = beam(InputKind::Force).plant().unwrap();
    let held = beam(InputKind::BasePosition).plant().unwrap();
    let push = |t: f64| Jet::time(t).scaled(TAU * 1.3).sin().scaled(2.0);
    let first = Machine::new(&free, Vec::new(), 0.0).unwrap().run(at_rest_from(0.0), &push, 1e-4, 10_000);
    let base = |t: f64| -> Jet {
        let place = (t / 1e-4).min(9_999.0);
        let index = place.floor() as usize;
        let s = (place - index as f64) * 1e-4;
        let (x, v) = (first.positions[index][0], first.velocities[index][0]);
        let a = (first.velocities[index + 1][0] - v) / 1e-4;
        Jet { value: x + v * s + 0.5 * a * s * s, rate: v + a * s, bend: a }
    };
    let second = Machine::new(&held, Vec::new(), 0.0).unwrap().run(at_rest_from(0.0), &base, 1e-4, 9_900);
    let tip = |plant: &LinearPlant, track: &Track, k: usize| {
        let (_, row, share) = &plant.outputs[0];
        row.dot(&track.positions[k]) + share * track.input[k].value
    };
    for k in [4000, 7000, 9900] {
        let (one, other) = (tip(&free, &first, k), tip(&held, &second, k));
        assert!((one - other).abs() < 1e-6, "{one} {other}");
    }
}

/// Ten times shorter steps change readings by far less than any sensor's noise, whatever the law.
#[test]
fn readings_converge_in_the_step_size() {
    let laws = [
        ("base", Physics::new("coulomb_friction", "base", &[("force", 0.5)])),
        (
            "base",
            Physics::new(
                "stribeck_friction",
                "base",
                &[("force", 0.4), ("static_force", 0.8), ("velocity", 0.02)],
            ),
        ),
        ("base", Physics::new("end_stop", "base", &[("distance", 0.05), ("stiffness", 5e3)])),
        ("base", Physics::new("hysteresis", "base", &[("stiffness", 300.0), ("beta", 500.0)])),
        ("moved", Physics::new("coulomb_friction", "beam", &[("force", 0.01)])),
        ("moved", Physics::new("bilinear_stiffness", "beam", &[("stiffness", 1.0), ("contact", 0.01)])),
        ("moved", Physics::new("backlash", "base", &[("gap", 2e-4)])),
        ("moved", Physics::new("dead_zone", "drive", &[("threshold", 2e-4)])),
    ];
    for (bench, law) in laws {
        let (input, amplitude) =
            if bench == "base" { (InputKind::Force, 4.0) } else { (InputKind::Setpoint, 1e-3) };
        let rig = Rig::new(&Kind::Beam(beam(input)), std::slice::from_ref(&law)).unwrap();
        let usual = rig.run(&sweep(amplitude, 8.0), 100.0, 1).unwrap();
        let fine = rig.run(&sweep(amplitude, 8.0), 100.0, 10).unwrap();
        let worst = usual.outputs[0].iter().zip(&fine.outputs[0]).map(|(a, b)| (a - b).abs());
        let worst = worst.fold(0.0, f64::max);
        let size = usual.outputs[0].iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        assert!(worst < 1e-6 + 2e-4 * size, "{}: {worst:e} of {size:e}", law.id);
        if law.id == "coulomb_friction" || law.id == "stribeck_friction" {
            assert!(usual.events > 5, "{}: no stick and slip", law.id);
        }
    }
}

fn slider(stiffness: f64, damping: f64) -> SlideMachine {
    SlideMachine {
        bodies: vec![("slider".to_owned(), 10.0)],
        ground_stiffness: stiffness,
        ground_damping: damping,
        coupling: [0.0, 0.0],
        position_loop: None,
        let_go: true,
    }
}

#[test]
fn a_stage_that_is_let_go_loses_twice_the_friction_over_the_stiffness_per_half_swing() {
    let (stiffness, force) = (1000.0, 1.5);
    let law = Physics::new("coulomb_friction", "slider", &[("force", force)]);
    let rig = Rig::new(&Kind::Slide(slider(stiffness, 0.0)), &[law]).unwrap();
    let excitation = Excitation { shape: Shape::Release, amplitude: 20e-3, duration_s: 6.0 };
    let outcome = rig.run(&excitation, 1000.0, 1).unwrap();
    let half_s = PI / (stiffness / 10.0_f64).sqrt();
    for swing in 0..5 {
        let place = outcome.outputs[0][(f64::from(swing) * half_s * 1000.0).round() as usize];
        let expected = 20e-3 - f64::from(swing) * 2.0 * force / stiffness;
        assert!((place.abs() - expected).abs() < 2e-5, "swing {swing}: {place} and not {expected}");
    }
    // It stops where the spring is weaker than the friction, and stays.
    let rest = outcome.outputs[0].last().unwrap().abs();
    assert!(rest < force / stiffness && outcome.outputs[0][5900] == *outcome.outputs[0].last().unwrap());
    assert!(outcome.acted.iter().all(|u| *u == 0.0));
}

#[test]
fn a_position_loop_follows_its_reference_as_a_spring_and_a_damper_would() {
    let (kp, kv) = (15.0, 300.0);
    let looped =
        SlideMachine { position_loop: Some(PositionLoop { kp, kv }), let_go: false, ..slider(0.0, 20.0) };
    let shape = Shape::Sweep { from_hz: 0.3, to_hz: 2.0, exponential: true };
    let excitation = Excitation { shape, amplitude: 10e-3, duration_s: 10.0 };
    let outcome = Rig::new(&Kind::Slide(looped.clone()), &[]).unwrap().run(&excitation, 100.0, 1).unwrap();
    let ideal = linear_readings(&Kind::Slide(looped), &excitation, 100.0, outcome.time_s.len()).unwrap();
    for (one, other) in outcome.outputs[0].iter().zip(&ideal[0]) {
        assert!((one - other).abs() < 2e-4, "{one} {other}");
    }
    // The force that is recorded is the controller's, from what was true at the stamp.
    for k in [100, 400, 900] {
        let speed = (outcome.outputs[0][k + 1] - outcome.outputs[0][k - 1]) * 50.0;
        let force = kv * (kp * (outcome.command[k] - outcome.outputs[0][k]) - speed);
        // Differences over 20 ms miss a speed at 2 Hz by 0.3 %, of some 30 N.
        assert!((outcome.acted[k] - force).abs() < 0.15, "{} {force}", outcome.acted[k]);
    }
}

#[test]
fn a_random_force_repeats_with_its_run_and_not_from_run_to_run() {
    let law = Physics::new("outside:random_telegraph", "slider", &[("force", 2.0), ("seed", 5.0)]);
    let rig = Rig::new(&Kind::Slide(slider(1000.0, 20.0)), &[law]).unwrap();
    let moved = |amplitude: f64| {
        let excitation = Excitation { shape: Shape::Release, amplitude, duration_s: 20.0 };
        let free = linear_readings(&Kind::Slide(slider(1000.0, 20.0)), &excitation, 100.0, 2001).unwrap();
        let outcome = rig.run(&excitation, 100.0, 1).unwrap();
        outcome.outputs[0].iter().zip(&free[0]).map(|(with, without)| with - without).collect::<Vec<f64>>()
    };
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (one, again, other) = (moved(20e-3), moved(20e-3), moved(21e-3));
    assert_eq!(one, again);
    let alike = product(&one, &other) / (product(&one, &one) * product(&other, &other)).sqrt();
    assert!(product(&one, &one) > 0.0 && alike.abs() < 0.7, "as alike as {alike}");
}
