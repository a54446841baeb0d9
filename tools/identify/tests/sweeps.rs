//! Sweeps of known modes, simulated by fine Runge-Kutta steps, come back as the modes they were made from.

use crate::synthetic;

use stillbeam_identify::{
    FastPassage, ForcedOptions, IdentifiedModes, InputInterpolation, InputKind, StopReason, Warning,
    WarningKind, compare_recordings, identify_forced,
};
use stillbeam_recording::Recording;
use synthetic::{Mode, Noise, Sweep, clean_sweep, modal_response, noisy, sweep_record};

const DAMPINGS: [[f64; 2]; 4] = [[0.0074, 0.0033], [0.0074, 0.0059], [0.074, 0.033], [0.074, 0.059]];

fn two_modes(damping: [f64; 2]) -> [Mode; 2] {
    [
        Mode { frequency_hz: 1.1, damping_ratio: damping[0], participation: 1.566 },
        Mode { frequency_hz: 6.9, damping_ratio: damping[1], participation: -0.868 },
    ]
}

fn options() -> ForcedOptions {
    ForcedOptions::new("base_position_m", "tip_deflection_m")
}

/// Largest relative errors of frequency, damping and participation.
fn errors(found: &IdentifiedModes, truth: &[Mode]) -> [f64; 3] {
    assert_eq!(found.modes.len(), truth.len(), "{:?}", found.modes);
    let mut worst = [0.0_f64; 3];
    for (mode, truth) in found.modes.iter().zip(truth) {
        let pairs = [
            (mode.frequency_hz.value, truth.frequency_hz),
            (mode.damping_ratio.value, truth.damping_ratio),
            (mode.participation.unwrap().value, truth.participation),
        ];
        for (worst, (value, truth)) in worst.iter_mut().zip(pairs) {
            *worst = worst.max((value / truth - 1.0).abs());
        }
    }
    worst
}

#[test]
fn frequency_comes_back_within_a_hundredth_of_a_percent_and_damping_within_one_percent() {
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        for damping in DAMPINGS {
            let modes = two_modes(damping);
            // Input at 1 kHz, camera at 100 Hz.
            let record = sweep_record(sweep, &modes, 10, 50e-6, 7);
            let found = identify_forced(&record, &options()).unwrap();
            let [f, zeta, participation] = errors(&found, &modes);
            println!("{sweep:?} {damping:?}: f {f:.1e}, zeta {zeta:.1e}, participation {participation:.1e}");
            assert!(f < 1e-4 && zeta < 1e-2 && participation < 2e-3);
            assert!((found.residual_rms / 50e-6 - 1.0).abs() < 0.05, "{}", found.residual_rms);
            assert!(found.stop_reason != StopReason::IterationLimit);
        }
    }
}

#[test]
fn ten_times_the_noise_costs_accuracy_in_proportion_and_no_more() {
    for sweep in [Sweep::Linear, Sweep::Exponential] {
        let modes = two_modes(DAMPINGS[1]);
        let record = sweep_record(sweep, &modes, 2, 500e-6, 3);
        let [f, zeta, _] = errors(&identify_forced(&record, &options()).unwrap(), &modes);
        assert!(f < 1e-3 && zeta < 5e-2, "{sweep:?}: f {f:.1e}, zeta {zeta:.1e}");
    }
}

#[test]
fn input_at_camera_rate_does_not_bias_the_participation_where_straight_lines_do() {
    let modes = [Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 }];
    let record = sweep_record(Sweep::Linear, &modes, 1, 0.0, 1);
    let bias = |interpolation| {
        let options = ForcedOptions { interpolation, ..options().with_modes(1) };
        errors(&identify_forced(&record, &options).unwrap(), &modes)[2]
    };
    let (cubic, linear) = (bias(InputInterpolation::Cubic), bias(InputInterpolation::Linear));
    println!("bias of the participation: cubic {cubic:.1e}, linear {linear:.1e}");
    assert!(cubic < 5e-4);
    assert!(linear > 1e-2);
}

#[test]
fn modes_are_counted_right_with_and_without_noise() {
    let all = [
        Mode { frequency_hz: 1.1, damping_ratio: 0.0074, participation: 1.566 },
        Mode { frequency_hz: 3.3, damping_ratio: 0.01, participation: 0.3 },
        Mode { frequency_hz: 6.9, damping_ratio: 0.0059, participation: -0.868 },
    ];
    for count in 1..=3 {
        for noise_m in [0.0, 50e-6] {
            let record = sweep_record(Sweep::Exponential, &all[..count], 4, noise_m, 11);
            let found = identify_forced(&record, &options()).unwrap();
            let [f, zeta, _] = errors(&found, &all[..count]);
            assert!(f < 1e-4 && zeta < 1e-2, "{count} modes, noise {noise_m}: {f:.1e} {zeta:.1e}");
        }
    }
}

