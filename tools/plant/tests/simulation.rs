//! Simulation against independent integration, closed forms and conservation laws.

use crate::support;

use std::f64::consts::PI;

use stillbeam_plant::modes::coupled_modes;
use stillbeam_plant::{
    BeamDamping, BeamSignal, Hold, Input, ModalState, Model, PlantError, PrescribedBase, Quantity,
    ServoDrive, SimulateOptions, free_decay, simulate, simulate_with,
};
use stillbeam_recording::Recording;

use support::{modal, mode, paper_beam, peak, smooth_move, ticks, worst};

/// Classical Runge-Kutta with `steps` steps per stretch; `f(x, u, slope)` is the right-hand side.
fn runge_kutta(
    mut x: Vec<f64>,
    time_s: &[f64],
    u: &[f64],
    steps: usize,
    f: impl Fn(&[f64], f64, f64) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let moved =
        |x: &[f64], k: &[f64], h: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + h * k).collect() };
    let mut states = vec![x.clone()];
    for index in 0..time_s.len() - 1 {
        let slope = (u[index + 1] - u[index]) / (time_s[index + 1] - time_s[index]);
        let h = (time_s[index + 1] - time_s[index]) / steps as f64;
        for step in 0..steps {
            let at = |offset: f64| u[index] + slope * h * (step as f64 + offset);
            let k1 = f(&x, at(0.0), slope);
            let k2 = f(&moved(&x, &k1, h / 2.0), at(0.5), slope);
            let k3 = f(&moved(&x, &k2, h / 2.0), at(0.5), slope);
            let k4 = f(&moved(&x, &k3, h), at(1.0), slope);
            for entry in 0..x.len() {
                x[entry] += h / 6.0 * (k1[entry] + 2.0 * k2[entry] + 2.0 * k3[entry] + k4[entry]);
            }
        }
        states.push(x.clone());
    }
    states
}

fn modes_of(model: &Model) -> Vec<stillbeam_plant::Mode> {
    PrescribedBase::new(model, 1000.0, 0.0).unwrap().modes().to_vec()
}

#[test]
fn ideal_base_motion_agrees_with_runge_kutta() {
    let model = Model::BeamOnBase(paper_beam());
    let time_s = ticks(600, 200.0);
    let base_m = smooth_move(&time_s, 0.5);
    let result =
        simulate(&model, &Recording::new("move", time_s.clone()).with_column("setpoint_m", base_m.clone()))
            .unwrap();
    let modes = modes_of(&model);
    // In absolute coordinates v = q + y, where a polygon of positions is a harmless input:
    // v'' = -2 zeta omega (v' - y') - omega^2 (v - y).
    let states = runge_kutta(vec![0.0; 4], &time_s, &base_m, 40, |x, y, slope| {
        let mut rate = Vec::new();
        for (pair, mode) in x.chunks(2).zip(&modes) {
            let (omega, decay) = (mode.omega_rad_s(), mode.decay_per_s());
            rate.push(pair[1]);
            rate.push(-2.0 * decay * (pair[1] - slope) - omega * omega * (pair[0] - y));
        }
        rate
    });
    let expected: Vec<f64> = states
        .iter()
        .zip(&base_m)
        .map(|(x, y)| {
            let modes = modes.iter().enumerate();
            modes.map(|(r, mode)| mode.participation[0] * (x[2 * r] - y)).sum()
        })
        .collect();
    let found = result.column("tip_deflection_m").unwrap();
    assert!(peak(found) > 0.02);
    let error = worst(found, &expected);
    assert!(error < 1e-9 * peak(found), "{error:e}");
    assert_eq!(result.column("base_position_m").unwrap(), base_m);
    assert_eq!(result.column_names(), ["time_s", "setpoint_m", "tip_deflection_m", "base_position_m"]);
}

