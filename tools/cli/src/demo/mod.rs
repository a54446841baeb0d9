//! The main job, end to end: sweep, identify, shape, move, judge.
//!
//! The board is real in one of three degrees (the core in this process, the image on an emulated board, a
//! board behind a port); beam and camera are simulated from `models/paper_beam.toml`.

pub mod board_setup;
pub mod cases;
pub mod moves;
pub mod rig;
pub mod summary;
pub mod sweep;
mod table;

use std::path::{Path, PathBuf};
use std::time::Instant;

use stillbeam_identify::{ForcedOptions, IdentifiedModes, identify_forced};
use stillbeam_plant::{Mode, SETPOINT, TIP_DEFLECTION};
use stillbeam_recording::{Recording, write_csv};

use crate::board::{BoardTarget, Consent, Session};
use crate::error::CliError;
use crate::report::demo_page::demo_page;
use crate::streams::{Streams, to_json, write_file};
use moves::MoveResult;
use rig::Rig;
use summary::{ModeSummary, MoveSummary, Summary};

pub(crate) use table::DEFINITIONS;
pub use table::results_table;

/// Everything that the demo found out.
#[derive(Clone, Debug, PartialEq)]
pub struct DemoResult {
    /// What ran.
    pub board: BoardTarget,
    /// What the board says about itself.
    pub board_info: Vec<String>,
    /// The command that swept.
    pub sweep_command: String,
    /// What the sweep recorded.
    pub sweep: Recording,
    /// What was identified from it.
    pub identified: IdentifiedModes,
    /// The simulated beam's true modes.
    pub true_modes: Vec<Mode>,
    /// The moves.
    pub moves: Vec<MoveResult>,
    /// Real time, seconds.
    pub seconds: f64,
}

/// Runs the demo and writes everything into `folder`, which is made if need be.
///
/// # Errors
/// [`CliError`] from whatever failed first.
pub fn run(
    board: &BoardTarget,
    consent: Consent,
    folder: &Path,
    streams: &mut Streams<'_>,
) -> Result<DemoResult, CliError> {
    let began = Instant::now();
    let rig = Rig::new()?;
    streams.say(&format!(
        "The board side is {}. The beam and the camera are simulated (models/paper_beam.toml).",
        board.description()
    ));
    progress(streams, 0.0, "connecting");
    let mut session = board.connect(&mut |line| progress(streams, 0.0, line))?;
    let board_info = session.command("info")?.lines;
    std::fs::create_dir_all(folder).map_err(|error| CliError::file(folder.display().to_string(), &error))?;
    for line in &board_info {
        streams.say(&format!("        {line}"));
    }

    let enabled = board.enable(&mut session, "a sweep, and moves of up to 50 mm", consent, streams)?;
    let measured = measure(&mut session, &rig, folder, streams);
    // Whatever came of it.
    enabled.leave(&mut session)?;
    let Measured { sweep_command, sweep, identified, moves } = measured?;
    progress(streams, 0.95, "writing the report");
    let seconds = began.elapsed().as_secs_f64();
    let board = board.clone();
    let result = DemoResult {
        board,
        board_info,
        sweep_command,
        sweep,
        identified,
        true_modes: rig.true_modes()?,
        moves,
        seconds,
    };
    write_file(&folder.join("report.html"), &demo_page(&result))?;
    write_file(&folder.join("summary.json"), &to_json(&result.summary())?)?;
    progress(streams, 1.0, "done");
    Ok(result)
}

/// What the board's motions give.
struct Measured {
    sweep_command: String,
    sweep: Recording,
    identified: IdentifiedModes,
    moves: Vec<MoveResult>,
}

/// Sweeps, identifies, moves with every shaper, and writes the recordings.
fn measure(
    session: &mut Session,
    rig: &Rig,
    folder: &Path,
    streams: &mut Streams<'_>,
) -> Result<Measured, CliError> {
    let (sweep_command, motion) = sweep::run(session, &mut |done| progress(streams, 0.5 * done, "sweeping"))?;
    let sweep_csv = folder.join("sweep.csv");
    let sweep = rig.record(&sweep_csv.display().to_string(), &motion, sweep::CAMERA_SEED)?;
    write_csv(&sweep_csv, &sweep)?;

    progress(streams, 50.0 / 100.0, "identifying two modes from the sweep");
    let identified = identify_forced(&sweep, &ForcedOptions::new(SETPOINT, TIP_DEFLECTION).with_modes(2))?;
    write_file(&folder.join("modes.json"), &to_json(&identified)?)?;
    for mode in &identified.modes {
        streams.say(&format!(
            "        {:.6} ± {:.1e} Hz, damping ratio {:.6} ± {:.1e}",
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr
        ));
    }

    let moves = moves::run_all(session, rig, &identified, folder, &mut |done, what| {
        progress(streams, 0.6 + 0.35 * done, what);
    })?;
    Ok(Measured { sweep_command, sweep, identified, moves })
}

/// The files that [`run`] writes, relative to its folder, for messages.
pub fn output_files() -> [PathBuf; 4] {
    ["report.html", "summary.json", "sweep.csv", "modes.json"].map(PathBuf::from)
}

impl DemoResult {
    /// The results for programs.
    pub fn summary(&self) -> Summary {
        let unshaped = self.moves.first();
        let moves = self.moves.iter().map(|result| {
            let vibration =
                unshaped.map(|unshaped| result.simulated.percentage_vibration(&unshaped.simulated));
            MoveSummary {
                shaper: result.case.name(),
                settling_time_s: result.simulated.metrics.settling_time_s,
                overshoot_pct: result.simulated.metrics.overshoot_pct,
                percentage_vibration_pct: vibration.as_ref().map_or(f64::NAN, |vibration| vibration.tip_pct),
                mode_vibration_pct: vibration.map_or_else(Vec::new, |vibration| vibration.modes_pct),
                crc32: result.crc32.to_string(),
                setpoint_csv: result.setpoint_csv.clone(),
            }
        });
        Summary {
            schema_version: 1,
            board: self.board.name().to_owned(),
            modes: ModeSummary::of(&self.identified),
            moves: moves.collect(),
            seconds: self.seconds,
        }
    }
}

fn progress(streams: &mut Streams<'_>, done: f64, what: &str) {
    streams.say(&format!("[{:3.0} %] {what}", 100.0 * done));
}
