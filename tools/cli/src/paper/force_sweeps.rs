//! The same sweeps as a force on a free base: what "the input was the excitation force" would find.

use std::f64::consts::TAU;

use stillbeam_firmware::motion::SweepKind;
use stillbeam_identify::{ForcedOptions, IdentifiedModes, identify_forced};
use stillbeam_plant::modes::coupled_modes;
use stillbeam_plant::{FORCE, Input, Model, TIP_DEFLECTION, simulate};
use stillbeam_recording::Recording;

use super::printed::{SweepRow, TABLE_1};
use crate::demo::rig::{Rig, camera};
use crate::error::CliError;

/// Amplitude of the force, newtons. Without friction even so little moves the base by some 100 mm at 0.1 Hz.
pub const AMPLITUDE_N: f64 = 0.1;

/// Samples of the force per second.
const RATE_HZ: f64 = 500.0;

/// Seed of the camera's noise in the first sweep; the next ones follow.
const FIRST_SEED: u64 = 41;

/// One sweep of the force.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceSweep {
    /// The sweep.
    pub printed: SweepRow,
    /// What identification makes of it.
    pub identified: IdentifiedModes,
}

/// The modes that a force on the free base excites: hertz and damping ratio, lowest first.
///
/// # Errors
/// [`CliError::Plant`]; [`CliError::Internal`] when the rig's model has no base.
pub fn true_modes(rig: &Rig) -> Result<Vec<(f64, f64)>, CliError> {
    let Model::BeamOnBase(beam) = &rig.model else {
        return Err(CliError::Internal("the paper's model has no base".to_owned()));
    };
    Ok(coupled_modes(beam).map_err(CliError::plant("free base"))?.flexible())
}

/// Sweeps a force on the free base four times.
///
/// # Errors
/// [`CliError`] from the simulation, the camera or the identification.
pub fn run(rig: &Rig) -> Result<Vec<ForceSweep>, CliError> {
    let mut model = rig.model.clone();
    if let Model::BeamOnBase(beam) = &mut model {
        beam.input = Some(Input::new(FORCE));
    }
    let rows = TABLE_1.iter().zip(FIRST_SEED..);
    rows.map(|(row, seed)| run_one(&model, row, seed)).collect()
}

fn run_one(model: &Model, row: &SweepRow, seed: u64) -> Result<ForceSweep, CliError> {
    let force = force(row);
    let simulated = simulate(model, &force).map_err(CliError::plant("force sweep"))?;
    let seen = camera(RATE_HZ, seed).observe(RATE_HZ, simulated.column(TIP_DEFLECTION)?)?;
    let recording = force.with_column(TIP_DEFLECTION, seen);
    let options = ForcedOptions::new(FORCE, TIP_DEFLECTION).with_modes(2);
    Ok(ForceSweep { printed: *row, identified: identify_forced(&recording, &options)? })
}

/// The force as a recording: a sine whose frequency is the derivative of its phase.
fn force(row: &SweepRow) -> Recording {
    let (from_hz, to_hz) = row.from_to_hz();
    let duration_s = row.duration_s();
    let samples = (duration_s * RATE_HZ).floor() as u32;
    let time_s: Vec<f64> = (0..=samples).map(|k| f64::from(k) / RATE_HZ).collect();
    let turns = |t: f64| match row.kind {
        SweepKind::Linear => from_hz * t + 0.5 * (to_hz - from_hz) / duration_s * t * t,
        SweepKind::Exponential => {
            let growth_per_s = (to_hz / from_hz).ln() / duration_s;
            from_hz * (growth_per_s * t).exp_m1() / growth_per_s
        }
    };
    let force = time_s.iter().map(|t| AMPLITUDE_N * (TAU * turns(*t)).sin()).collect();
    Recording::new(format!("force, {}", row.name()), time_s).with_column(FORCE, force)
}
