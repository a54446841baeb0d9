//! Records of every kind, as recorders write them: several modes, noise, an offset, a drift, wild samples.

use std::f64::consts::TAU;

use stillbeam_identify::RecordKind;
use stillbeam_recording::Recording;

use super::Noise;

/// All kinds, in the order of the table.
pub const KINDS: [RecordKind; 6] = [
    RecordKind::FreeDecay,
    RecordKind::Sweep,
    RecordKind::Multisine,
    RecordKind::Random,
    RecordKind::Pulse,
    RecordKind::Tone,
];

/// Even number between two others.
pub fn between(noise: &mut Noise, low: f64, high: f64) -> f64 {
    low + (high - low) * noise.even()
}

/// The same by equal ratios.
pub fn ratio_between(noise: &mut Noise, low: f64, high: f64) -> f64 {
    low * (high / low).powf(noise.even())
}

/// Whole number from `low` to `high`.
pub fn whole(noise: &mut Noise, low: usize, high: usize) -> usize {
    low + (noise.even() * (high - low + 1) as f64) as usize
}

struct Structure {
    /// Frequency, Hz, damping ratio and share of each mode.
    modes: Vec<(f64, f64, f64)>,
    rate_hz: f64,
}

impl Structure {
    fn of(noise: &mut Noise) -> Self {
        let rate_hz = ratio_between(noise, 100.0, 3200.0);
        let count = whole(noise, 1, 4);
        let modes = (0..count)
            .map(|_| {
                let f = rate_hz * ratio_between(noise, 0.01, 0.3);
                (f, ratio_between(noise, 0.003, 0.05), ratio_between(noise, 0.2, 1.0))
            })
            .collect();
        Self { modes, rate_hz }
    }

    /// The loudest mode.
    fn first(&self) -> (f64, f64) {
        let loudest = self.modes.iter().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap();
        (loudest.0, loudest.1)
    }

    /// Time by which the loudest mode falls by e, s.
    fn decay_s(&self) -> f64 {
        let (f, zeta) = self.first();
        1.0 / (TAU * f * zeta)
    }

    /// The response to an input at the sampling rate, every mode as loud as its share at its resonance.
    fn answer(&self, input: &[f64]) -> Vec<f64> {
        let mut output = vec![0.0; input.len()];
        for (f, zeta, share) in &self.modes {
            let (w, step_s) = (TAU * f, 1.0 / self.rate_hz);
            let damped = w * (1.0 - zeta * zeta).sqrt();
            let (fall, turn) = ((-zeta * w * step_s).exp(), damped * step_s);
            let (mut re, mut im) = (0.0_f64, 0.0_f64);
            for (y, u) in output.iter_mut().zip(input) {
                let turned = fall * (re * turn.sin() + im * turn.cos());
                re = fall * (re * turn.cos() - im * turn.sin()) + u;
                im = turned;
                *y += share * im;
            }
        }
        output
    }

    fn rows(&self, seconds: f64) -> usize {
        ((seconds * self.rate_hz) as usize).clamp(600, 20_000)
    }
}

/// A record of a kind; the same seed gives the same one.
pub fn record(kind: RecordKind, seed: u64) -> Recording {
    let mut noise = Noise(seed.wrapping_mul(977).wrapping_add(kind as u64 * 7_919 + 13));
    let structure = Structure::of(&mut noise);
    let clean = match kind {
        RecordKind::FreeDecay => decay(&structure, &mut noise),
        RecordKind::Sweep => sweep(&structure, &mut noise),
        RecordKind::Multisine => multisine(&structure, &mut noise),
        RecordKind::Random => random(&structure, &mut noise),
        RecordKind::Pulse => knocks(&structure, &mut noise),
        RecordKind::Tone => tone(&structure, &mut noise),
    };
    recorded(clean, structure.rate_hz, &mut noise)
}

fn decay(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let rows = structure.rows(between(noise, 0.7, 8.0) * structure.decay_s());
    let before = if noise.even() < 0.3 { rows / whole(noise, 4, 10) } else { 0 };
    let mut input = vec![0.0; rows + before];
    input[before] = 1.0;
    structure.answer(&input)
}

