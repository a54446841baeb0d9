//! Laws of the drive and of the sensor, sensors, and a controller in closed loop, against closed forms.

use crate::support;

use std::f64::consts::{PI, TAU};
use std::num::NonZeroU8;

use stillbeam_plant::{
    Feedback, Hold, Model, Physics, PlantError, Sensor, SensorKind, SimulateOptions, simulate, simulate_with,
};
use stillbeam_recording::Recording;

use support::model_texts::with;
use support::oscillator::oscillator;
use support::{paper_beam, peak, ticks, worst};

/// A modal model whose two outputs both see the same mode, driven by a force.
fn two_outputs(physics: Vec<Physics>) -> Model {
    let text = "schema = 1\nkind = \"modal\"\n[[mode]]\nfrequency_hz = 2.0\ndamping_ratio = 0.05\nparticipation = [1.0, 1.0]\n\
        [input]\ncolumn = \"force_N\"\n[[output]]\ncolumn = \"seen_m\"\n[[output]]\ncolumn = \"true_m\"\n";
    let mut model = Model::from_toml("m", text).unwrap();
    model.setup_mut().physics = physics;
    model
}

fn run(model: &Model, time_s: &[f64], column: &str, input: impl Fn(f64) -> f64) -> Recording {
    let samples = time_s.iter().map(|t| input(*t)).collect();
    simulate(model, &Recording::new("r", time_s.to_vec()).with_column(column, samples)).unwrap()
}

fn chirp(t: f64) -> f64 {
    200.0 * (2.0 * t + 0.9 * t * t).sin()
}

#[test]
fn timing_laws_read_the_true_output_at_other_times() {
    let dense_s = ticks(8001, 1000.0);
    let truth = run(&two_outputs(vec![]), &dense_s, "force_N", chirp);
    let truth = truth.column("true_m").unwrap();
    // The same polygon at every tick, looked at every tenth.
    let at = |t: f64| {
        let place = (t.max(0.0) * 1000.0).min(7_999.999_999);
        let (index, part) = (place.floor() as usize, place.fract());
        truth[index] + part * (truth[index + 1] - truth[index])
    };
    type Expected<'a> = Box<dyn Fn(f64) -> f64 + 'a>;
    let cases: Vec<(Physics, Expected<'_>)> = vec![
        (Physics::new("delay", "sensor").with("delay", 0.0123), Box::new(|t| at(t - 0.0123))),
        (Physics::new("clock_skew", "sensor").with("skew", 0.002), Box::new(|t| at(t / 1.002))),
        (
            Physics::new("exposure_blur", "sensor").with("exposure", 0.03),
            Box::new(|t| (0..300).map(|i| at(t - 1e-4 * (f64::from(i) + 0.5))).sum::<f64>() / 300.0),
        ),
    ];
    for (physics, expected) in cases {
        let id = physics.id.clone();
        let result = run(&two_outputs(vec![physics]), &dense_s, "force_N", chirp);
        assert!(
            worst(result.column("true_m").unwrap(), truth) < 1e-12 * peak(truth),
            "{id}: the other output is left alone"
        );
        let expected: Vec<f64> = dense_s.iter().map(|t| expected(*t)).collect();
        let error = worst(result.column("seen_m").unwrap(), &expected);
        // The truth between its ticks is a straight line: h² y''/8 off.
        assert!(error < 5e-5 * peak(truth), "{id}: {error:e} of {:e}", peak(truth));
        assert!(worst(&expected, truth) > 1e-2 * peak(truth), "{id} matters here");
    }
}

