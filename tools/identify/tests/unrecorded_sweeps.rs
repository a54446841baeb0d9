//! Sweeps whose input nobody recorded: random sweeps, modes, offsets, clocks and noise, and the pulses of a
//! motion controller.

use crate::synthetic;

use std::f64::consts::TAU;

use stillbeam_identify::{
    ForcedOptions, IdentifiedModes, IdentifyError, InputKind, SWEEP_COLUMN, SweepPlan, SweepShape,
    find_sweep, identify_forced,
};
use stillbeam_recording::Recording;
use synthetic::Noise;

const RATE_HZ: f64 = 800.0;

/// A machine that is shaken by a sweep, and how it is recorded.
#[derive(Debug, Clone)]
struct Shaken {
    plan: &'static str,
    shape: SweepShape,
    exponential: bool,
    from_hz: f64,
    to_hz: f64,
    sweep_s: f64,
    /// When the sweep begins on the recorder's clock, s; before 0 where the recorder was late.
    start_s: f64,
    record_s: f64,
    /// How much faster the recorder's clock goes, as a share.
    clock: f64,
    frequency_hz: f64,
    damping_ratio: f64,
    noise: f64,
}

impl Shaken {
    /// Frequency and periods at a time from the start.
    fn phase(&self, t: f64) -> [f64; 2] {
        if self.exponential {
            let k = (self.to_hz / self.from_hz).ln() / self.sweep_s;
            return [self.from_hz * (k * t).exp(), self.from_hz * (k * t).exp_m1() / k];
        }
        let k = (self.to_hz - self.from_hz) / self.sweep_s;
        [self.from_hz + k * t, self.from_hz * t + 0.5 * k * t * t]
    }

    /// The record of an accelerometer on the moving body: its absolute acceleration and noise.
    fn recorded(&self, seed: u64) -> Recording {
        const FINE: usize = 12;
        let h = 1.0 / (RATE_HZ * FINE as f64);
        let w = TAU * self.frequency_hz;
        let samples = (self.record_s * RATE_HZ) as usize;
        let (mut q, mut v) = (0.0_f64, 0.0_f64);
        let mut clean = Vec::with_capacity(samples);
        // The controller's walk from half period to half period: start, frequency and sign.
        let mut half = [0.0, self.from_hz, 1.0];
        let begin_s = self.start_s.min(0.0);
        let points = ((self.record_s - begin_s) / h) as usize;
        for k in 0..points {
            let t = begin_s + k as f64 * h;
            let since_s = t - self.start_s;
            let acceleration = if !(0.0..self.sweep_s).contains(&since_s) {
                0.0
            } else if self.shape == SweepShape::Pulses {
                while since_s >= half[0] + 0.5 / half[1] {
                    let next_s = half[0] + 0.5 / half[1];
                    half = [next_s, self.phase(next_s)[0], -half[2]];
                }
                let first = since_s < half[0] + 0.25 / half[1];
                half[1] * half[2] * if first { 1.0 } else { -1.0 }
            } else {
                let [hz, periods] = self.phase(since_s);
                let middle_hz = (self.from_hz * self.to_hz).sqrt();
                match self.shape {
                    SweepShape::Position => middle_hz * (hz / middle_hz).powi(2) * (TAU * periods).sin(),
                    SweepShape::Velocity => hz * (TAU * periods).cos(),
                    SweepShape::GlidingPulses => hz * (TAU * periods).sin().signum(),
                    _ => middle_hz * (TAU * periods).sin(),
                }
            };
            let absolute = -2.0 * self.damping_ratio * w * v - w * w * q;
            if t >= 0.0 && clean.len() < samples && (t * RATE_HZ - clean.len() as f64).abs() < 1e-3 {
                clean.push(absolute);
            }
            v += h * (absolute - acceleration);
            q += h * v;
        }
        let rms = (clean.iter().map(|y| y * y).sum::<f64>() / clean.len() as f64).sqrt();
        let mut chance = Noise(seed);
        let output = clean.iter().map(|y| y + self.noise * rms * chance.normal()).collect();
        let time_s = (0..clean.len()).map(|k| 412.5 + k as f64 / RATE_HZ * (1.0 + self.clock)).collect();
        Recording::new("shaken", time_s).with_column("accel_x_m_s2", output)
    }
}

