//! A table or a plan on a board: uploaded, moved or played, compared with the host, and felt by perturbed
//! modes.

use std::error::Error;

use stillbeam::board::{BoardTarget, StreamedMotion};
use stillbeam::command_signal::{MotionCommand, shaped_setpoints_m};
use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_plant::{Mode, PrescribedBase, ResidualVibration};
use stillbeam_shape::{BoardTable, ModeBox, MoveBounds, PlayedMove, ShaperDesign};

use super::RATE_HZ;

/// Ticks from one streamed sample to the next.
const DECIMATION: u32 = 4;
/// Places over each box: frequencies and damping ratios.
const PLACES: (u32, u32) = (15, 3);

/// What the board did.
pub(super) struct Checked {
    /// The largest residual of each mode over its box, a fraction.
    pub(super) worst: Vec<f64>,
    /// Setpoints that were compared.
    pub(super) compared: usize,
}

impl Checked {
    /// Runs a table on the board of this name.
    pub(super) fn on(
        board: &str,
        design: &ShaperDesign,
        table: &ShaperTable,
        boxes: &[ModeBox],
    ) -> Result<Self, Box<dyn Error>> {
        let command: MotionCommand = "move 50mm".parse()?;
        let shaped = shaped_setpoints_m(&command, RATE_HZ, Some(table))?;
        let unshaped = shaped_setpoints_m(&command, RATE_HZ, None)?;
        let compared = streamed_as(&shaped, board, design)?;
        let worst: Result<Vec<f64>, Box<dyn Error>> =
            boxes.iter().map(|area| moved(&shaped, &unshaped, area)).collect();
        Ok(Self { worst: worst?, compared })
    }
}

/// A whole move, played by the board of this name within its limits in m/s, m/s² and m/s³: the same numbers,
/// relative to a step of the same distance.
pub(super) fn played(
    board: &str,
    planned: &PlayedMove,
    bounds: MoveBounds,
    boxes: &[ModeBox],
) -> Result<Checked, Box<dyn Error>> {
    let mut session = BoardTarget::parse(board).connect(&mut |line| eprintln!("{line}"))?;
    match BoardTarget::parse(board) {
        // A person has enabled it before, who knows that it will move.
        BoardTarget::Port(_) => session.enable_drive()?,
        BoardTarget::Core | BoardTarget::Qemu => session.enable_virtual_drive()?,
    }
    for (name, limit) in [
        ("velocity_mm_s", bounds.velocity_m_s),
        ("acceleration_mm_s2", bounds.acceleration_m_s2),
        ("jerk_mm_s3", bounds.jerk_m_s3),
    ] {
        session.command(&format!("set move.{name} {}", 1e3 * limit))?;
    }
    session.command_when_ready("apply")?;
    session.upload_plan(&planned.plan)?;
    let motion = session.run_motion("play", DECIMATION, 0.05, &mut |_| {})?;
    // The stream is cut at the first change, which a gentle start puts off by some ticks.
    let still = planned.positions_nm.iter().take_while(|position| **position == 0).count();
    let host = planned.positions_nm.get(still.saturating_sub(1)..).unwrap_or_default();
    let compared = same_as(host, &motion, &planned.plan.crc32().to_string())?;
    let setpoints_m: Vec<f64> = planned.positions_m().collect();
    let mut step_m = vec![0.0; setpoints_m.len() - 1];
    step_m.extend(setpoints_m.last());
    let worst: Result<Vec<f64>, Box<dyn Error>> =
        boxes.iter().map(|area| moved(&setpoints_m, &step_m, area)).collect();
    Ok(Checked { worst: worst?, compared })
}

/// Compares every setpoint that the board streams of its 50 mm move with the host's, and counts them.
fn streamed_as(shaped_m: &[f64], board: &str, design: &ShaperDesign) -> Result<usize, Box<dyn Error>> {
    let mut session = BoardTarget::parse(board).connect(&mut |line| eprintln!("{line}"))?;
    match BoardTarget::parse(board) {
        // A person has enabled it before, who knows that it will move.
        BoardTarget::Port(_) => session.enable_drive()?,
        BoardTarget::Core | BoardTarget::Qemu => session.enable_virtual_drive()?,
    }
    session.upload_table(&BoardTable::from_json("table", &design.to_json())?)?;
    let motion = session.run_motion("move 50", DECIMATION, 0.05, &mut |_| {})?;
    let nanometres = |position_m: f64| (1e9 * position_m).round() as i64;
    let host: Vec<i64> = shaped_m.iter().map(|position_m| nanometres(*position_m)).collect();
    same_as(&host, &motion, &design.crc32.to_string())
}

/// Compares streamed setpoints with the host's, one per tick in nanometres, and counts them.
fn same_as(host: &[i64], motion: &StreamedMotion, what: &str) -> Result<usize, Box<dyn Error>> {
    let nanometres = |position_m: f64| (1e9 * position_m).round() as i64;
    let streamed: Vec<i64> = motion.setpoints_m().into_iter().map(nanometres).collect();
    // The first sample is up to a decimation before the first change; the move starts at some tick of it.
    let matches = |offset: usize| {
        streamed.iter().enumerate().all(|(index, position)| {
            let tick = (index * DECIMATION as usize).saturating_sub(offset);
            host.get(tick).or(host.last()) == Some(position)
        })
    };
    if (0..=DECIMATION as usize).any(matches) {
        Ok(streamed.len())
    } else {
        Err(format!("{what}: the board's setpoints are not the host's").into())
    }
}

/// The largest residual of a mode, simulated at places of its box, relative to the unshaped move.
fn moved(shaped_m: &[f64], unshaped_m: &[f64], area: &ModeBox) -> Result<f64, Box<dyn Error>> {
    let along = |[low, high]: [f64; 2], place: u32, of: u32| {
        low + (high - low) * f64::from(place) / f64::from(of - 1)
    };
    let mut worst: f64 = 0.0;
    for place in 0..PLACES.0 * PLACES.1 {
        let mode = Mode {
            frequency_hz: along(area.frequency_hz(), place % PLACES.0, PLACES.0),
            damping_ratio: along(area.damping_ratio(), place / PLACES.0, PLACES.1),
            participation: vec![1.0],
        };
        let left = |setpoints_m: &[f64]| -> Result<ResidualVibration, Box<dyn Error>> {
            let plant = PrescribedBase::from_modes(vec![mode.clone()], None, RATE_HZ, 0.0)?;
            Ok(ResidualVibration::after(plant, setpoints_m)?)
        };
        let relative = left(shaped_m)?.relative_to(&left(unshaped_m)?);
        worst = relative.modes_pct.iter().fold(worst, |worst, percent| worst.max(percent / 100.0));
    }
    Ok(worst)
}
