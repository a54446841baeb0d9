//! Residual vibration, settling time and overshoot, against numbers known beforehand.

use crate::support;

use std::f64::consts::PI;

use stillbeam_plant::{
    Model, Move, PlantError, PrescribedBase, Quantity, ResidualVibration, ServoDrive, measure_move,
};

use support::{modal, mode, paper_beam, peak};

const RATE_HZ: f64 = 4000.0;

fn plant(model: &Model) -> PrescribedBase {
    PrescribedBase::new(model, RATE_HZ, 0.0).unwrap()
}

/// Impulses of the paper's eqs. 30 to 32 for one mode: amplitude and time.
fn impulses(mode: &stillbeam_plant::Mode, order: i32, detune: f64) -> Vec<(f64, f64)> {
    let zeta = mode.damping_ratio;
    let k = (-zeta * PI / (1.0 - zeta * zeta).sqrt()).exp();
    let half_s = PI / (mode.damped_omega_rad_s() * detune);
    let binomial = [vec![1.0, 1.0], vec![1.0, 2.0, 1.0], vec![1.0, 3.0, 3.0, 1.0]];
    let row = &binomial[order as usize - 1];
    (0..).zip(row).map(|(i, c)| (c * k.powi(i) / (1.0 + k).powi(order), half_s * f64::from(i))).collect()
}

/// A 50 mm move in straight lines through the impulses, each time rounded to nothing: positions at the ticks
/// of a sum of 0.2 s ramps.
fn shaped_move(impulses: &[(f64, f64)]) -> Vec<f64> {
    let ticks = (4.0 * RATE_HZ) as usize;
    (0..ticks)
        .map(|tick| {
            let t = tick as f64 / RATE_HZ;
            let ramp = |t: f64| 0.05 * (t / 0.2).clamp(0.0, 1.0);
            impulses.iter().map(|(a, at)| a * ramp(t - at)).sum()
        })
        .collect()
}

/// `V = e^(-zeta omega t_n) |Σ A_i e^(s t_i)|`, the literature's residual vibration.
fn expected_v(mode: &stillbeam_plant::Mode, impulses: &[(f64, f64)]) -> f64 {
    let (decay, damped) = (mode.decay_per_s(), mode.damped_omega_rad_s());
    let sum = |part: fn(f64) -> f64| -> f64 {
        impulses.iter().map(|(a, t)| a * (decay * t).exp() * part(damped * t)).sum()
    };
    let last_s = impulses.last().unwrap().1;
    (-decay * last_s).exp() * sum(f64::cos).hypot(sum(f64::sin))
}

#[test]
fn percentage_vibration_of_a_detuned_shaper_is_that_of_the_literature() {
    let model = Model::BeamOnBase(paper_beam());
    let modes = plant(&model).modes().to_vec();
    let unshaped = ResidualVibration::after(plant(&model), &shaped_move(&[(1.0, 0.0)])).unwrap();
    assert_eq!(unshaped.end_tick, 800);
    for order in 1..=3 {
        for detune in [0.9, 0.95, 1.0, 1.05, 1.2] {
            let impulses = impulses(&modes[0], order, detune);
            let shaped = ResidualVibration::after(plant(&model), &shaped_move(&impulses)).unwrap();
            let found = shaped.relative_to(&unshaped);
            for (found, mode) in found.modes_pct.iter().zip(&modes) {
                let expected = 100.0 * expected_v(mode, &impulses);
                // Ends are rounded up to a tick, and ramps that begin between ticks are cut straight.
                assert!((found - expected).abs() < 0.02, "{order} {detune}: {found} {expected}");
            }
        }
    }
}

#[test]
fn the_tip_peak_is_the_peak_of_a_long_look_at_the_plant() {
    let mut beam = paper_beam();
    for drive in [None, Some(ServoDrive { bandwidth_hz: 20.0, damping_ratio: 0.7 })] {
        beam.drive = drive;
        let model = Model::BeamOnBase(beam.clone());
        let command = shaped_move(&[(1.0, 0.0)]);
        let residual = ResidualVibration::after(plant(&model), &command).unwrap();
        let mut plant = plant(&model);
        for &setpoint_m in &command[..=residual.end_tick] {
            plant.step(setpoint_m);
        }
        if let Some(drive) = drive {
            plant.hold(drive.settling_time_s(1e-9)).unwrap();
            assert!((plant.base_position_m() - 0.05).abs() < 1e-9 * 0.05);
        }
        let window = (ResidualVibration::WINDOW_PERIODS / 1.1 * RATE_HZ) as usize;
        let seen: Vec<f64> = (0..window).map(|_| plant.step(0.05)).collect();
        let ratio = residual.tip_peak_m / peak(&seen);
        assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
        let sum: f64 = residual.mode_amplitudes_m.iter().sum();
        assert!(residual.tip_peak_m <= sum * (1.0 + 1e-9));
    }
}

