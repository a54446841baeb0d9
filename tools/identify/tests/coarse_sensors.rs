//! Sensors with coarse steps: what the steps leave of a motion is no mode.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{ForcedOptions, identify_forced};
use stillbeam_recording::Recording;
use synthetic::kinds::{between, ratio_between};
use synthetic::{Mode, Noise, modal_response};

const RATE_HZ: f64 = 400.0;
const SECONDS: f64 = 30.0;

/// A sweep of two modes, its largest motion a few steps of the sensor.
#[test]
fn sweeps_that_move_a_sensor_by_few_of_its_steps_give_their_modes_and_no_others() {
    for seed in 0..10_u64 {
        let mut noise = Noise(23 * seed + 9);
        let first_hz = between(&mut noise, 4.0, 12.0);
        let second_hz = first_hz * between(&mut noise, 1.8, 2.6);
        let mut mode = |frequency_hz| Mode {
            frequency_hz,
            damping_ratio: ratio_between(&mut noise, 0.004, 0.03),
            participation: 1.0,
        };
        let modes = [mode(first_hz), mode(second_hz)];
        let (low_hz, high_hz) = (0.4 * first_hz, 1.6 * second_hz);
        let per_s = (high_hz - low_hz) / SECONDS;
        let force = |t: f64| (TAU * (low_hz * t + 0.5 * per_s * t * t)).sin();
        let time_s: Vec<f64> = (0..(RATE_HZ * SECONDS) as usize).map(|k| k as f64 / RATE_HZ).collect();
        let mut tip = vec![0.0; time_s.len()];
        for mode in modes {
            let own = modal_response(mode, force, &time_s);
            let top = own.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
            tip.iter_mut().zip(own).for_each(|(tip, own)| *tip += own / top);
        }
        let step = 1.0 / between(&mut noise, 6.0, 30.0);
        let tip = tip.into_iter().map(|y| (y / step).round() * step).collect();
        let record = Recording::new("coarse", time_s.clone())
            .with_column("force_N", time_s.iter().map(|t| force(*t)).collect())
            .with_column("tip_m", tip);
        let found = identify_forced(&record, &ForcedOptions::new("force_N", "tip_m")).unwrap();
        let told: Vec<(f64, f64)> =
            found.modes.iter().map(|mode| (mode.frequency_hz.value, mode.damping_ratio.value)).collect();
        assert_eq!(told.len(), 2, "{seed}: {told:?} of {modes:?}");
        for ((hz, damping), truth) in told.into_iter().zip(modes) {
            assert!((hz / truth.frequency_hz - 1.0).abs() < 5e-3, "{seed}: {hz} of {truth:?}");
            assert!((damping / truth.damping_ratio - 1.0).abs() < 0.1, "{seed}: {damping} of {truth:?}");
        }
    }
}
