//! Truth for the tests: a beam on a base, simulated with laws of the catalogue at twenty times the
//! recordings' rate, seen by sensors with noise of a given colour.

#![allow(dead_code, reason = "examples use their own part")]

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use stillbeam_plant::{InitialState, Model, Physics, simulate};
use stillbeam_recording::Recording;

/// One run of the machine.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    pub exponential: bool,
    pub duration_s: f64,
    /// Times the bench's amplitude.
    pub amplitude: f64,
    /// From high to low frequencies.
    pub down: bool,
}

/// Three to train on and two to hold out: other amplitudes and other durations.
pub const RUNS: [Run; 5] = [
    Run { exponential: false, duration_s: 80.0, amplitude: 1.0, down: false },
    Run { exponential: true, duration_s: 80.0, amplitude: 1.0, down: false },
    Run { exponential: true, duration_s: 80.0, amplitude: 2.0, down: false },
    Run { exponential: false, duration_s: 70.0, amplitude: 2.5, down: false },
    Run { exponential: true, duration_s: 90.0, amplitude: 1.4, down: false },
];

/// Shorter ones, for tests: two to train on and one to hold out.
pub const SHORT_RUNS: [Run; 3] = [
    Run { exponential: true, duration_s: 30.0, amplitude: 1.0, down: false },
    Run { exponential: true, duration_s: 30.0, amplitude: 2.0, down: false },
    Run { exponential: false, duration_s: 35.0, amplitude: 1.5, down: false },
];

/// For the results page: [`RESULT_TRAINED`] to train on, up and down, and one to hold out.
pub const RESULT_RUNS: [Run; 4] = [
    Run { exponential: true, duration_s: 30.0, amplitude: 1.0, down: false },
    Run { exponential: true, duration_s: 30.0, amplitude: 2.0, down: false },
    Run { exponential: false, duration_s: 30.0, amplitude: 1.4, down: true },
    Run { exponential: false, duration_s: 35.0, amplitude: 1.7, down: false },
];
pub const RESULT_TRAINED: usize = 3;

/// Root mean square of the noise on every sensor, metres.
pub const NOISE_M: f64 = 5e-5;

/// How the machine is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bench {
    /// The base is moved by 1 mm, and only the tip is seen.
    MovedBase,
    /// A force of 4 N acts on the base, which rolls with some friction; base and tip are seen.
    ForcedBase,
    /// The same on air bearings: neither the machine nor its model has friction in proportion to velocity.
    FloatingBase,
    /// As [`Bench::MovedBase`], but the beam was measured and weighed: its model is right about all but
    /// damping, and says so.
    MeasuredBeam,
}

const BEAM: &str = r#"
    schema = 1
    kind = "beam_on_base"
    [beam]
    length_m = 0.9
    density_kg_m3 = 8190.0
    young_Pa = 190e9
    width_m = [[0.0, 0.020], [0.9, 0.030]]
    thickness_m = [[0.0, 0.0012641], [0.9, 0.0010346]]
    modes = 2
    damping_ratio = [0.012, 0.008]
    [base]
    mass_kg = 2.5
    viscous_N_s_m = 4.0
"#;

/// What a rule and a balance tell of the beam.
const MEASURED: &str = r#"
    [fixed]
    "beam.length_m" = true
    "beam.density_kg_m3" = true
    "beam.young_Pa" = true
    "beam.width_m" = true
    "beam.thickness_m" = true
"#;

impl Bench {
    fn is_forced(self) -> bool {
        matches!(self, Self::ForcedBase | Self::FloatingBase)
    }

    fn amplitude(self) -> f64 {
        if self.is_forced() { 4.0 } else { 1e-3 }
    }

    /// Where sweeps begin: a force moves a free base the further the slower it is.
    fn lowest_hz(self) -> f64 {
        if self.is_forced() { 0.5 } else { 0.1 }
    }