#[test]
fn a_record_that_begins_ringing_is_fitted_from_its_own_initial_state() {
    let modes = two_modes(DAMPINGS[1]);
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 2);
    let whole = noisy(Sweep::Linear, &time_s, &clean, 50e-6, 5);
    // The sweep passes 1.1 Hz at 10 s: from 12 s on the first mode rings freely and hard.
    let from = time_s.iter().position(|t| *t >= 12.0).unwrap();
    let mut late = Recording::new("late", whole.time_s[from..].to_vec());
    for column in &whole.columns {
        late = late.with_column(column.name.clone(), column.samples[from..].to_vec());
    }
    let [f, zeta, _] = errors(&identify_forced(&late, &options()).unwrap(), &modes);
    assert!(f < 1e-4 && zeta < 1e-2, "{f:.1e} {zeta:.1e}");
}

#[test]
fn uneven_stamps_and_missing_rows_cost_nothing_but_the_rows() {
    let modes = two_modes(DAMPINGS[2]);
    let mut noise = Noise(9);
    let mut time_s = vec![0.0];
    while time_s[time_s.len() - 1] < 79.0 {
        let last = time_s[time_s.len() - 1];
        time_s.push(last + 0.005 * (1.0 + 0.3 * noise.normal().clamp(-2.0, 2.0)));
    }
    let mut tip = vec![0.0; time_s.len()];
    for mode in &modes {
        let q = modal_response(*mode, |t| -Sweep::Linear.acceleration(t), &time_s);
        tip.iter_mut().zip(q).for_each(|(tip, q)| *tip += mode.participation * q);
    }
    let mut base: Vec<f64> = time_s.iter().map(|t| Sweep::Linear.position(*t)).collect();
    for k in 0..time_s.len() {
        tip[k] += 50e-6 * noise.normal();
        if k % 3 == 1 {
            tip[k] = f64::NAN;
        }
        if k % 7 == 2 {
            base[k] = f64::NAN;
        }
    }
    let record = Recording::new("uneven", time_s)
        .with_column("base_position_m", base)
        .with_column("tip_deflection_m", tip);
    let [f, zeta, participation] = errors(&identify_forced(&record, &options()).unwrap(), &modes);
    assert!(f < 1e-4 && zeta < 1e-2 && participation < 3e-3, "{f:.1e} {zeta:.1e} {participation:.1e}");
}

#[test]
fn a_force_drives_the_modes_with_the_sign_of_the_contract() {
    let modes = [Mode { frequency_hz: 4.0, damping_ratio: 0.02, participation: 0.7 }];
    let time_s: Vec<f64> = (0..16_000).map(|k| 0.005 * f64::from(k)).collect();
    let force = |t: f64| 3.0 + 1e3 * Sweep::Linear.position(t);
    let mut noise = Noise(4);
    let q = modal_response(modes[0], force, &time_s);
    let tip = q.iter().map(|q| 0.7 * q + 0.02 + 1e-5 * noise.normal()).collect();
    let forces: Vec<f64> = time_s.iter().map(|t| force(*t)).collect();
    let record =
        Recording::new("force", time_s).with_column("force_N", forces).with_column("tip_deflection_m", tip);
    let found = identify_forced(&record, &ForcedOptions::new("force_N", "tip_deflection_m")).unwrap();
    let [f, zeta, participation] = errors(&found, &modes);
    assert!(f < 1e-4 && zeta < 1e-2 && participation < 1e-2, "{f:.1e} {zeta:.1e} {participation:.1e}");
}

#[test]
fn base_acceleration_and_base_position_tell_the_same() {
    let modes = [Mode { frequency_hz: 4.0, damping_ratio: 0.02, participation: 0.7 }];
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 4);
    let acceleration = time_s.iter().map(|t| Sweep::Linear.acceleration(*t)).collect();
    let record =
        noisy(Sweep::Linear, &time_s, &clean, 10e-6, 2).with_column("base_acceleration_m_s2", acceleration);
    for input in ["base_position_m", "base_acceleration_m_s2"] {
        let found = identify_forced(&record, &ForcedOptions::new(input, "tip_deflection_m")).unwrap();
        let [f, zeta, participation] = errors(&found, &modes);
        assert!(
            f < 1e-4 && zeta < 1e-2 && participation < 3e-3,
            "{input}: {f:.1e} {zeta:.1e} {participation:.1e}"
        );
    }
}