/// Before the first sample the output stands still.
#[test]
fn a_reading_is_the_mean_over_its_exposure_however_short_or_long_that_is() {
    let (time_s, rate_hz) = (ticks(4001, 1000.0), 1000.0);
    let truth = run(&two_outputs(vec![]), &time_s, "force_N", chirp);
    let truth = truth.column("true_m").unwrap();
    let mean = |index: usize, exposure_s: f64| {
        let samples = (exposure_s * rate_hz).round() as usize;
        let back = |before: usize| truth[index.saturating_sub(before)];
        let inner: f64 = (1..samples).map(back).sum();
        (inner + 0.5 * (back(0) + back(samples))) / samples as f64
    };
    for exposure_s in [0.001, 0.002, 0.25, 3.0, 30.0] {
        let physics = Physics::new("exposure_blur", "sensor").with("exposure", exposure_s);
        let seen = run(&two_outputs(vec![physics]), &time_s, "force_N", chirp);
        let seen = seen.column("seen_m").unwrap();
        for index in [1, 17, 1600, 3999, 4000] {
            // Trapezia are h² y''/12 off.
            let error = (seen[index] - mean(index, exposure_s)).abs();
            assert!(error < 2e-5 * peak(truth), "{exposure_s} s, sample {index}: {error:e}");
        }
    }
}

/// Beside a time of seconds an exposure may be too short for a number to hold both.
#[test]
fn an_exposure_that_rounds_to_nothing_reads_the_output_itself() {
    let time_s = ticks(101, 100.0);
    for exposure_s in [0.0, 1e-300, 1e-18] {
        let physics = Physics::new("exposure_blur", "sensor").with("exposure", exposure_s);
        let seen = run(&two_outputs(vec![physics]), &time_s, "force_N", chirp);
        let (seen, truth) = (seen.column("seen_m").unwrap(), seen.column("true_m").unwrap());
        let largest = peak(truth);
        let is_same = |(seen, truth): (&f64, &f64)| (seen - truth).abs() < 1e-12 * largest;
        assert!(seen.iter().zip(truth).all(is_same), "{exposure_s} s");
    }
}

#[test]
fn a_long_exposure_weakens_and_delays_a_tone_as_the_sinc_says() {
    let exposure = 0.02;
    let time_s = ticks(2000, 100.0);
    let laws = |exposure| vec![Physics::new("exposure_blur", "sensor").with("exposure", exposure)];
    // Off resonance and long after the start there is a tone only.
    let frequency = 11.0;
    let tone = |t: f64| 1e3 * (TAU * frequency * t).sin();
    let fine_s = ticks(20_000, 1000.0);
    let seen = run(&two_outputs(laws(exposure)), &fine_s, "force_N", tone);
    let (seen, truth) = (seen.column("seen_m").unwrap(), seen.column("true_m").unwrap());
    let phasor = |samples: &[f64]| {
        let pairs = fine_s.iter().zip(samples).skip(10_000);
        pairs.fold((0.0, 0.0), |(c, s), (t, y)| {
            let (sine, cosine) = (TAU * frequency * t).sin_cos();
            (c + y * cosine, s + y * sine)
        })
    };
    let ((c1, s1), (c0, s0)) = (phasor(seen), phasor(truth));
    let ratio = c1.hypot(s1) / c0.hypot(s0);
    let late = (s0.atan2(c0) - s1.atan2(c1)).rem_euclid(TAU);
    let late = if late > PI { TAU - late } else { late };
    let x = PI * frequency * exposure;
    assert!((ratio - x.sin() / x).abs() < 2e-3, "{ratio} {}", x.sin() / x);
    assert!((late - x).abs() < 5e-3, "{late} {x}");
    assert!(time_s.len() == 2000);
}

