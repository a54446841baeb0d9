//! Table 2 and Figs. 6 to 9: the move that explains the table ([`EXPLAINING_MOVE`]) with each shaper, made by
//! the board.

use stillbeam_plant::{Move, MoveMetrics, measure_move};

use super::move_search::EXPLAINING_MOVE;
use super::printed::DESIGN;
use crate::base_move::BaseMove;
use crate::board::Session;
use crate::demo::board_setup::{apply_shapers, decimation, go_to_zero};
use crate::demo::cases::{CASES, Case};
use crate::demo::moves::TARGET_MM;
use crate::demo::rig::Rig;
use crate::error::CliError;

/// Streamed samples per second.
const STREAM_HZ: f64 = 1000.0;

/// Bands around the target in which the tip is held to have settled, as fractions of the move.
pub const TIP_BANDS: [f64; 3] = [0.02, 0.05, 0.10];

/// Band around the target in which the base is held to have settled, as a fraction of the move.
pub const BASE_BAND: f64 = 0.02;

/// One move.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperMove {
    /// What was shaped, and what the paper printed.
    pub case: Case,
    /// The beam's answer.
    pub simulated: BaseMove,
    /// When the setpoint has come to rest, seconds from the command's start.
    pub command_end_s: f64,
    /// From when on the setpoint stays within [`BASE_BAND`], seconds.
    pub base_settling_s: f64,
    /// From when on the tip stays within each of [`TIP_BANDS`], seconds; `None` when it does not.
    pub tip_settling_s: [Option<f64>; 3],
}

/// Makes all moves, the unshaped one first. `progress` is told the name of each.
///
/// # Errors
/// [`CliError`].
pub fn run(
    session: &mut Session,
    rig: &Rig,
    progress: &mut dyn FnMut(usize, &str),
) -> Result<Vec<PaperMove>, CliError> {
    // A triangle of the velocity over T covers a T²/4. A micrometre per second squared less would take
    // another tick.
    let acceleration_mm_s2 = 4.0 * TARGET_MM / EXPLAINING_MOVE.1.powi(2) + 1e-3;
    session.command(&format!("set move.acceleration_mm_s2 {acceleration_mm_s2:.3}"))?;
    session.command_when_ready("apply")?;
    let mut results = Vec::with_capacity(CASES.len());
    for (index, case) in CASES.iter().enumerate() {
        progress(index, &case.name());
        results.push(run_one(session, rig, case)?);
    }
    apply_shapers(session, &[])?;
    Ok(results)
}

fn run_one(session: &mut Session, rig: &Rig, case: &Case) -> Result<PaperMove, CliError> {
    let modes = case.design_modes(&DESIGN).map_err(|error| CliError::Internal(error.to_string()))?;
    apply_shapers(session, &modes)?;
    go_to_zero(session)?;
    let decimation = decimation(session.tick_hz()?, STREAM_HZ);
    let motion = session.run_motion(&format!("move {TARGET_MM}"), decimation, 0.01, &mut |_| {})?;
    go_to_zero(session)?;
    let rate_hz = motion.rate_hz();
    let simulated = BaseMove::simulate(&rig.model, rate_hz, &motion.setpoints_m())
        .map_err(CliError::plant(case.name()))?;
    let time_s: Vec<f64> = (0..simulated.setpoint_m.len()).map(|k| k as f64 / rate_hz).collect();
    let metrics = |signal_m: &[f64], band: f64| -> Result<MoveMetrics, CliError> {
        let target = Move { band, ..Move::new(0.0, 0.0, 1e-3 * TARGET_MM) };
        measure_move(&time_s, signal_m, &target).map_err(CliError::plant(case.name()))
    };
    let mut tip_settling_s = [None; 3];
    for (settled, band) in tip_settling_s.iter_mut().zip(TIP_BANDS) {
        *settled = metrics(&simulated.tip_position_m, band)?.settling_time_s;
    }
    let base_settling_s = metrics(&simulated.setpoint_m, BASE_BAND)?.settling_time_s.unwrap_or(f64::NAN);
    let command_end_s = simulated.residual.end_tick as f64 / rate_hz;
    Ok(PaperMove { case: *case, simulated, command_end_s, base_settling_s, tip_settling_s })
}
