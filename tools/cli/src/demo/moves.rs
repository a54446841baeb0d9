//! The moves: the same 50 mm with every shaper, set and streamed over the console.

use std::path::Path;

use stillbeam_identify::IdentifiedModes;
use stillbeam_plant::SETPOINT;
use stillbeam_recording::{Recording, write_csv};
use stillbeam_shape::{Crc32, DesignOptions, ShaperDesign};

use super::board_setup::{apply_shapers, decimation, go_to_zero};
use super::cases::{CASES, Case};
use super::rig::{Rig, camera};
use crate::base_move::BaseMove;
use crate::board::Session;
use crate::error::CliError;
use crate::streams::write_file;

/// Streamed samples per second. A move's corners are sharper than a sweep's sines.
const STREAM_HZ: f64 = 1000.0;

/// The paper's move.
pub const TARGET_MM: f64 = 50.0;

/// How long the stream goes on after the setpoint has come to rest, seconds.
const AFTER_S: f64 = 0.25;

/// How much of a move is written to its file and plotted, seconds.
pub const SHOWN_S: f64 = 8.0;

/// One move and how it went.
#[derive(Clone, Debug, PartialEq)]
pub struct MoveResult {
    /// What was shaped, and how.
    pub case: Case,
    /// The design, if there is a shaper.
    pub design: Option<ShaperDesign>,
    /// The CRC that the board reported, equal to the design's.
    pub crc32: Crc32,
    /// Seconds of streamed setpoints, before the last one is held.
    pub streamed_s: f64,
    /// The beam's answer.
    pub simulated: BaseMove,
    /// The file with setpoints and tip, relative to the folder.
    pub setpoint_csv: String,
}

/// Makes every move, and returns to zero after each. Writes one table and one recording per move into
/// `folder`. `progress` is told how much is done, from 0 to 1, and what comes.
///
/// # Errors
/// [`CliError`]; [`CliError::Internal`] when the board's table is not the host's.
pub fn run_all(
    session: &mut Session,
    rig: &Rig,
    identified: &IdentifiedModes,
    folder: &Path,
    progress: &mut dyn FnMut(f64, &str),
) -> Result<Vec<MoveResult>, CliError> {
    let modes = identified.modes.iter();
    let modes: Vec<(f64, f64)> =
        modes.map(|mode| (mode.frequency_hz.value, mode.damping_ratio.value)).collect();
    let mut results = Vec::with_capacity(CASES.len());
    for (index, case) in CASES.iter().enumerate() {
        progress(
            index as f64 / CASES.len() as f64,
            &format!("moving {TARGET_MM} mm, shaper {}", case.name()),
        );
        results.push(run_one(session, rig, (case, index), &modes, folder)?);
    }
    // Leave the board as it is after reset: nothing shaped.
    apply_shapers(session, &[])?;
    Ok(results)
}

fn run_one(
    session: &mut Session,
    rig: &Rig,
    (case, number): (&Case, usize),
    identified: &[(f64, f64)],
    folder: &Path,
) -> Result<MoveResult, CliError> {
    let tick_hz = session.tick_hz()?;
    let stem = case.file_stem();
    let modes = case.design_modes(identified).map_err(|error| CliError::Usage(format!("{stem}: {error}")))?;
    let design = match modes.as_slice() {
        [] => None,
        modes => Some(ShaperDesign::new(modes, tick_hz, &DesignOptions::default())?),
    };
    if let Some(design) = &design {
        write_file(&folder.join(format!("shaper-{stem}.json")), &design.to_json())?;
    }
    let crc32 = apply_shapers(session, &modes)?;
    let expected = design.as_ref().map_or_else(|| Crc32::of_stages(&[]), |design| design.crc32);
    if crc32 != expected {
        return Err(CliError::Internal(format!(
            "{stem}: the board's table has crc32 {crc32}, the host designed {expected}; host and firmware differ"
        )));
    }
    let motion = session.run_motion(
        &format!("move {TARGET_MM}"),
        decimation(tick_hz, STREAM_HZ),
        AFTER_S,
        &mut |_| {},
    )?;
    go_to_zero(session)?;
    let (rate_hz, setpoint_m) = (motion.rate_hz(), motion.setpoints_m());
    let simulated =
        BaseMove::simulate(&rig.model, rate_hz, &setpoint_m).map_err(CliError::plant(stem.clone()))?;
    let setpoint_csv = format!("move-{stem}.csv");
    let recording = recording(&simulated, &motion.commands_m(), number as u64)?;
    write_csv(&folder.join(&setpoint_csv), &recording)?;
    let streamed_s = setpoint_m.len() as f64 / rate_hz;
    Ok(MoveResult { case: *case, design, crc32, streamed_s, simulated, setpoint_csv })
}

/// The first [`SHOWN_S`] seconds as a recording: command and setpoint as streamed, held from where the stream
/// ends, and the tip where the camera has a frame.
fn recording(simulated: &BaseMove, command_m: &[f64], seed: u64) -> Result<Recording, CliError> {
    let rate_hz = simulated.rate_hz;
    let shown = ((SHOWN_S * rate_hz) as usize).max(command_m.len()).min(simulated.setpoint_m.len());
    let setpoint_m: Vec<f64> = simulated.setpoint_m.iter().take(shown).copied().collect();
    let deflection_m: Vec<f64> = simulated.tip_deflection_m.iter().take(shown).copied().collect();
    let mut command_m = command_m.to_vec();
    command_m.resize(shown, command_m.last().copied().unwrap_or(0.0));
    let seen = camera(rate_hz, 100 + seed).record("move", rate_hz, &setpoint_m, &deflection_m)?;
    let deflection = seen.column(stillbeam_plant::TIP_DEFLECTION)?.to_vec();
    Ok(Recording::new("move", seen.time_s.clone())
        .with_column("command_m", command_m)
        .with_column(SETPOINT, setpoint_m)
        .with_column(stillbeam_plant::TIP_DEFLECTION, deflection))
}
