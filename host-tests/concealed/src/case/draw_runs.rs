//! Draws of excitations and devices.

use std::f64::consts::TAU;

use super::{Role, RunPlan};
use crate::random::Random;
use crate::truth::excitation::{Excitation, Shape};
use crate::truth::plant::InputKind;
use crate::truth::run::Kind;

/// Seconds of a recording.
const DURATION_S: (f64, f64) = (24.0, 30.0);
/// Sweeps of a pushed base begin no lower, so that it stays on its rails.
const LOWEST_PUSH_HZ: f64 = 0.6;

/// Three recordings to train on and two to hold out, for a machine with these two frequencies.
///
/// The greatest amplitude is two to three times the smallest; a sweep upwards, one downwards and another
/// signal train.
pub fn runs(kind: &Kind, frequencies_hz: [f64; 2], random: &mut Random) -> Vec<RunPlan> {
    let amplitude = amplitude(kind, frequencies_hz, random);
    let pushed = matches!(kind, Kind::Beam(beam) if beam.input == InputKind::Force);
    let highest_hz = 1.25 * frequencies_hz[1].max(2.0 * frequencies_hz[0]);
    let lowest_hz = if pushed { LOWEST_PUSH_HZ } else { 0.3 * frequencies_hz[0] };
    if matches!(kind, Kind::Slide(slide) if slide.let_go) {
        return releases(random);
    }
    let is_force = pushed || matches!(kind, Kind::Slide(slide) if slide.position_loop.is_none());
    let sweep = |down: bool, exponential: bool| {
        let (low, high) = (lowest_hz, highest_hz);
        let (from_hz, to_hz) = if down { (high, low) } else { (low, high) };
        Shape::Sweep { from_hz, to_hz, exponential }
    };
    let loud = random.between(2.0, 3.0);
    let exponential = random.chance(0.6);
    let third = match (is_force, random.chance(0.5)) {
        (_, true) => multisine(lowest_hz, highest_hz, random),
        (true, false) => doublets(random),
        (false, false) => moves(random),
    };
    let fourth = if random.chance(0.5) { sweep(true, true) } else { sweep(false, !exponential) };
    let fifth = if is_force { doublets(random) } else { moves(random) };
    // A single push or move is far from resonance; it may be larger.
    let louder = if is_force { 3.0 } else { 8.0 };
    let scale = |shape: &Shape| match shape {
        Shape::Sweep { .. } => 1.0,
        Shape::Multisine { .. } => 1.2,
        Shape::Moves { .. } | Shape::Doublets { .. } | Shape::Release => louder,
    };
    let plans = [
        ("sweep_up", Role::Train, sweep(false, exponential), 1.0),
        ("sweep_down", Role::Train, sweep(true, random.chance(0.5)), loud),
        ("third", Role::Train, third, 0.5 * (1.0 + loud)),
        ("check", Role::HeldOut, fourth, random.between(1.3, loud)),
        ("motion", Role::HeldOut, fifth, random.between(1.0, loud)),
    ];
    plans
        .into_iter()
        .map(|(name, role, shape, factor)| RunPlan {
            name: name.to_owned(),
            role,
            excitation: Excitation {
                amplitude: amplitude * factor * scale(&shape),
                shape,
                duration_s: random.between(DURATION_S.0, DURATION_S.1).round(),
            },
        })
        .collect()
}

fn amplitude(kind: &Kind, frequencies_hz: [f64; 2], random: &mut Random) -> f64 {
    match kind {
        Kind::Beam(beam) if beam.input == InputKind::Force => random.between(1.5, 4.0),
        Kind::Beam(_) => random.between(0.4e-3, 1.0e-3),
        Kind::Slide(slide) if slide.position_loop.is_some() => random.between(5e-3, 12e-3),
        Kind::Slide(slide) => {
            // Some 10 to 30 mm at the first resonance.
            let omega = TAU * frequencies_hz[0];
            slide.ground_damping * omega * random.between(0.01, 0.03)
        }
    }
}

/// Three free decays to train on and two to hold out, from two to three times as far as the nearest.
fn releases(random: &mut Random) -> Vec<RunPlan> {
    let (nearest, loud) = (random.between(8e-3, 20e-3), random.between(2.0, 3.0));
    let plans = [
        ("near", Role::Train, 1.0),
        ("far", Role::Train, -loud),
        ("middle", Role::Train, 0.5 * (1.0 + loud)),
        ("check", Role::HeldOut, random.between(1.3, loud)),
        ("motion", Role::HeldOut, -random.between(1.0, loud)),
    ];
    plans
        .into_iter()
        .map(|(name, role, factor)| RunPlan {
            name: name.to_owned(),
            role,
            excitation: Excitation {
                shape: Shape::Release,
                amplitude: nearest * factor,
                duration_s: random.between(DURATION_S.0, DURATION_S.1).round(),
            },
        })
        .collect()
}

fn multisine(low_hz: f64, high_hz: f64, random: &mut Random) -> Shape {
    let count = 24;
    let lines = (0..count).map(|k| {
        let share = (f64::from(k) + random.between(0.2, 0.8)) / f64::from(count);
        (low_hz * (high_hz / low_hz).powf(share), random.between(0.0, TAU))
    });
    Shape::Multisine { lines: lines.collect() }
}

fn moves(random: &mut Random) -> Shape {
    let stops = [1.0, random.between(0.2, 0.6), random.between(-1.0, -0.5), 0.0];
    Shape::Moves { stops: stops.to_vec(), move_s: random.between(0.25, 0.6), every_s: 5.5 }
}

fn doublets(random: &mut Random) -> Shape {
    let pushes = [1.0, -random.between(0.4, 0.8), random.between(0.15, 0.4)];
    Shape::Doublets { pushes: pushes.to_vec(), push_s: random.between(0.4, 0.9), every_s: 7.0 }
}
