//! Records that a move leaves behind, where the move itself was not recorded.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{FreeDecayOptions, RecordKind, identify_free_decay, recognise};
use stillbeam_recording::Recording;
use synthetic::Noise;
use synthetic::kinds::{between, ratio_between};

/// A machine that is moved and then rings, seen from beside it.
struct Moved {
    recording: Recording,
    frequency_hz: f64,
    damping_ratio: f64,
    until_s: f64,
}

/// The way from 0 to 1: with limited acceleration, or as smooth as motion controllers make it.
fn way(share: f64, smooth: bool) -> f64 {
    let x = share.clamp(0.0, 1.0);
    match (smooth, x < 0.5) {
        (true, _) => x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x),
        (false, true) => 2.0 * x * x,
        (false, false) => 1.0 - 2.0 * (1.0 - x).powi(2),
    }
}

fn moved(seed: u64) -> Moved {
    let mut noise = Noise(seed.wrapping_mul(6151).wrapping_add(77));
    let frequency_hz = ratio_between(&mut noise, 1.0, 60.0);
    let damping_ratio = ratio_between(&mut noise, 0.004, 0.04);
    let rate_hz = frequency_hz * between(&mut noise, 15.0, 60.0);
    let step_s = 1.0 / rate_hz;
    // Half a period to a period and a half: longer moves hardly leave anything.
    let takes_s = between(&mut noise, 0.4, 1.4) / frequency_hz;
    let begins_s = between(&mut noise, 0.5, 6.0) / frequency_hz;
    let rings_s = between(&mut noise, 1.0, 4.0) / (TAU * frequency_hz * damping_ratio);
    let smooth = noise.even() < 0.5;
    let (from, travel) = (between(&mut noise, -3.0, 3.0), between(&mut noise, 0.05, 0.5));
    let rows = ((begins_s + takes_s + rings_s) * rate_hz) as usize;
    let base = |t: f64| travel * way((t - begins_s) / takes_s, smooth);
    // The tip follows the base as a mass behind a spring and a damper does; 20 steps per sample.
    let fine_s = step_s / 20.0;
    let omega = TAU * frequency_hz;
    let (mut tip, mut speed) = (0.0, 0.0);
    let level = travel * ratio_between(&mut noise, 1e-4, 3e-3);
    let mut values = Vec::with_capacity(rows);
    for row in 0..rows {
        values.push(from + tip + level * noise.normal());
        for k in 0..20 {
            let t = row as f64 * step_s + k as f64 * fine_s;
            let pull = omega * omega * (base(t) - tip);
            let base_speed = (base(t + fine_s) - base(t)) / fine_s;
            speed += fine_s * (pull + 2.0 * damping_ratio * omega * (base_speed - speed));
            tip += fine_s * speed;
        }
    }
    let time_s = (0..rows).map(|k| k as f64 * step_s).collect();
    let recording = Recording::new("moved", time_s).with_column("laser_mm", values);
    Moved { recording, frequency_hz, damping_ratio, until_s: begins_s + takes_s }
}

#[test]
fn ringing_after_a_move_is_a_decay_from_the_end_of_the_move_on() {
    const SEEDS: u64 = 120;
    let (mut right, mut early) = (0, 0);
    for seed in 0..SEEDS {
        let moved = moved(seed);
        let kind = recognise(&moved.recording, "laser_mm").unwrap();
        let found = identify_free_decay(&moved.recording, &FreeDecayOptions::new("laser_mm"));
        let near = found.as_ref().is_ok_and(|found| {
            let [mode] = found.modes.as_slice() else { return false };
            let (f, zeta) = (mode.frequency_hz, mode.damping_ratio);
            let damping = (zeta.value - moved.damping_ratio).abs();
            (f.value / moved.frequency_hz - 1.0).abs() < 0.006
                && damping < (0.15 * moved.damping_ratio).max(3.0 * zeta.stderr)
        });
        right += u64::from(near && kind.kind == RecordKind::FreeDecay);
        let period_s = 1.0 / moved.frequency_hz;
        early += u64::from(kind.moved_until_s.is_some_and(|t| t < moved.until_s - 0.25 * period_s));
        if !near || kind.kind != RecordKind::FreeDecay {
            let modes = found.map(|found| {
                found.modes.iter().map(|m| (m.frequency_hz.value, m.damping_ratio.value)).collect::<Vec<_>>()
            });
            let said = modes.map_err(|error| error.to_string());
            println!(
                "{seed}: {} until {:.3}, {:.3} Hz {:.4}: {said:?}",
                kind.statement(),
                moved.until_s,
                moved.frequency_hz,
                moved.damping_ratio
            );
        }
    }
    assert!(right * 100 >= 95 * SEEDS, "{right} of {SEEDS}");
    assert!(early <= 3, "{early} begin within the move");
}

/// What goes on is no move, though it begins elsewhere than it ends.
#[test]
fn what_goes_on_about_a_level_that_shifts_is_not_taken_for_ringing_after_a_move() {
    for kind in [RecordKind::Sweep, RecordKind::Random, RecordKind::Multisine, RecordKind::Tone] {
        let mut taken = 0;
        for seed in 0..40 {
            let record = synthetic::kinds::record(kind, seed);
            let samples = record.column("tip_m").unwrap();
            let largest = samples.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
            let at = samples.len() / 4;
            let shifted: Vec<f64> = samples
                .iter()
                .enumerate()
                .map(|(k, y)| y + if k < at { 3.0 * largest } else { 0.0 })
                .collect();
            let record = Recording::new("shifted", record.time_s.clone()).with_column("tip_m", shifted);
            let found = recognise(&record, "tip_m").unwrap();
            if found.moved_until_s.is_some() {
                taken += 1;
                println!("{kind:?} {seed} of {:.3} s: {}", record.time_s.last().unwrap(), found.statement());
            }
        }
        assert_eq!(taken, 0, "{kind:?}");
    }
}
