//! Sensors that drift or creep while a structure rings: what drifts is no mode and hides none.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    ForcedOptions, FreeDecayOptions, IdentifiedModes, WarningKind, identify_forced, identify_free_decay,
};
use stillbeam_recording::Recording;
use synthetic::kinds::{between, ratio_between};
use synthetic::{Mode, Noise, modal_response, ring_down};

const ROWS: usize = 6000;
const RATE_HZ: f64 = 400.0;

/// What a sensor drifts by over the share of the record that has passed, a unit at most.
const COURSES: [fn(f64) -> f64; 4] = [|x| x, |x| 1.0 - (-3.0 * x).exp(), |x| x * x, |x| (-x / 0.15).exp()];

fn two_modes(noise: &mut Noise) -> [Mode; 2] {
    let first = Mode {
        frequency_hz: between(noise, 3.0, 20.0),
        damping_ratio: ratio_between(noise, 0.002, 0.02),
        participation: 1.0,
    };
    let second = Mode {
        frequency_hz: first.frequency_hz * between(noise, 2.5, 4.0),
        damping_ratio: ratio_between(noise, 0.002, 0.02),
        participation: 0.5,
    };
    [first, second]
}

fn identified(modes: &[Mode], noise: &mut Noise, course: impl Fn(f64) -> f64) -> IdentifiedModes {
    let errors: Vec<f64> = (0..ROWS).map(|_| 2e-3 * noise.normal()).collect();
    let record = ring_down(modes, RATE_HZ, ROWS, 0.2, |k| errors[k] + course(k as f64 / ROWS as f64));
    let options = FreeDecayOptions { cross_checks: false, ..FreeDecayOptions::new("tip_deflection_m") };
    identify_free_decay(&record, &options).unwrap()
}

fn assert_right(found: &IdentifiedModes, truth: &[Mode], what: &str) {
    assert_eq!(found.modes.len(), truth.len(), "{what}: {:?}", found.modes);
    for (own, truth) in found.modes.iter().zip(truth) {
        assert!((own.frequency_hz.value / truth.frequency_hz - 1.0).abs() < 1e-3, "{what}: {own:?}");
        assert!((own.damping_ratio.value / truth.damping_ratio - 1.0).abs() < 0.05, "{what}: {own:?}");
    }
}

fn tells_a_drift(found: &IdentifiedModes) -> bool {
    found.warnings.iter().any(|warning| matches!(warning.kind, WarningKind::SensorDrifts { .. }))
}

#[test]
fn decays_are_read_from_their_beginning_whatever_the_sensor_drifts_by() {
    for seed in 0..16_u64 {
        let mut noise = Noise(31 * seed + 7);
        let modes = two_modes(&mut noise);
        let sign = if noise.even() < 0.5 { 1.0 } else { -1.0 };
        let size = sign * ratio_between(&mut noise, 0.3, 8.0);
        let course = COURSES[seed as usize % COURSES.len()];
        let found = identified(&modes, &mut noise, |x| size * course(x));
        assert_right(&found, &modes, &format!("{seed}"));
        assert!(tells_a_drift(&found), "{seed}: {:?}", found.warnings);
    }
}

#[test]
fn no_drift_is_told_of_decays_without_one() {
    for seed in 0..16_u64 {
        let mut noise = Noise(77 * seed + 3);
        let modes = two_modes(&mut noise);
        let found = identified(&modes, &mut noise, |_| 0.7);
        assert_right(&found, &modes, &format!("{seed}"));
        assert!(!tells_a_drift(&found), "{seed}: {:?}", found.warnings);
    }
}

/// What a force does to modes, from rest.
fn answer(modes: &[Mode], force: impl Fn(f64) -> f64 + Copy, time_s: &[f64]) -> Vec<f64> {
    let mut tip = vec![0.0; time_s.len()];
    for mode in modes {
        let own = modal_response(*mode, force, time_s);
        let scale = mode.participation * (TAU * mode.frequency_hz).powi(2);
        tip.iter_mut().zip(own).for_each(|(tip, own)| *tip += scale * own);
    }
    tip
}

#[test]
fn the_modes_of_a_sweep_are_found_whatever_the_sensor_drifts_by() {
    for seed in 0..8_u64 {
        let mut noise = Noise(19 * seed + 2);
        let modes = two_modes(&mut noise);
        let (low_hz, high_hz) = (0.4 * modes[0].frequency_hz, 1.4 * modes[1].frequency_hz);
        let time_s: Vec<f64> = (0..12_000).map(|k| f64::from(k) / RATE_HZ).collect();
        let per_s = (high_hz - low_hz) / 30.0;
        let force = |t: f64| (TAU * (low_hz * t + 0.5 * per_s * t * t)).sin();
        let clean = answer(&modes, force, &time_s);
        let top = clean.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        let (size, course) = (between(&mut noise, 0.5, 4.0) * top, COURSES[seed as usize % COURSES.len()]);
        let tip = clean
            .iter()
            .zip(&time_s)
            .map(|(y, t)| y + size * course(t / 30.0) + 2e-3 * top * noise.normal())
            .collect();
        let record = Recording::new("swept", time_s.clone())
            .with_column("force_N", time_s.iter().map(|t| force(*t)).collect())
            .with_column("tip_m", tip);
        let found = identify_forced(&record, &ForcedOptions::new("force_N", "tip_m")).unwrap();
        assert_right(&found, &modes, &format!("{seed}"));
        assert!(tells_a_drift(&found), "{seed}: {:?}", found.warnings);
    }
}