#[test]
fn an_absolute_tip_position_has_the_base_taken_out() {
    let modes = two_modes(DAMPINGS[1]);
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 2);
    let absolute: Vec<f64> = clean.iter().zip(&time_s).map(|(w, t)| w + Sweep::Linear.position(*t)).collect();
    let base = time_s.iter().map(|t| Sweep::Linear.position(*t)).collect();
    let record = Recording::new("absolute", time_s)
        .with_column("base_position_m", base)
        .with_column("tip_position_m", absolute);
    let found = identify_forced(&record, &ForcedOptions::new("base_position_m", "tip_position_m")).unwrap();
    let [f, zeta, participation] = errors(&found, &modes);
    assert!(f < 1e-5 && zeta < 1e-3 && participation < 1e-3, "{f:.1e} {zeta:.1e} {participation:.1e}");
}

#[test]
fn a_delay_is_found_when_asked_for() {
    let modes = two_modes(DAMPINGS[3]);
    let delay_s = 0.012;
    let (time_s, _) = clean_sweep(Sweep::Linear, &modes[..0], 1);
    let mut tip = vec![0.0; time_s.len()];
    for mode in &modes {
        let delayed = |t: f64| if t < delay_s { 0.0 } else { -Sweep::Linear.acceleration(t - delay_s) };
        let q = modal_response(*mode, delayed, &time_s);
        tip.iter_mut().zip(q).for_each(|(tip, q)| *tip += mode.participation * q);
    }
    let record = noisy(Sweep::Linear, &time_s, &tip, 50e-6, 8);
    let free = ForcedOptions { max_delay_s: 0.05, ..options().with_modes(2) };
    let found = identify_forced(&record, &free).unwrap();
    let delay = found.delay_s.unwrap();
    assert!((delay.value - delay_s).abs() < 2e-4 && delay.stderr < 1e-4, "{delay:?}");
    let [f, zeta, _] = errors(&found, &modes);
    assert!(f < 3e-4 && zeta < 1e-2, "{f:.1e} {zeta:.1e}");
    let without = identify_forced(&record, &options().with_modes(2)).unwrap();
    assert!(without.delay_s.is_none() && without.residual_rms > 1.5 * found.residual_rms);
}

fn has(found: &IdentifiedModes, kind: impl Fn(&WarningKind) -> bool) -> bool {
    found.warnings.iter().any(|warning| kind(&warning.kind))
}

#[test]
fn a_sweep_too_fast_for_the_frequency_response_is_said_to_be_so() {
    let record = sweep_record(Sweep::Linear, &two_modes(DAMPINGS[0]), 2, 50e-6, 1);
    let found = identify_forced(&record, &options()).unwrap();
    let passages = |found: &IdentifiedModes| -> Vec<FastPassage> {
        let fast = |warning: &Warning| match &warning.kind {
            WarningKind::SweepTooFast { modes } => Some(modes.clone()),
            _ => None,
        };
        let told: Vec<Vec<FastPassage>> = found.warnings.iter().filter_map(fast).collect();
        assert!(told.len() <= 1, "told once: {told:?}");
        told.concat()
    };
    let fast = passages(&found);
    assert_eq!(fast.len(), 2, "{:?}", found.warnings);
    for one in fast {
        assert!((one.rate_hz_s / 0.09875 - 1.0).abs() < 0.2, "{one:?}");
        assert!(one.limit_hz_s < 0.003 && one.mode_hz < 7.0, "{one:?}");
    }
    // Heavily damped and slowly swept at 6.9 Hz (rate 0.1, limit 0.66 Hz/s): no warning there.
    let record = sweep_record(Sweep::Linear, &two_modes(DAMPINGS[3]), 2, 50e-6, 1);
    let found = identify_forced(&record, &options()).unwrap();
    assert!(passages(&found).iter().all(|one| one.mode_hz < 5.0));
    assert!(found.real_pole.is_none() && found.modes.iter().all(|mode| mode.rate_participation.is_none()));
}

#[test]
fn a_record_shorter_than_the_decay_is_said_to_be_so() {
    let modes = [Mode { frequency_hz: 2.0, damping_ratio: 0.001, participation: 1.0 }];
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 1);
    let short = 5000;
    let record = noisy(Sweep::Linear, &time_s[..short], &clean[..short], 10e-6, 1);
    let found = identify_forced(&record, &options()).unwrap();
    assert!(has(
        &found,
        |w| matches!(w, WarningKind::RecordShorterThanDecay { decay_time_s, .. } if *decay_time_s > 50.0)
    ));
    assert!((found.modes[0].damping_ratio.value / 0.001 - 1.0).abs() < 0.02);
}

