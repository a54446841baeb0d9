//! Models that several tests start from. Not every test uses all of them.

pub mod finite_elements;
pub mod model_texts;
pub mod oscillator;
pub mod paper_basis;
pub mod polynomial;
pub mod systems;

use std::collections::BTreeMap;

use stillbeam_plant::{
    BeamDamping, BeamFittings, BeamOnBase, BeamParameters, BeamSignal, Beside, Input, ModalModel,
    ModalOutput, Mode, Model, Profile, Quantity, Setup,
};

pub const PAPER_BEAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/paper_beam.toml");

/// The paper's beam as the repository ships it.
pub fn paper_beam() -> BeamOnBase {
    match Model::read(PAPER_BEAM) {
        Ok(Model::BeamOnBase(model)) => model,
        other => panic!("the shipped model: {other:?}"),
    }
}

/// A beam with the paper's length, material and base.
pub fn beam(width_m: Profile, thickness_m: Profile, modes: usize) -> BeamOnBase {
    BeamOnBase {
        beam: BeamParameters {
            length_m: 0.9,
            density_kg_m3: 8190.0,
            young_pa: 190e9,
            width_m,
            thickness_m,
            modes,
            damping: BeamDamping::Ratios(vec![0.0; modes]),
            fittings: BeamFittings::default(),
        },
        base_mass_kg: 2.5,
        base_viscous_n_s_m: 0.0,
        drive: None,
        input: Some(Input::new("setpoint_m")),
        outputs: vec![BeamSignal::TipDeflection, BeamSignal::BasePosition],
        fixed: BTreeMap::new(),
        setup: Setup::default(),
    }
}

pub fn mode(frequency_hz: f64, damping_ratio: f64, participation: f64) -> Mode {
    Mode { frequency_hz, damping_ratio, participation: vec![participation] }
}

/// A modal model with one output.
pub fn modal(modes: Vec<Mode>, input: &str, output: &str, quantity: Quantity) -> ModalModel {
    ModalModel {
        modes,
        real_pole: None,
        beside: Beside::default(),
        driving_point: None,
        drive: None,
        input: Some(Input::new(input)),
        outputs: vec![ModalOutput { column: output.to_owned(), quantity }],
        fixed: BTreeMap::new(),
        setup: Setup::default(),
    }
}

/// Largest absolute difference of two signals.
pub fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// Largest absolute value of a signal.
pub fn peak(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()))
}

/// Times of `count` ticks in seconds.
pub fn ticks(count: usize, rate_hz: f64) -> Vec<f64> {
    (0..count).map(|tick| tick as f64 / rate_hz).collect()
}

/// A smooth 50 mm move of `duration_s`, sampled at the given times.
pub fn smooth_move(time_s: &[f64], duration_s: f64) -> Vec<f64> {
    time_s
        .iter()
        .map(|t| {
            let s = (t / duration_s).clamp(0.0, 1.0);
            0.05 * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s)
        })
        .collect()
}