#[test]
fn servo_driven_base_agrees_with_runge_kutta() {
    let mut beam = paper_beam();
    beam.outputs = BeamSignal::ALL.to_vec();
    for (bandwidth_hz, damping_ratio) in [(30.0, 0.707), (5.0, 0.3), (12.0, 1.5)] {
        let drive = ServoDrive { bandwidth_hz, damping_ratio };
        beam.drive = Some(drive);
        let model = Model::BeamOnBase(beam.clone());
        let time_s = ticks(400, 200.0);
        // Start away from zero: the plant must be at rest there.
        let setpoint_m: Vec<f64> = smooth_move(&time_s, 0.3).iter().map(|y| 0.2 + y).collect();
        let recording = Recording::new("move", time_s.clone()).with_column("setpoint_m", setpoint_m.clone());
        let result = simulate(&model, &recording).unwrap();
        let modes = modes_of(&model);
        let omega_d = drive.natural_frequency_rad_s();
        let initial = vec![0.2, 0.0, 0.0, 0.0, 0.0, 0.0];
        let states = runge_kutta(initial, &time_s, &setpoint_m, 40, |x, u, _| {
            let acceleration = omega_d * omega_d * (u - x[0]) - 2.0 * damping_ratio * omega_d * x[1];
            let mut rate = vec![x[1], acceleration];
            for (pair, mode) in x[2..].chunks(2).zip(&modes) {
                let omega = mode.omega_rad_s();
                rate.push(pair[1]);
                rate.push(-acceleration - 2.0 * mode.decay_per_s() * pair[1] - omega * omega * pair[0]);
            }
            rate
        });
        let base: Vec<f64> = states.iter().map(|x| x[0]).collect();
        let tip: Vec<f64> = states
            .iter()
            .map(|x| modes[0].participation[0] * x[2] + modes[1].participation[0] * x[4])
            .collect();
        let found = result.column("tip_deflection_m").unwrap();
        let error = worst(found, &tip);
        assert!(error < 1e-8 * peak(&tip), "{error:e}");
        assert!(worst(result.column("base_position_m").unwrap(), &base) < 1e-9);
        let position: Vec<f64> = base.iter().zip(&tip).map(|(y, w)| y + w).collect();
        assert!(worst(result.column("tip_position_m").unwrap(), &position) < 1e-9);
    }
}

#[test]
fn the_servo_has_the_bandwidth_it_is_named_for() {
    for damping_ratio in [0.05, 0.4, 0.707, 1.0, 3.0, 50.0] {
        let drive = ServoDrive { bandwidth_hz: 12.0, damping_ratio };
        let ratio = 2.0 * PI * 12.0 / drive.natural_frequency_rad_s();
        let gain = 1.0 / (1.0 - ratio * ratio).hypot(2.0 * damping_ratio * ratio);
        assert!((gain * gain - 0.5).abs() < 1e-12, "{damping_ratio}: {gain}");
    }
}

#[test]
fn a_force_on_the_base_agrees_with_runge_kutta_on_the_coupled_modes() {
    let mut beam = paper_beam();
    beam.input = Some(Input { column: "force_N".to_owned(), gain: 2.0, hold: None, noise_rms: None });
    beam.base_viscous_n_s_m = 3.0;
    let coupled = coupled_modes(&beam).unwrap();
    let model = Model::BeamOnBase(beam);
    let time_s = ticks(500, 100.0);
    let force_n: Vec<f64> = time_s.iter().map(|t| (2.0 * PI * 1.3 * t * t.sqrt()).sin()).collect();
    let recording = Recording::new("f", time_s.clone()).with_column("force_N", force_n.clone());
    let derivative = |x: &[f64], u: f64| -> Vec<f64> {
        let mut rate = x[3..].to_vec();
        for row in 0..3 {
            let damping: f64 = (0..3).map(|c| coupled.damping_per_s[(row, c)] * x[3 + c]).sum();
            rate.push(2.0 * coupled.base[row] * u - damping - coupled.omega_rad_s[row].powi(2) * x[row]);
        }
        rate
    };
    for hold in [Hold::FirstOrder, Hold::ZeroOrder] {
        let options = SimulateOptions { hold, ..SimulateOptions::default() };
        let result = simulate_with(&model, &recording, &options).unwrap();
        let states = runge_kutta(vec![0.0; 6], &time_s, &force_n, 40, |x, u, slope| {
            if hold == Hold::FirstOrder {
                return derivative(x, u);
            }
            // The value at the start of the stretch: walk back along the slope the helper supplies.
            derivative(x, nearest_sample_before(u, slope, &force_n, &time_s))
        });
        for (column, shape) in
            [("tip_deflection_m", &coupled.tip_deflection), ("base_position_m", &coupled.base)]
        {
            let expected: Vec<f64> = states.iter().map(|x| (0..3).map(|r| shape[r] * x[r]).sum()).collect();
            let error = worst(result.column(column).unwrap(), &expected);
            assert!(error < 1e-8 * peak(&expected), "{hold:?} {column}: {error:e}");
        }
    }
}

