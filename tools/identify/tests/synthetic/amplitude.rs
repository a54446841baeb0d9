//! Forced records of machines of two modes, of which the first may go with its amplitude or change in time:
//! integrated by Runge-Kutta steps of an eighth of a sample, without the code under test.

use std::f64::consts::TAU;

use stillbeam_recording::Recording;

use super::Noise;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    LinearSweep,
    SweepUp,
    SweepDown,
    Multisine,
    Random,
    Blows,
}

pub const DRIVES: [Drive; 5] =
    [Drive::LinearSweep, Drive::SweepUp, Drive::SweepDown, Drive::Multisine, Drive::Random];

/// What changes the first mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// The stiffness falls with the square of the amplitude.
    Softens,
    /// It rises.
    Hardens,
    /// A force against the speed, with its square.
    Drag,
    /// The stiffness rises at a moment.
    Jumps,
}

pub const CHANGES: [Change; 3] = [Change::Softens, Change::Hardens, Change::Drag];

#[derive(Debug, Clone, Copy)]
pub struct Machine {
    pub drive: Drive,
    pub change: Change,
    /// Change of the frequency at the largest amplitude, or at the end, in per cent of it; of the damping
    /// ratio, of drag, ten times that in per cent.
    pub change_pct: f64,
    /// Noise in per cent of the output.
    pub noise_pct: f64,
    /// Second frequency as a multiple of the first.
    pub ratio: f64,
    pub seed: u64,
}

pub struct Case {
    pub recording: Recording,
    pub frequencies_hz: [f64; 2],
    /// Lowest and highest frequency of a sine of the first mode up to the largest amplitude there is, Hz.
    pub first_hz: [f64; 2],
    pub damping_ratios: [f64; 2],
}

const RATE_HZ: f64 = 100.0;
const DURATION_S: f64 = 60.0;
const DENSE: usize = 8;

impl Machine {
    pub fn case(&self) -> Case {
        let mut noise = Noise(self.seed);
        let first_hz = 1.5 + 1.5 * noise.even();
        let frequencies_hz = [first_hz, first_hz * self.ratio];
        let damping_ratios = [0, 1].map(|_| 0.004 * 5.0_f64.powf(noise.even()));
        let shares = [1.0, 0.5 * self.ratio];
        let force = self.force(&mut noise, [0.4 * first_hz, 1.6 * frequencies_hz[1]]);
        let linear = response(&force, frequencies_hz[0], damping_ratios[0], |q, _, _| [q, 0.0]);
        let top = linear.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        let first = self.first_mode(&force, frequencies_hz[0], damping_ratios[0], top);
        let second = response(&force, frequencies_hz[1], damping_ratios[1], |q, _, _| [q, 0.0]);
        let clean: Vec<f64> = first.iter().zip(&second).map(|(a, b)| shares[0] * a + shares[1] * b).collect();
        let rms = (clean.iter().map(|y| y * y).sum::<f64>() / clean.len() as f64).sqrt();
        let output = clean.iter().map(|y| y + 0.01 * self.noise_pct * rms * noise.normal()).collect();
        let input = force.iter().copied().step_by(DENSE).take(clean.len()).collect();
        let time_s = (0..clean.len()).map(|k| k as f64 / RATE_HZ).collect();
        let recording = Recording::new("machine", time_s)
            .with_column("force_N", input)
            .with_column("tip_deflection_m", output);
        let reached = first.iter().fold(0.0_f64, |top, y| top.max(y.abs())) / top;
        // A sine feels three quarters of what the stiffness changes by at its peak.
        let change = 2.0 * 0.01 * self.change_pct * reached * reached;
        let at_largest = first_hz
            * match self.change {
                Change::Softens => (1.0 - change.min(0.5 * 0.75)).sqrt(),
                Change::Hardens => (1.0 + change).sqrt(),
                Change::Drag => 1.0,
                Change::Jumps => (1.0 + 0.02 * self.change_pct).sqrt(),
            };
        let first_hz = [first_hz.min(at_largest), first_hz.max(at_largest)];
        Case { recording, frequencies_hz, first_hz, damping_ratios }
    }