fn sweep(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let (middle, _) = structure.first();
    let (low, high) = (middle / between(noise, 2.0, 8.0), middle * between(noise, 1.3, 1.6));
    // A sweep takes some hundred periods, and as long as it passes its mode slowly enough to be worth it.
    let seconds = between(noise, 150.0, 600.0) / middle;
    let rows = structure.rows(seconds);
    let seconds = rows as f64 / structure.rate_hz;
    let (exponential, downwards) = (noise.even() < 0.5, noise.even() < 0.2);
    let k = (high / low).ln() / seconds;
    let phase = |t: f64| match exponential {
        true => TAU * low * ((k * t).exp() - 1.0) / k,
        false => TAU * (low * t + 0.5 * (high - low) / seconds * t * t),
    };
    let mut input: Vec<f64> = (0..rows).map(|row| phase(row as f64 / structure.rate_hz).sin()).collect();
    if downwards {
        input.reverse();
    }
    let direct = between(noise, 0.0, 3.0);
    structure.answer(&input).iter().zip(&input).map(|(y, u)| y + direct * u).collect()
}

fn multisine(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let period = whole(noise, 300, 3000);
    let rows = period * whole(noise, 3, 8);
    let lines = whole(noise, 12, (period / 5).min(120));
    let mut input = vec![0.0; rows];
    for line in 1..=lines {
        let phase = TAU * noise.even();
        // Spread over the band of the modes.
        let bin = (line * period / (3 * lines)).max(1) as f64;
        for (row, u) in input.iter_mut().enumerate() {
            *u += (TAU * bin * row as f64 / period as f64 + phase).sin();
        }
    }
    structure.answer(&input)
}

fn random(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let rows = structure.rows(between(noise, 40.0, 400.0) * structure.decay_s());
    let mut input = vec![0.0; rows];
    input.iter_mut().for_each(|u| *u = noise.normal());
    // It was there before the recorder was.
    structure.answer(&input)[rows / 10..].to_vec()
}

fn knocks(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let count = whole(noise, 2, 6);
    let between_s = between(noise, 1.5, 6.0) * structure.decay_s();
    let apart = structure.rows(between_s).min(4000);
    let lead = whole(noise, 0, apart / 2);
    let mut input = vec![0.0; lead + count * apart];
    for knock in 0..count {
        let jitter = whole(noise, 0, apart / 6);
        input[lead + knock * apart + jitter] = between(noise, 0.5, 1.0);
    }
    structure.answer(&input)
}

fn tone(structure: &Structure, noise: &mut Noise) -> Vec<f64> {
    let f = structure.rate_hz * ratio_between(noise, 0.02, 0.2);
    let rows = structure.rows(between(noise, 60.0, 400.0) / f);
    let harmonics = whole(noise, 0, 3);
    let phases: Vec<f64> = (0..=harmonics).map(|_| TAU * noise.even()).collect();
    let sound = |row: usize| -> f64 {
        let t = row as f64 / structure.rate_hz;
        let one =
            |order: usize| (TAU * f * (order + 1) as f64 * t + phases[order]).sin() / (order + 1) as f64;
        (0..=harmonics).map(one).sum()
    };
    (0..rows).map(sound).collect()
}

/// What the recorder adds: noise of 0.1 to 10 % of the loudest, an offset, a drift, up to three wild samples.
fn recorded(clean: Vec<f64>, rate_hz: f64, noise: &mut Noise) -> Recording {
    let loudest = clean.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
    let level = loudest * ratio_between(noise, 1e-3, 0.1);
    let offset = loudest * between(noise, -3.0, 3.0);
    let drift = if noise.even() < 0.5 { loudest * between(noise, -0.3, 0.3) } else { 0.0 };
    let rows = clean.len();
    let mut values: Vec<f64> = clean
        .iter()
        .enumerate()
        .map(|(k, y)| y + offset + drift * k as f64 / rows as f64 + level * noise.normal())
        .collect();
    if noise.even() < 0.3 {
        for _ in 0..whole(noise, 1, 3) {
            let at = whole(noise, 0, rows - 1);
            values[at] += loudest * between(noise, 4.0, 20.0);
        }
    }
    let time_s = (0..rows).map(|k| k as f64 / rate_hz).collect();
    Recording::new("made", time_s).with_column("tip_m", values)
}