/// The sample that starts the stretch on which the line has this value and slope.
fn nearest_sample_before(u: f64, slope: f64, samples: &[f64], time_s: &[f64]) -> f64 {
    let stretch = (0..samples.len() - 1).find(|&i| {
        let this = (samples[i + 1] - samples[i]) / (time_s[i + 1] - time_s[i]);
        let (low, high) = (samples[i].min(samples[i + 1]), samples[i].max(samples[i + 1]));
        this == slope && (low - 1e-12..=high + 1e-12).contains(&u)
    });
    samples[stretch.unwrap()]
}

#[test]
fn a_force_moves_the_centre_of_mass_as_newton_says() {
    let mut beam = paper_beam();
    beam.input = Some(Input::new("force_N"));
    let coupled = coupled_modes(&beam).unwrap();
    let model = Model::BeamOnBase(beam);
    let time_s = ticks(2001, 1000.0);
    let force = vec![1.5; time_s.len()];
    let recording = Recording::new("f", time_s).with_column("force_N", force);
    let result = simulate(&model, &recording).unwrap();
    let base = result.column("base_position_m").unwrap();
    // The flexible modes only wobble about ½ a t².
    let total_kg = 1.0 / coupled.base[0].powi(2);
    assert!((total_kg - 2.709).abs() < 0.005, "{total_kg}");
    let expected = 0.5 * 1.5 / total_kg * 4.0;
    let wobble: f64 = (1..3).map(|r| 2.0 * 1.5 * (coupled.base[r] / coupled.omega_rad_s[r]).powi(2)).sum();
    assert!((base[2000] - expected).abs() <= wobble, "{} {expected} {wobble}", base[2000]);
}

#[test]
fn without_damping_energy_is_kept_for_a_minute() {
    let mut beam = paper_beam();
    beam.beam.damping = BeamDamping::Ratios(vec![0.0, 0.0]);
    let model = Model::BeamOnBase(beam);
    for rate_hz in [200.0, 10_000.0] {
        let mut plant = PrescribedBase::new(&model, rate_hz, 0.0).unwrap();
        let modes = plant.modes().to_vec();
        plant.step(0.01);
        plant.step(0.01);
        let energy = |plant: &PrescribedBase| -> Vec<f64> {
            let states = plant.modal_states();
            let pairs = states.iter().zip(&modes);
            pairs.map(|(s, m)| s.velocity.powi(2) + (m.omega_rad_s() * s.displacement).powi(2)).collect()
        };
        let before = energy(&plant);
        for _ in 0..(60.0 * rate_hz) as usize {
            plant.step(0.01);
        }
        for (before, after) in before.iter().zip(energy(&plant)) {
            let drift = after / before - 1.0;
            assert!(drift.abs() < 1e-9, "{rate_hz} Hz: {drift:e}");
        }
    }
}

#[test]
fn a_step_of_the_base_gives_the_closed_form_response() {
    // A step spread over one tick, so short that it is an impulse pair of the acceleration: afterwards
    // q = -h e^(-zeta omega t) (cos omega_d t - zeta / sqrt(1 - zeta²) sin omega_d t).
    for (frequency_hz, zeta) in [(1.1, 0.0074), (6.9, 0.0033), (2.0, 0.3)] {
        let model = modal(
            vec![mode(frequency_hz, zeta, 1.0)],
            "base_position_m",
            "tip_deflection_m",
            Quantity::Position,
        );
        let modes = model.modes.clone();
        let rate_hz = 1e7;
        let mut plant = PrescribedBase::new(&Model::Modal(model), rate_hz, 0.3).unwrap();
        plant.step(0.35);
        for duration_s in [0.0, 0.01, 0.2, 1.0] {
            let mut plant = plant.clone();
            plant.hold(duration_s).unwrap();
            let (sine, cosine) = (modes[0].damped_omega_rad_s() * duration_s).sin_cos();
            let ratio = zeta / (1.0 - zeta * zeta).sqrt();
            let expected = -0.05 * (-modes[0].decay_per_s() * duration_s).exp() * (cosine - ratio * sine);
            // The tick lasts 1e-7 s: that much of a radian per omega.
            let tolerance = 0.05 * modes[0].omega_rad_s() / rate_hz;
            let found = plant.tip_deflection_m();
            assert!((found - expected).abs() < tolerance, "{frequency_hz} {duration_s}");
            assert_eq!(plant.base_position_m(), 0.35);
        }
    }
}