#[test]
fn an_envelope_bounds_the_vibration_and_decays_with_it() {
    let model = modal(vec![mode(2.0, 0.05, 1.0)], "setpoint_m", "tip_deflection_m", Quantity::Position);
    let mode = model.modes[0].clone();
    let mut plant = plant(&Model::Modal(model));
    plant.step(0.01);
    let start = plant.modal_states()[0];
    for tick in 1..8000 {
        plant.step(0.01);
        let time_s = f64::from(tick) / RATE_HZ;
        let envelope = plant.modal_states()[0].envelope(&mode);
        let expected = start.envelope(&mode) * (-mode.decay_per_s() * time_s).exp();
        assert!((envelope / expected - 1.0).abs() < 1e-10);
        assert!(plant.tip_deflection_m().abs() <= envelope * (1.0 + 1e-12));
    }
}

#[test]
fn a_standing_command_leaves_nothing() {
    let model = Model::BeamOnBase(paper_beam());
    let residual = ResidualVibration::after(plant(&model), &[0.0; 10]).unwrap();
    assert_eq!(residual.mode_amplitudes_m, [0.0, 0.0]);
    assert_eq!((residual.tip_peak_m, residual.end_tick), (0.0, 0));
    assert!(matches!(ResidualVibration::after(plant(&model), &[]), Err(PlantError::Measure { .. })));
}

#[test]
fn settling_and_overshoot_of_a_known_curve() {
    // Target 1 from 0; enters the band for good at sample 6 (t = 0.7), having left it once before.
    let time_s: Vec<f64> = (0..10).map(|i| 0.1 + 0.1 * f64::from(i)).collect();
    let tip = [0.0, 0.5, 0.99, 1.1, 1.01, 0.97, 0.985, f64::NAN, 1.0, 1.015];
    let command = Move::new(0.1, 0.0, 1.0);
    let found = measure_move(&time_s, &tip, &command).unwrap();
    assert!((found.settling_time_s.unwrap() - 0.6).abs() < 1e-12);
    assert!((found.overshoot_pct - 10.0).abs() < 1e-9);
    // The same backwards and elsewhere.
    let mirrored: Vec<f64> = tip.iter().map(|y| 3.0 - 2.0 * y).collect();
    let back = measure_move(&time_s, &mirrored, &Move::new(0.1, 3.0, 1.0)).unwrap();
    assert!((back.settling_time_s.unwrap() - 0.6).abs() < 1e-12);
    assert!((back.overshoot_pct - 10.0).abs() < 1e-9);
    // A wider band settles earlier, a narrower one not at all.
    let wide = Move { band: 0.2, ..command };
    let narrow = Move { band: 0.005, ..command };
    let settling = |command| measure_move(&time_s, &tip, &command).unwrap().settling_time_s;
    assert!((settling(wide).unwrap() - 0.2).abs() < 1e-12);
    assert_eq!(settling(narrow), None);
    // What came before the start does not count.
    let late = measure_move(&time_s, &tip, &Move::new(0.45, 0.0, 1.0)).unwrap();
    assert!((late.overshoot_pct - 1.5).abs() < 1e-9);
    // Never beyond: no overshoot.
    let short = measure_move(&[0.0, 1.0], &[0.0, 0.999], &Move::new(0.0, 0.0, 1.0)).unwrap();
    assert_eq!(short.overshoot_pct, 0.0);
}

#[test]
fn moves_that_cannot_be_measured_are_refused() {
    let refused = |time_s: &[f64], tip: &[f64], command: Move| {
        matches!(measure_move(time_s, tip, &command), Err(PlantError::Measure { .. }))
    };
    let command = Move::new(0.0, 0.0, 1.0);
    assert!(refused(&[0.0], &[0.0, 1.0], command));
    assert!(refused(&[], &[], command));
    assert!(refused(&[0.0, 1.0], &[f64::NAN, f64::NAN], command));
    assert!(refused(&[0.0, 1.0], &[0.0, 1.0], Move { to_m: 0.0, ..command }));
    assert!(refused(&[0.0, 1.0], &[0.0, 1.0], Move { to_m: f64::NAN, ..command }));
    assert!(refused(&[0.0, 1.0], &[0.0, 1.0], Move { band: 0.0, ..command }));
    assert!(refused(&[0.0, 1.0], &[0.0, 1.0], Move { start_s: 5.0, ..command }));
}
