//! Free decays as slow, coarse, drifting and lost recorders write them: the modes are the same.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    FreeDecayOptions, IdentifiedModes, RecordKind, WarningKind, identify_free_decay, recognise,
};
use stillbeam_recording::Recording;
use synthetic::Noise;
use synthetic::kinds::{between, ratio_between};

const SEEDS: u64 = 40;

/// A structure that is let go after a rest.
struct Decay {
    frequency_hz: f64,
    damping_ratio: f64,
    rate_hz: f64,
    rest_s: f64,
    values: Vec<f64>,
}

fn decay(noise: &mut Noise, per_period: [f64; 2]) -> Decay {
    let frequency_hz = ratio_between(noise, 1.0, 80.0);
    let damping_ratio = ratio_between(noise, 0.004, 0.03);
    let rate_hz = frequency_hz * between(noise, per_period[0], per_period[1]);
    let rest_s = between(noise, 0.0, 6.0) / frequency_hz;
    let rings_s = between(noise, 1.5, 4.0) / (TAU * frequency_hz * damping_ratio);
    let phase = TAU * noise.even();
    let omega = TAU * frequency_hz;
    let level = ratio_between(noise, 1e-3, 1e-2);
    let value = |t: f64| match t < 0.0 {
        true => 0.0,
        false => {
            (-damping_ratio * omega * t).exp()
                * (omega * (1.0 - damping_ratio.powi(2)).sqrt() * t + phase).cos()
        }
    };
    let rows = ((rest_s + rings_s) * rate_hz) as usize;
    let values = (0..rows).map(|k| value(k as f64 / rate_hz - rest_s) + level * noise.normal()).collect();
    Decay { frequency_hz, damping_ratio, rate_hz, rest_s, values }
}

impl Decay {
    fn recording(&self, values: Vec<f64>) -> Recording {
        let time_s = (0..values.len()).map(|k| k as f64 / self.rate_hz).collect();
        Recording::new("decay", time_s).with_column("tip_mm", values)
    }

    /// Whether the one mode was found, and nothing else.
    fn is_found(&self, found: &IdentifiedModes) -> bool {
        let [mode] = found.modes.as_slice() else { return false };
        let damping = (mode.damping_ratio.value - self.damping_ratio).abs();
        (mode.frequency_hz.value / self.frequency_hz - 1.0).abs() < 0.006
            && damping < (0.15 * self.damping_ratio).max(3.0 * mode.damping_ratio.stderr)
    }
}

fn identified(recording: &Recording) -> Option<IdentifiedModes> {
    let found = identify_free_decay(recording, &FreeDecayOptions::new("tip_mm"));
    found.map_err(|error| println!("{error}")).ok()
}

/// How many of the seeds give the one mode of their decay, after something was done to it.
fn share_found(
    per_period: [f64; 2],
    spoil: impl Fn(&Decay, &mut Noise) -> Recording,
    said: Option<fn(&WarningKind) -> bool>,
) -> u64 {
    let mut right = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise(seed.wrapping_mul(9176).wrapping_add(5));
        let decay = decay(&mut noise, per_period);
        let recording = spoil(&decay, &mut noise);
        let is_right = identified(&recording).is_some_and(|found| {
            let told = said.is_none_or(|said| found.warnings.iter().any(|warning| said(&warning.kind)));
            decay.is_found(&found) && told
        });
        if !is_right {
            println!("{seed}: {:.3} Hz {:.4}", decay.frequency_hz, decay.damping_ratio);
        }
        right += u64::from(is_right);
    }
    right
}

#[test]
fn a_sensor_slower_than_its_recorder_shows_no_images() {
    let right = share_found(
        [15.0, 40.0],
        |decay, noise| {
            let ratio =
                if noise.even() < 0.5 { between(noise, 2.0, 6.0).round() } else { between(noise, 2.0, 6.0) };
            let rows = (decay.values.len() as f64 * ratio) as usize;
            let held = (0..rows).map(|k| decay.values[(k as f64 / ratio) as usize]).collect();
            Decay { rate_hz: decay.rate_hz * ratio, values: Vec::new(), ..*decay }.recording(held)
        },
        Some(|kind| matches!(kind, WarningKind::HeldReadings { .. })),
    );
    assert!(right >= SEEDS - 2, "{right} of {SEEDS}");
}