#[test]
fn static_sensor_laws_are_what_they_say() {
    let time_s = ticks(800, 200.0);
    let read = |physics: Physics| {
        let result = run(&two_outputs(vec![physics]), &time_s, "force_N", chirp);
        (result.column("seen_m").unwrap().to_vec(), result.column("true_m").unwrap().to_vec())
    };
    let (seen, truth) = read(Physics::new("saturation", "sensor").with("limit", 0.3));
    assert!(seen.iter().zip(&truth).all(|(s, y)| *s == y.clamp(-0.3, 0.3)) && peak(&truth) > 0.4);
    let (seen, truth) = read(Physics::new("quantisation", "sensor").with("step", 0.05));
    assert!(
        seen.iter()
            .zip(&truth)
            .all(|(s, y)| (s - y).abs() <= 0.025 + 1e-12 && ((s / 0.05).round() * 0.05 - s).abs() < 1e-15)
    );
    let (seen, truth) =
        read(Physics::new("nonlinearity", "sensor").with("quadratic", 0.2).with("cubic", -0.5));
    assert!(seen.iter().zip(&truth).all(|(s, y)| (s - (y + 0.2 * y * y - 0.5 * y * y * y)).abs() < 1e-14));
    let (seen, truth) = read(Physics::new("rectification", "sensor").with("share", 1.0));
    assert!(seen.iter().zip(&truth).all(|(s, y)| *s == y.abs()));
    let mut beam = paper_beam();
    beam.setup.physics = vec![Physics::new("crosstalk", "sensor").with("share", 0.1)];
    let model = Model::BeamOnBase(beam.clone());
    beam.setup.physics.clear();
    let motion = |t: f64| 0.01 * (3.0 * t).sin();
    let (with_it, without) = (
        run(&model, &time_s, "setpoint_m", motion),
        run(&Model::BeamOnBase(beam), &time_s, "setpoint_m", motion),
    );
    let pairs =
        with_it.column("tip_deflection_m").unwrap().iter().zip(without.column("tip_deflection_m").unwrap());
    assert!(pairs.zip(&time_s).all(|((a, b), t)| (a - b - 0.1 * motion(*t)).abs() < 1e-12));
}

#[test]
fn drive_laws_are_what_they_say() {
    // A free mass integrates twice: its velocity shows the force.
    let velocity = |physics: Vec<Physics>, force: &dyn Fn(f64) -> f64| {
        let model = oscillator(1.0, 0.0, 0.0, physics, 0.0, 0.0);
        let time_s = ticks(2001, 1000.0);
        let result = support::oscillator::run(&model, &time_s, force);
        result.column("v_m_s").unwrap().to_vec()
    };
    let law = |id: &str, name: &str, value: f64| vec![Physics::new(id, "drive").with(name, value)];
    let constant = |_: f64| 3.0;
    let tone = |t: f64| (5.0 * t).sin();
    let last = |v: Vec<f64>| v[2000];
    assert!((last(velocity(law("saturation", "limit", 2.0), &constant)) - 4.0).abs() < 1e-9);
    assert!((last(velocity(law("dead_zone", "threshold", 2.5), &constant)) - 1.0).abs() < 1e-9);
    assert!((last(velocity(law("gain_nonlinearity", "quadratic", 0.1), &constant)) - 7.8).abs() < 1e-9);
    assert!((last(velocity(law("gain_nonlinearity", "cubic", 0.1), &constant)) - 11.4).abs() < 1e-9);
    let delayed = last(velocity(law("dead_time", "delay", 0.5), &tone));
    assert!((delayed - (1.0 - (5.0_f64 * 1.5).cos()) / 5.0).abs() < 1e-5, "{delayed}");
    // First-order lag of a sine from rest: amplitude and phase of 1/(1 + i w T), and a transient.
    let (w, lag) = (5.0_f64, 0.2_f64);
    let lagged = velocity(law("servo_lag", "time_constant", lag), &tone);
    let shape = |t: f64| {
        let size = 1.0 / (1.0 + (w * lag).powi(2));
        size * ((w * t).sin() - w * lag * (w * t).cos() + w * lag * (-t / lag).exp())
    };
    let (mut sum, mut error) = (0.0, 0.0_f64);
    for tick in 0..2000 {
        let t = f64::from(tick) / 1000.0;
        sum += (shape(t) + 4.0 * shape(t + 5e-4) + shape(t + 1e-3)) / 6000.0;
        error = error.max((lagged[tick as usize + 1] - sum).abs());
    }
    assert!(error < 1e-5, "{error:e}");
    // Ripple: over whole periods of the way it does no work, whatever the speed.
    let ripple = Physics::new("force_ripple", "drive").with("ripple", 0.2).with("period", 0.05);
    let model = oscillator(1.0, 0.0, 0.0, vec![ripple], 0.0, 0.0);
    let result = support::oscillator::run(&model, &ticks(2001, 1000.0), |_| 1.0);
    for (z, v) in result.column("z_m").unwrap().iter().zip(result.column("v_m_s").unwrap()) {
        let expected = z + 0.2 * 0.05 / TAU * (1.0 - (TAU * z / 0.05).cos());
        assert!((0.5 * v * v - expected).abs() < 2e-4 * z.max(0.01), "{z}: {v}");
    }
}