fn identified(recording: &Recording, plan: &str) -> Result<(SweepShape, IdentifiedModes), IdentifyError> {
    let plan: SweepPlan = plan.parse().unwrap();
    let found = find_sweep(recording, "accel_x_m_s2", None, &plan)?;
    let options = ForcedOptions {
        input_kind: Some(InputKind::BaseAcceleration),
        max_delay_s: 0.01,
        cross_checks: false,
        ..ForcedOptions::new(SWEEP_COLUMN, "accel_x_m_s2")
    };
    Ok((found.shape, identify_forced(&found.recording, &options)?))
}

fn cases() -> Vec<Shaken> {
    let pulses = Shaken {
        plan: "5,95,2.5",
        shape: SweepShape::Pulses,
        exponential: false,
        from_hz: 5.0,
        to_hz: 95.0,
        sweep_s: 36.0,
        start_s: -1.7,
        record_s: 30.0,
        clock: 0.0,
        frequency_hz: 31.3,
        damping_ratio: 0.06,
        noise: 0.03,
    };
    vec![
        Shaken {
            plan: "5,95,36s",
            clock: 3e-3,
            noise: 0.1,
            start_s: 2.3,
            frequency_hz: 47.0,
            damping_ratio: 0.03,
            ..pulses.clone()
        },
        Shaken {
            plan: "80,10,35Hz/s",
            shape: SweepShape::Force,
            from_hz: 80.0,
            to_hz: 10.0,
            sweep_s: 2.0,
            start_s: 0.4,
            record_s: 3.0,
            frequency_hz: 44.0,
            damping_ratio: 0.015,
            ..pulses.clone()
        },
        Shaken {
            plan: "4,90,25s,exponential",
            shape: SweepShape::Position,
            exponential: true,
            from_hz: 4.0,
            to_hz: 90.0,
            sweep_s: 25.0,
            start_s: 1.1,
            frequency_hz: 23.7,
            damping_ratio: 0.02,
            clock: -1e-3,
            ..pulses.clone()
        },
        Shaken {
            plan: "10,60,50",
            shape: SweepShape::Velocity,
            from_hz: 10.0,
            to_hz: 60.0,
            sweep_s: 50.0,
            start_s: -6.0,
            record_s: 40.0,
            frequency_hz: 28.0,
            damping_ratio: 0.005,
            ..pulses.clone()
        },
        Shaken {
            plan: "5,95,2.5Hz/s",
            shape: SweepShape::GlidingPulses,
            start_s: -2.0,
            record_s: 28.0,
            frequency_hz: 27.4,
            damping_ratio: 0.07,
            ..pulses.clone()
        },
        Shaken {
            plan: "8,120,56s",
            shape: SweepShape::GlidingPulses,
            from_hz: 8.0,
            to_hz: 120.0,
            sweep_s: 56.0,
            start_s: 1.3,
            record_s: 50.0,
            frequency_hz: 61.0,
            damping_ratio: 0.04,
            ..pulses.clone()
        },
        pulses,
    ]
}

#[test]
fn modes_come_from_a_sweep_that_only_its_plan_tells() {
    for (seed, case) in (0..).zip(cases()) {
        let (shape, found) = identified(&case.recorded(seed), case.plan).unwrap();
        let modes: Vec<[f64; 2]> =
            found.modes.iter().map(|mode| [mode.frequency_hz.value, mode.damping_ratio.value]).collect();
        // The recorder's second is the unit: a fast clock makes slow modes.
        let truth = [case.frequency_hz / (1.0 + case.clock), case.damping_ratio];
        assert_eq!(modes.len(), 1, "{modes:?} for {case:?}");
        assert!((modes[0][0] / truth[0] - 1.0).abs() < 0.004, "{modes:?} for {case:?}");
        assert!((modes[0][1] / truth[1] - 1.0).abs() < 0.08, "{modes:?} for {case:?}");
        assert_eq!(shape, case.shape, "{case:?}");
    }
}