#[test]
fn a_tracker_that_loses_its_mark_loses_no_mode() {
    let right = share_found(
        [15.0, 60.0],
        |decay, noise| {
            let (lost, offset) = if noise.even() < 0.5 { (0.0, 400.0) } else { (-1.0, 250.0) };
            let share = between(noise, 0.01, 0.1);
            let values =
                decay.values.iter().map(|y| if noise.even() < share { lost } else { offset + 80.0 * y });
            decay.recording(values.collect())
        },
        Some(|kind| matches!(kind, WarningKind::LostReadings { .. })),
    );
    assert!(right >= SEEDS - 2, "{right} of {SEEDS}");
}

#[test]
fn a_sensor_that_drifts_far_still_shows_where_it_rings() {
    let right = share_found(
        [15.0, 60.0],
        |decay, noise| {
            let drift = between(noise, 5.0, 30.0) / decay.values.len() as f64;
            decay.recording((0..).zip(&decay.values).map(|(k, y)| y + drift * f64::from(k)).collect())
        },
        None,
    );
    let plain = share_found([15.0, 60.0], |decay, _| decay.recording(decay.values.clone()), None);
    assert!(right + 2 >= plain, "{right} where {plain} without the drift");
}

#[test]
fn hum_as_loud_as_the_decay_hides_nothing() {
    let mut right = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise(seed.wrapping_mul(3571).wrapping_add(11));
        let decay = decay(&mut noise, [20.0, 60.0]);
        let hum_hz = decay.frequency_hz * between(&mut noise, 2.5, 6.0);
        let (loud, phase) = (between(&mut noise, 0.3, 1.2), TAU * noise.even());
        let hum = |k: usize| loud * (TAU * hum_hz * k as f64 / decay.rate_hz + phase).sin();
        let values = decay.values.iter().enumerate().map(|(k, y)| y + hum(k)).collect();
        let found = identified(&decay.recording(values));
        right += u64::from(found.is_some_and(|found| decay.is_found(&found)));
    }
    assert!(right >= SEEDS * 9 / 10, "{right} of {SEEDS}");
}

#[test]
fn a_few_periods_are_a_decay_and_worth_what_they_are() {
    let mut right = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise(seed.wrapping_mul(773).wrapping_add(3));
        let decay = decay(&mut noise, [20.0, 60.0]);
        let from = (decay.rest_s * decay.rate_hz) as usize + 1;
        let rows = (between(&mut noise, 2.5, 5.0) * decay.rate_hz / decay.frequency_hz) as usize;
        let values = decay.values[from..from + rows.min(decay.values.len() - from)].to_vec();
        let found = identified(&decay.recording(values));
        right += u64::from(found.is_some_and(|found| {
            let near = |hz: f64| (hz / decay.frequency_hz - 1.0).abs() < 0.02;
            found.modes.len() == 1 && near(found.modes[0].frequency_hz.value)
        }));
    }
    assert!(right >= SEEDS * 9 / 10, "{right} of {SEEDS}");
}

/// A loud frequency that a line crosses holds all that the record has; it is no sweep.
#[test]
fn neither_spikes_nor_coarse_steps_make_a_sweep_of_a_decay() {
    for seed in 0..SEEDS {
        let mut noise = Noise(seed.wrapping_mul(51_977).wrapping_add(29));
        let decay = decay(&mut noise, [20.0, 80.0]);
        let quantum = ratio_between(&mut noise, 0.03, 0.3);
        let coarse: Vec<f64> = decay.values.iter().map(|y| (y / quantum).round() * quantum).collect();
        let rare = between(&mut noise, 0.002, 0.006);
        let spikes: Vec<f64> = decay
            .values
            .iter()
            .map(|y| y + if noise.even() < rare { 8.0 * noise.normal() } else { 0.0 })
            .collect();
        for (what, values) in [("coarse", coarse), ("spikes", spikes)] {
            let found = recognise(&decay.recording(values), "tip_mm").unwrap();
            assert_ne!(found.kind, RecordKind::Sweep, "{what} {seed}: {}", found.statement());
        }
    }
}