#[test]
fn a_drive_with_limits_in_its_section_is_the_same_as_with_laws() {
    let base = "schema = 1\nkind = \"modal\"\n[[mode]]\nfrequency_hz = 1.1\ndamping_ratio = 0.01\nparticipation = [1.5]\n\
        [input]\ncolumn = \"setpoint_m\"\n[[output]]\ncolumn = \"tip_deflection_m\"\n";
    let time_s = ticks(600, 100.0);
    let motion = |t: f64| 0.05 * (2.0 * t).sin();
    let section = Model::from_toml(
        "m",
        &format!("{base}[drive]\nbandwidth_hz = 10\ndead_time_s = 0.03\nlimit = 0.03\n"),
    )
    .unwrap();
    let mut laws = Model::from_toml("m", &format!("{base}[drive]\nbandwidth_hz = 10\n")).unwrap();
    laws.setup_mut().physics = vec![
        Physics::new("dead_time", "drive").with("delay", 0.03),
        Physics::new("saturation", "drive").with("limit", 0.03),
    ];
    let (a, b) = (run(&section, &time_s, "setpoint_m", motion), run(&laws, &time_s, "setpoint_m", motion));
    assert_eq!(a.column("tip_deflection_m").unwrap(), b.column("tip_deflection_m").unwrap());
    // A motor that cannot accelerate: a step of the setpoint becomes two parabolas.
    let text = "schema = 1\nkind = \"beam_on_base\"\n[beam]\nlength_m = 0.9\ndensity_kg_m3 = 8190.0\nyoung_Pa = 190e9\n\
        width_m = 0.02\nthickness_m = 0.001\nmodes = 1\ndamping_ratio = [0.01]\n[base]\nmass_kg = 2.5\n\
        [drive]\nbandwidth_hz = 40\nacceleration_limit_m_s2 = 2.0\n[input]\ncolumn = \"setpoint_m\"\n\
        [[output]]\ncolumn = \"base_position_m\"\n[[output]]\ncolumn = \"tip_deflection_m\"\n";
    let model = Model::from_toml("m", text).unwrap();
    let stepped = run(&model, &ticks(500, 1000.0), "setpoint_m", |t| if t > 0.0 { 0.1 } else { 0.0 });
    let base_m = stepped.column("base_position_m").unwrap();
    // The leap of the setpoint itself, 0.1 m in a millisecond, is coarse for the sub-steps; what follows is
    // not.
    for (from, to) in [(50_usize, 100_usize), (60, 90)] {
        let expected = (to as f64 / 1000.0).powi(2) - (from as f64 / 1000.0).powi(2);
        let way = base_m[to] - base_m[from];
        assert!((way / expected - 1.0).abs() < 1e-3, "{way} {expected}");
    }
    let ideal = with(text, "bandwidth_hz = 40\n", "");
    let error = simulate(
        &Model::from_toml("m", &ideal).unwrap(),
        &Recording::new("r", ticks(10, 100.0)).with_column("setpoint_m", vec![0.0; 10]),
    );
    assert!(matches!(error, Err(PlantError::Invalid(_))));
}