#[test]
fn a_record_that_answers_another_sweep_is_refused() {
    let case = cases().pop().unwrap();
    let recording = case.recorded(7);
    for plan in ["5,95,1Hz/s", "5,95,30s,exponential", "95,5,36s"] {
        let refusal = identified(&recording, plan).unwrap_err();
        assert!(matches!(refusal, IdentifyError::SweepNotFound { .. }), "{plan}: {refusal}");
    }
    let mut chance = Noise(3);
    let time_s: Vec<f64> = (0..8000).map(|k| k as f64 / RATE_HZ).collect();
    let noise = (0..8000).map(|_| chance.normal()).collect();
    let refusal = identified(&Recording::new("noise", time_s).with_column("accel_x_m_s2", noise), "5,95,10s");
    assert!(matches!(refusal, Err(IdentifyError::SweepNotFound { .. })));
}

/// A sweep that keeps a force, a speed or a travel the same, and two modes that answer it as accelerations.
fn two_modes(seed: u64) -> (String, Recording, [[f64; 2]; 2]) {
    let mut chance = Noise(seed.wrapping_mul(7919) + 5);
    let mut between = |low: f64, high: f64| low + (high - low) * chance.even();
    let (from_hz, to_hz, sweep_s) = (between(4.0, 7.0), between(50.0, 60.0), between(18.0, 22.0));
    let (start_s, law, exponential) = (between(0.5, 2.0), (seed % 3) as i32, seed % 2 == 1);
    let first = [between(12.0, 18.0), 10.0_f64.powf(between(-2.1, -1.4))];
    let second = [first[0] * between(1.6, 2.3), 10.0_f64.powf(between(-2.1, -1.4))];
    let shares = [1.0, between(0.4, 1.2) * if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 }];
    const FINE: usize = 10;
    let (rate_hz, h) = (400.0, 1.0 / (400.0 * FINE as f64));
    let samples = ((sweep_s + start_s + 2.0) * rate_hz) as usize;
    let mut states = [[0.0_f64; 2]; 2];
    let mut clean = Vec::with_capacity(samples);
    for k in 0..samples * FINE {
        let since_s = k as f64 * h - start_s;
        let (hz, periods) = if exponential {
            let k = (to_hz / from_hz).ln() / sweep_s;
            (from_hz * (k * since_s).exp(), from_hz * (k * since_s).exp_m1() / k)
        } else {
            let k = (to_hz - from_hz) / sweep_s;
            (from_hz + k * since_s, from_hz * since_s + 0.5 * k * since_s * since_s)
        };
        let goes_on = (0.0..=sweep_s).contains(&since_s);
        let force = if goes_on { (hz / 30.0).powi(law) * (TAU * periods).sin() } else { 0.0 };
        let mut sum = 0.0;
        for ((state, [hz, zeta]), share) in states.iter_mut().zip([first, second]).zip(shares) {
            let w = TAU * hz;
            let acceleration = force - 2.0 * zeta * w * state[1] - w * w * state[0];
            sum += share * acceleration;
            state[1] += h * acceleration;
            state[0] += h * state[1];
        }
        if k % FINE == 0 {
            clean.push(sum);
        }
    }
    let rms = (clean.iter().map(|y| y * y).sum::<f64>() / clean.len() as f64).sqrt();
    let output = clean.iter().map(|y| y + 0.01 * rms * chance.normal()).collect();
    let time_s = (0..samples).map(|k| k as f64 / rate_hz).collect();
    let plan = format!("{from_hz},{to_hz},{sweep_s}s{}", if exponential { ",exponential" } else { "" });
    (plan, Recording::new("two modes", time_s).with_column("accel_x_m_s2", output), [first, second])
}

#[test]
fn two_modes_come_from_a_sweep_that_only_its_plan_tells_whatever_it_keeps_the_same() {
    for seed in [0, 3, 4] {
        let (plan, recording, truth) = two_modes(seed);
        let (shape, found) = identified(&recording, &plan).unwrap();
        let wanted = [SweepShape::Force, SweepShape::Velocity, SweepShape::Position][(seed % 3) as usize];
        assert_eq!(shape, wanted, "{seed}");
        let modes: Vec<[f64; 2]> =
            found.modes.iter().map(|mode| [mode.frequency_hz.value, mode.damping_ratio.value]).collect();
        assert_eq!(modes.len(), 2, "{seed}: {modes:?} for {truth:?}");
        for (mode, truth) in modes.iter().zip(truth) {
            assert!((mode[0] / truth[0] - 1.0).abs() < 0.003, "{seed}: {modes:?} for {truth:?}");
            assert!((mode[1] / truth[1] - 1.0).abs() < 0.08, "{seed}: {modes:?} for {truth:?}");
        }
    }
}