#[test]
fn two_steps_half_a_damped_period_apart_cancel() {
    // Zero vibration, eq. 30, with the half period a whole number of ticks: only rounding is left.
    for zeta in [0.0, 0.0033, 0.0074, 0.1, 0.5] {
        let half_period_ticks = 500;
        let rate_hz = 1000.0;
        let damped_hz = rate_hz / (2.0 * f64::from(half_period_ticks));
        let frequency_hz = damped_hz / (1.0_f64 - zeta * zeta).sqrt();
        let model =
            modal(vec![mode(frequency_hz, zeta, 1.5)], "setpoint_m", "tip_deflection_m", Quantity::Position);
        let modes = model.modes.clone();
        let mut plant = PrescribedBase::new(&Model::Modal(model), rate_hz, 0.0).unwrap();
        let k = (-zeta * PI / (1.0_f64 - zeta * zeta).sqrt()).exp();
        let first_m = 0.05 / (1.0 + k);
        let mut before = 0.0;
        for tick in 0..=half_period_ticks {
            plant.step(if tick < half_period_ticks { first_m } else { 0.05 });
            before = plant.modal_states()[0].envelope(&modes[0]).max(before);
        }
        let left = plant.modal_states()[0].envelope(&modes[0]);
        assert!(before > 0.02 * first_m);
        assert!(left < 1e-13 * before, "zeta {zeta}: {left:e} of {before:e}");
    }
}

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_position() {
    let time_s = ticks(4001, 2000.0);
    let dt = 1.0 / 2000.0;
    let smooth = smooth_move(&time_s, 1.5);
    for (input, quantities) in [
        ("motor_force_N", vec![Quantity::Velocity, Quantity::Acceleration]),
        ("base_position_m", vec![Quantity::Velocity]),
    ] {
        let modes = vec![mode(1.1, 0.05, 1.5), mode(6.9, 0.01, -0.8)];
        let run = |quantity| {
            let model = modal(modes.clone(), input, "sensor_m", quantity);
            let recording = Recording::new("m", time_s.clone()).with_column(input, smooth.clone());
            let result = simulate(&Model::Modal(model), &recording).unwrap();
            result.column("sensor_m").unwrap().to_vec()
        };
        let mut lower = run(Quantity::Position);
        for quantity in quantities {
            let found = run(quantity);
            let differences: Vec<f64> = lower.windows(3).map(|w| (w[2] - w[0]) / (2.0 * dt)).collect();
            let error = worst(&found[1..4000], &differences);
            assert!(error < 2e-4 * peak(&found), "{input} {quantity:?}: {error:e}");
            lower = found;
        }
    }
}

#[test]
fn free_decay_is_the_closed_form() {
    let beam = paper_beam();
    let model = Model::BeamOnBase(beam);
    let modes = modes_of(&model);
    let initial = [
        ModalState { displacement: 0.01, velocity: 0.02 },
        ModalState { displacement: -0.001, velocity: 0.1 },
    ];
    let time_s: Vec<f64> = (0..500).map(|i| 0.01 * f64::from(i)).collect();
    let result = free_decay(&model, &initial, time_s.clone()).unwrap();
    let expected: Vec<f64> = time_s
        .iter()
        .map(|&t| {
            let pairs = initial.iter().zip(&modes);
            pairs.map(|(state, mode)| mode.participation[0] * state.after(mode, t)).sum()
        })
        .collect();
    assert!(worst(result.column("tip_deflection_m").unwrap(), &expected) < 1e-13);
    assert!(matches!(
        free_decay(&model, &initial[..1], time_s),
        Err(PlantError::InitialStates { modes: 2, found: 1 })
    ));
    assert!(matches!(free_decay(&model, &initial, vec![0.0, 1.0, 0.5, 2.0]), Err(PlantError::Recording(_))));
}