#[test]
fn clipping_and_input_gaps_are_noticed() {
    let modes = two_modes(DAMPINGS[2]);
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 1);
    let largest = clean.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
    let clipped: Vec<f64> = clean.iter().map(|y| y.clamp(-0.5 * largest, 0.5 * largest)).collect();
    let mut record = noisy(Sweep::Linear, &time_s, &clipped, 0.0, 1);
    for k in 3000..3020 {
        record.columns[0].samples[k] = f64::NAN;
    }
    let found = identify_forced(&record, &options().with_modes(1)).unwrap();
    assert!(has(&found, |w| matches!(w, WarningKind::Clipping { level, .. } if *level > 0.0)));
    assert!(has(
        &found,
        |w| matches!(w, WarningKind::InputGap { start_s, length_s } if (*start_s - 29.99).abs() < 0.011 && (*length_s - 0.21).abs() < 1e-6)
    ));
}

#[test]
fn recordings_that_disagree_are_named_and_those_that_agree_are_not() {
    let stiff = two_modes(DAMPINGS[1]);
    let soft = [Mode { frequency_hz: 1.08, damping_ratio: 0.0095, ..stiff[0] }, stiff[1]];
    let identify = |modes: &[Mode], seed| {
        identify_forced(&sweep_record(Sweep::Linear, modes, 2, 50e-6, seed), &options()).unwrap()
    };
    let (first, again, other) = (identify(&stiff, 1), identify(&stiff, 2), identify(&soft, 3));
    assert!(compare_recordings(&[first.clone(), again]).is_empty());
    let warnings = compare_recordings(&[first, other]);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(compare_recordings(&[]).is_empty());
}

#[test]
fn the_frequency_response_away_from_resonance_is_that_of_the_modes() {
    let modes = two_modes(DAMPINGS[3]);
    let record = sweep_record(Sweep::Linear, &modes, 2, 10e-6, 1);
    let frf = identify_forced(&record, &options()).unwrap().frf.unwrap();
    let k = frf.frequency_hz.iter().position(|f| *f > 4.0).unwrap();
    // Base position to tip: participation times r² / (1 - r² + 2 i zeta r), r = f over the mode's frequency.
    let (mut re, mut im) = (0.0, 0.0);
    for mode in &modes {
        let r = frf.frequency_hz[k] / mode.frequency_hz;
        let (a, b) = (1.0 - r * r, 2.0 * mode.damping_ratio * r);
        let scale = mode.participation * r * r / (a * a + b * b);
        re += scale * a;
        im -= scale * b;
    }
    let size = re.hypot(im);
    assert!(
        (frf.real[k] - re).hypot(frf.imag[k] - im) < 0.1 * size,
        "{} {} for {re} {im}",
        frf.real[k],
        frf.imag[k]
    );
    assert!(frf.coherence[k] > 0.9 && frf.coherence.iter().all(|c| (0.0..=1.0).contains(c)));
}

#[test]
fn input_kind_can_be_stated_for_columns_in_other_units() {
    let modes = [Mode { frequency_hz: 4.0, damping_ratio: 0.02, participation: 0.7 }];
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 2);
    let volts = time_s.iter().map(|t| -Sweep::Linear.acceleration(*t)).collect();
    let record =
        Recording::new("volts", time_s).with_column("drive_V", volts).with_column("tip_deflection_m", clean);
    let plain = ForcedOptions::new("drive_V", "tip_deflection_m");
    let refusal = identify_forced(&record, &plain).unwrap_err().to_string();
    assert!(refusal.contains("--input-kind force"), "{refusal}");
    let stated = ForcedOptions { input_kind: Some(InputKind::Force), ..plain };
    let [f, zeta, participation] = errors(&identify_forced(&record, &stated).unwrap(), &modes);
    assert!(f < 1e-5 && zeta < 1e-3 && participation < 1e-3);
}

/// Millimetres of an input are as plain as metres: a position of the base.
#[test]
fn an_input_in_millimetres_is_a_position_of_the_base() {
    let modes = [Mode { frequency_hz: 4.0, damping_ratio: 0.02, participation: 0.7 }];
    let (time_s, clean) = clean_sweep(Sweep::Linear, &modes, 2);
    let position = time_s.iter().map(|t| 1e3 * Sweep::Linear.position(*t)).collect();
    let tip = clean.iter().map(|y| 1e3 * y).collect();
    let record = Recording::new("mm", time_s).with_column("ref_mm", position).with_column("tip_mm", tip);
    let [f, zeta, participation] =
        errors(&identify_forced(&record, &ForcedOptions::new("ref_mm", "tip_mm")).unwrap(), &modes);
    assert!(f < 1e-5 && zeta < 1e-3 && participation < 1e-3, "{f} {zeta} {participation}");
}