    fn input(self) -> &'static str {
        if self.is_forced() { "force_N" } else { "base_position_m" }
    }

    /// The machine as it is, without left-out physics.
    pub fn model(self) -> Model {
        let outputs = if self.is_forced() {
            "[[output]]\ncolumn = \"tip_deflection_m\"\n[[output]]\ncolumn = \"base_position_m\"\n"
        } else {
            "[[output]]\ncolumn = \"tip_deflection_m\"\n"
        };
        let fixed = if self == Self::MeasuredBeam { MEASURED } else { "" };
        let text = format!("{BEAM}\n[input]\ncolumn = \"{}\"\n{outputs}{fixed}", self.input());
        let mut model = Model::from_toml("truth.toml", &text).unwrap();
        if self == Self::FloatingBase {
            model.set_parameter("base.viscous_N_s_m", 0.0).unwrap();
        }
        model
    }

    /// The machine as its drawings say: Young's modulus 4 %, damping 20 %, masses 3 % off.
    pub fn wrong_model(self) -> Model {
        let mut model = self.model();
        for (path, factor) in [
            ("beam.young_Pa", 1.04),
            ("beam.damping_ratio.1", 0.8),
            ("beam.damping_ratio.2", 1.2),
            ("base.mass_kg", 1.03),
            ("base.viscous_N_s_m", 0.9),
        ] {
            misdraw(&mut model, path, factor);
        }
        model
    }

    /// The machine as some drawings say: stiffness, density, masses and friction up to 5 %, sections up to 2
    /// %, damping up to 20 % off.
    pub fn wrong_model_of(self, seed: u64) -> Model {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        let mut model = self.model();
        for (path, most) in [
            ("beam.young_Pa", 0.05),
            ("beam.damping_ratio.1", 0.2),
            ("beam.damping_ratio.2", 0.2),
            ("base.mass_kg", 0.05),
            ("base.viscous_N_s_m", 0.05),
            ("beam.density_kg_m3", 0.05),
            ("beam.width_m.1", 0.02),
            ("beam.width_m.2", 0.02),
            ("beam.thickness_m.1", 0.02),
            ("beam.thickness_m.2", 0.02),
        ] {
            let draw: f64 = StandardUniform.sample(&mut random);
            misdraw(&mut model, path, 1.0 + most * (2.0 * draw - 1.0));
        }
        model
    }

    /// What the sensors record of one run.
    pub fn record(self, run: Run, laws: &[Physics], rho: f64, seed: u64) -> Recording {
        let clean = self.clean(run, laws);
        let noise = vec![NOISE_M; clean.columns.len() - 1];
        noisy(&clean, &noise, rho, seed)
    }

    /// What sensors without noise of their own would record of one run: the input, then the outputs.
    pub fn clean(self, run: Run, laws: &[Physics]) -> Recording {
        let mut model = self.model();
        model.setup_mut().physics.extend_from_slice(laws);
        self.clean_of(run, model)
    }

    /// The same with one of the machine's parameters multiplied.
    pub fn clean_with(self, run: Run, path: &str, factor: f64) -> Recording {
        let mut model = self.model();
        model.set_parameter(path, factor * model.parameter(path).unwrap()).unwrap();
        self.clean_of(run, model)
    }

    /// The same without left-out physics, begun with one coordinate away from rest.
    pub fn clean_begun(self, run: Run, coordinate: &str, state: InitialState) -> Recording {
        let mut model = self.model();
        model.setup_mut().initial.insert(coordinate.to_owned(), state);
        self.clean_of(run, model)
    }

    fn clean_of(self, run: Run, model: Model) -> Recording {
        const FINER: usize = 20;
        let count = (run.duration_s * 100.0) as usize;
        let fine: Vec<f64> = (0..=count * FINER).map(|k| k as f64 / (100 * FINER) as f64).collect();
        let input: Vec<f64> =
            fine.iter().map(|t| run.amplitude * self.amplitude() * run.sweep(self.lowest_hz(), *t)).collect();
        let truth = Recording::new("truth", fine).with_column(self.input(), input.clone());
        let simulated = simulate(&model, &truth).unwrap();
        let every = |samples: &[f64]| samples.iter().step_by(FINER).copied().collect::<Vec<f64>>();
        let name = format!("{} s at amplitude {}", run.duration_s, run.amplitude);
        let mut recording =
            Recording::new(name, every(&truth.time_s)).with_column(self.input(), every(&input));
        for column in model.output_columns() {
            let seen = every(simulated.column(&column).unwrap());
            recording = recording.with_column(column, seen);
        }
        recording
    }

    /// All five runs of another machine on the same bench.
    pub fn recordings_of(self, machine: &Model, seed: u64) -> Vec<Recording> {
        let clean = RUNS.map(|run| self.clean_of(run, machine.clone()));
        let noise = vec![NOISE_M; clean[0].columns.len() - 1];
        (0..).zip(clean).map(|(number, clean)| noisy(&clean, &noise, 0.0, 10 * seed + number)).collect()
    }

    /// The three short runs.
    pub fn short_recordings(self, laws: &[Physics], rho: f64, seed: u64) -> Vec<Recording> {
        (0..).zip(SHORT_RUNS).map(|(number, run)| self.record(run, laws, rho, 10 * seed + number)).collect()
    }

    /// All five runs.
    pub fn recordings(self, laws: &[Physics], rho: f64, seed: u64) -> Vec<Recording> {
        (0..).zip(RUNS).map(|(number, run)| self.record(run, laws, rho, 10 * seed + number)).collect()
    }
}

/// Multiplies a number of the model, unless it was measured: that is right.
fn misdraw(model: &mut Model, path: &str, factor: f64) {
    if !model.parameters().iter().any(|parameter| parameter.path == path && parameter.fixed) {
        let value = model.parameter(path).unwrap();
        model.set_parameter(path, factor * value).unwrap();
    }
}

/// A recording with noise of these standard deviations on its outputs, `rho` the correlation of neighbouring
/// samples.
pub fn noisy(clean: &Recording, noise_rms: &[f64], rho: f64, seed: u64) -> Recording {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut recording = clean.clone();
    recording.name = format!("run {seed}, {}", clean.name);
    for (column, rms) in recording.columns.iter_mut().skip(1).zip(noise_rms) {
        let mut noise = 0.0;
        for (k, value) in column.samples.iter_mut().enumerate() {
            let draw: f64 = StandardNormal.sample(&mut random);
            noise = if k == 0 { draw } else { rho * noise + (1.0 - rho * rho).sqrt() * draw };
            *value += rms * noise;
        }
    }
    recording
}

impl Run {
    /// From a low frequency to 8 Hz or back, growing from nothing within the first second.
    fn sweep(self, low: f64, now_s: f64) -> f64 {
        let t = if self.down { self.duration_s - now_s } else { now_s };
        let high = 8.0_f64;
        let phase = if self.exponential {
            let k = (high / low).ln() / self.duration_s;
            TAU * low * ((k * t).exp() - 1.0) / k
        } else {
            TAU * (low * t + 0.5 * (high - low) / self.duration_s * t * t)
        };
        now_s.min(1.0) * phase.sin()
    }
}