#[test]
fn play_between_servo_and_base_loses_its_gap() {
    let mut beam = paper_beam();
    beam.drive = Some(stillbeam_plant::ServoDrive { bandwidth_hz: 50.0, damping_ratio: 0.7 });
    for drive in [None, beam.drive] {
        beam.drive = drive;
        beam.setup.physics = vec![Physics::new("backlash", "base").with("gap", 0.004)];
        let result = run(&Model::BeamOnBase(beam.clone()), &ticks(4000, 200.0), "setpoint_m", |t| {
            0.01 * (0.5 * t).sin()
        });
        let base = result.column("base_position_m").unwrap();
        assert!((peak(&base[1000..]) - 0.008).abs() < 2e-6, "{}", peak(&base[1000..]));
    }
}

#[test]
fn sensors_have_a_rate_a_delay_noise_and_counts() {
    let mut model = two_outputs(vec![]);
    let time_s = ticks(4000, 1000.0);
    let clean = run(&model, &time_s, "force_N", chirp);
    let clean = clean.column("true_m").unwrap();
    model.setup_mut().sensors = vec![
        Sensor { rate_hz: Some(100.0), delay_s: 0.02, noise_rms: 1e-3, seed: 4, ..Sensor::ideal("seen_m") },
        Sensor { kind: SensorKind::Encoder, quantum: 1e-3, ..Sensor::ideal("true_m") },
    ];
    let recording = Recording::new("r", time_s.clone())
        .with_column("force_N", time_s.iter().map(|t| chirp(*t)).collect());
    let noisy = SimulateOptions { sensor_noise: true, ..SimulateOptions::default() };
    let (quiet, noisy) =
        (simulate(&model, &recording).unwrap(), simulate_with(&model, &recording, &noisy).unwrap());
    let mut errors = Vec::new();
    for (tick, (mean, seen)) in
        quiet.column("seen_m").unwrap().iter().zip(noisy.column("seen_m").unwrap()).enumerate()
    {
        assert_eq!(mean.is_nan(), tick % 10 != 0, "{tick}");
        if !mean.is_nan() {
            assert!((mean - clean[tick.saturating_sub(20)]).abs() < 1e-6);
            errors.push((seen - mean).powi(2));
        }
    }
    let rms = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
    assert!((rms / 1e-3 - 1.0).abs() < 0.15, "{rms}");
    let counts = quiet.column("true_m").unwrap();
    assert!(counts.iter().zip(clean).all(|(count, y)| (count - y).abs() <= 0.5e-3 + 1e-12));
}

#[test]
fn two_sensors_with_one_seed_have_noise_of_their_own() {
    let mut model = two_outputs(vec![]);
    let time_s = ticks(4000, 1000.0);
    let of = |column: &str| Sensor { noise_rms: 1e-3, seed: 4, ..Sensor::ideal(column) };
    model.setup_mut().sensors = vec![of("seen_m"), of("true_m")];
    let still = Recording::new("r", time_s.clone()).with_column("force_N", vec![0.0; time_s.len()]);
    let noisy = SimulateOptions { sensor_noise: true, ..SimulateOptions::default() };
    let read = simulate_with(&model, &still, &noisy).unwrap();
    let [a, b] = ["seen_m", "true_m"].map(|column| read.column(column).unwrap());
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let correlation = product(a, b) / (product(a, a) * product(b, b)).sqrt();
    assert!(correlation.abs() < 0.06, "{correlation}");
}

#[test]
fn a_closed_loop_is_what_the_controller_makes_of_it() {
    closed_loop_by_hand(None);
    closed_loop_by_hand(NonZeroU8::new(1));
    closed_loop_by_hand(NonZeroU8::new(3));
}