    fn first_mode(&self, force: &[f64], frequency_hz: f64, damping_ratio: f64, top: f64) -> Vec<f64> {
        let w = TAU * frequency_hz;
        let share = 0.01 * self.change_pct;
        // A change of the frequency is half one of the stiffness, of which a sine feels three quarters.
        let stiffness = 2.0 * share / 0.75 / (top * top);
        // Of drag a sine feels 8 / (3 pi).
        let drag = 10.0 * share * 2.0 * damping_ratio * w / (w * top) * 3.0 * std::f64::consts::PI / 8.0;
        // Between a third and two thirds of the record.
        let jump_s = DURATION_S * (1.0 + (self.seed % 4) as f64 / 3.0) / 3.0;
        response(force, frequency_hz, damping_ratio, |q, v, t| match self.change {
            Change::Jumps => [q * (1.0 + if t < jump_s { 0.0 } else { 2.0 * share }), 0.0],
            Change::Softens => [q * (1.0 - (stiffness * q * q).min(0.5)), 0.0],
            Change::Hardens => [q * (1.0 + stiffness * q * q), 0.0],
            Change::Drag => [q, drag * v.abs() * v],
        })
    }

    fn force(&self, noise: &mut Noise, [low, high]: [f64; 2]) -> Vec<f64> {
        let points = (RATE_HZ * DURATION_S) as usize * DENSE + DENSE;
        let time = |k: usize| k as f64 / (RATE_HZ * DENSE as f64);
        let begin = |t: f64| (2.0 * t).min(1.0);
        match self.drive {
            Drive::LinearSweep | Drive::SweepUp | Drive::SweepDown => {
                let growth = (high / low).ln() / DURATION_S;
                let up = |t: f64| TAU * low * ((growth * t).exp() - 1.0) / growth;
                let phase = |t: f64| match self.drive {
                    Drive::LinearSweep => TAU * (low * t + 0.5 * (high - low) / DURATION_S * t * t),
                    Drive::SweepUp => up(t),
                    _ => -up(DURATION_S - t),
                };
                (0..points).map(|k| begin(time(k)) * phase(time(k)).sin()).collect()
            }
            Drive::Multisine | Drive::Random => {
                let spacing = if self.drive == Drive::Multisine { 3.0 } else { 0.73 } / DURATION_S;
                let lines = (low / spacing) as usize..=(high / spacing) as usize;
                let waves: Vec<[f64; 2]> =
                    lines.map(|line| [TAU * line as f64 * spacing, TAU * noise.even()]).collect();
                let at = |t: f64| waves.iter().map(|[w, phase]| (w * t + phase).sin()).sum::<f64>();
                (0..points).map(|k| begin(time(k)) * at(time(k))).collect()
            }
            Drive::Blows => {
                let length_s = 0.25 / high;
                let blow = |t: f64| {
                    if (0.0..length_s).contains(&t) { (0.5 * TAU * t / length_s).sin() } else { 0.0 }
                };
                let at_s: Vec<f64> =
                    (0..5).map(|k| DURATION_S * (0.02 + 0.2 * f64::from(k)) + noise.even()).collect();
                (0..points).map(|k| at_s.iter().map(|at| blow(time(k) - at)).sum()).collect()
            }
        }
    }
}

/// The coordinate of a mode at the samples, with a law for spring and extra force against the motion.
fn response(force: &[f64], hz: f64, damping: f64, law: impl Fn(f64, f64, f64) -> [f64; 2]) -> Vec<f64> {
    let w = TAU * hz;
    let h = 1.0 / (RATE_HZ * DENSE as f64);
    let rate = |q: f64, v: f64, u: f64, t: f64| {
        let [spring, extra] = law(q, v, t);
        u - 2.0 * damping * w * v - extra - w * w * spring
    };
    let (mut q, mut v) = (0.0, 0.0);
    let mut out = Vec::new();
    for (k, pair) in force.windows(2).enumerate() {
        if k % DENSE == 0 {
            out.push(q);
        }
        let half = 0.5 * (pair[0] + pair[1]);
        let t = k as f64 * h;
        let a = rate(q, v, pair[0], t);
        let (v2, a2) = (v + 0.5 * h * a, rate(q + 0.5 * h * v, v + 0.5 * h * a, half, t + 0.5 * h));
        let (v3, a3) = (v + 0.5 * h * a2, rate(q + 0.5 * h * v2, v + 0.5 * h * a2, half, t + 0.5 * h));
        let (v4, a4) = (v + h * a3, rate(q + h * v3, v + h * a3, pair[1], t + h));
        q += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6.0 * (a + 2.0 * a2 + 2.0 * a3 + a4);
    }
    out
}