/// A mass under the cascade controller, stepped by hand: constant force over each period, exactly.
fn closed_loop_by_hand(velocity_samples: Option<NonZeroU8>) {
    let mut model = oscillator(2.0, 0.0, 0.0, vec![], 0.0, 0.0);
    let sample_s = 0.004;
    let controller = stillbeam_plant::Controller {
        kp: 15.0,
        kv: 30.0,
        sample_s,
        reference_column: "reference_m".to_owned(),
        limit: Some(1.2),
        velocity_samples,
    };
    model.setup_mut().controller = Some(controller);
    let reference = |t: f64| 0.05 * (2.0 * t).sin();
    // Stamps that do not fall on the controller's.
    let time_s: Vec<f64> = (0..900).map(|i| 0.0031 * f64::from(i)).collect();
    let recording = Recording::new("r", time_s.clone())
        .with_column("reference_m", time_s.iter().map(|t| reference(*t)).collect())
        .with_column("force_N", vec![0.0; 900]);
    let closed = simulate(&model, &recording).unwrap();
    // The reference between its stamps is a line.
    let given = |t: f64| {
        let place = (t / 0.0031).min(898.999_999);
        let (index, part) = (place.floor() as usize, place.fract());
        reference(time_s[index]) * (1.0 - part) + reference(time_s[index + 1]) * part
    };
    let (mut z, mut v, mut now, mut u) = (0.0, 0.0, 0.0_f64, 0.0);
    let mut next_renewal = 0;
    let mut clipped = 0;
    let mut positions = vec![];
    for (index, stamp_s) in time_s.iter().enumerate() {
        loop {
            let renewal_s = sample_s * f64::from(next_renewal);
            let until_s = renewal_s.min(*stamp_s);
            let dt = until_s - now;
            (z, v, now) = (z + v * dt + 0.25 * u * dt * dt, v + 0.5 * u * dt, until_s);
            if renewal_s > *stamp_s - 1e-12 {
                break;
            }
            positions.push(z);
            let ago = |samples: usize| positions.iter().rev().nth(samples).copied().unwrap_or(0.0);
            let measured = velocity_samples.map_or(v, |samples| {
                (z - ago(usize::from(samples.get()))) / (f64::from(samples.get()) * sample_s)
            });
            let asked: f64 = 30.0 * (15.0 * (given(renewal_s) - z) - measured);
            clipped += usize::from(asked.abs() > 1.2);
            u = asked.clamp(-1.2, 1.2);
            next_renewal += 1;
        }
        let found = closed.column("z_m").unwrap()[index];
        assert!((found - z).abs() < 1e-9, "{stamp_s}: {found} {z}");
    }
    assert!(clipped > 3 && clipped < 600, "the limit is met, and left: {clipped}");
    let open = SimulateOptions { feedback: Feedback::Open, ..SimulateOptions::default() };
    let open = simulate_with(&model, &recording, &open).unwrap();
    assert_eq!(peak(open.column("z_m").unwrap()), 0.0, "the recorded force was zero");
    // The force that the loop made, fed back open, does the same.
    let replay = Recording::new("replay", (0..2000).map(|i| sample_s * f64::from(i) / 4.0).collect());
    let replay =
        replay.clone().with_column("reference_m", replay.time_s.iter().map(|t| reference(*t)).collect());
    let closed = simulate(&model, &replay).unwrap();
    let options =
        SimulateOptions { feedback: Feedback::Open, hold: Hold::ZeroOrder, ..SimulateOptions::default() };
    let again = simulate_with(&model, &closed, &options).unwrap();
    assert!(worst(again.column("z_m").unwrap(), closed.column("z_m").unwrap()) < 1e-9);
}

#[test]
fn outputs_at_another_rate_are_the_same_motion() {
    let law = Physics::new("coulomb_friction", "body").with("force", 0.4);
    let model = oscillator(1.0, 100.0, 0.3, vec![law], 0.0, 0.0);
    let time_s = ticks(501, 100.0);
    let recording = Recording::new("r", time_s.clone())
        .with_column("force_N", time_s.iter().map(|t| 2.0 * (8.0 * t).sin()).collect());
    let at_stamps = simulate(&model, &recording).unwrap();
    let options = SimulateOptions { output_rate_hz: Some(300.0), ..SimulateOptions::default() };
    let faster = simulate_with(&model, &recording, &options).unwrap();
    let every_third: Vec<f64> = faster.column("z_m").unwrap().iter().step_by(3).copied().collect();
    let expected = at_stamps.column("z_m").unwrap();
    assert!(worst(&every_third, expected) < 1e-9 * peak(expected).max(1.0));
}
