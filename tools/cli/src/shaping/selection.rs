//! Which modes, and where each may be, from the command line.

use std::path::PathBuf;

use clap::Args;
use stillbeam_firmware::machine::TIMER_CLOCK_HZ;
use stillbeam_firmware::units::TickRate;
use stillbeam_shape::{
    DEFAULT_TYPE, KnownStageTypes, ModeBox, ShapeError, StagePlan, StageType, parse_stage,
};

use super::uncertainty::{BoxFloor, Uncertainty, mode_boxes};
use crate::error::CliError;
use crate::identification::modes_file::ChosenModes;
use crate::streams::Streams;

/// The arguments that name modes and their boxes.
#[derive(Debug, Args)]
pub struct ModeSelection {
    #[arg(
        long = "mode",
        value_name = "F_HZ,ZETA[,TYPE]",
        allow_hyphen_values = true,
        help = format!("A mode: undamped frequency in Hz, damping ratio, and {KnownStageTypes}; may be repeated")
    )]
    modes: Vec<String>,
    /// Take the modes from what `identify --json` wrote
    #[arg(long, value_name = "FILE", conflicts_with = "modes")]
    modes_from: Option<PathBuf>,
    /// Which of the file's modes, counted from 1; by default all
    #[arg(long = "use", value_name = "N,N...", value_delimiter = ',', conflicts_with = "modes")]
    chosen: Vec<usize>,
    /// Where the modes may be: ±PCT of frequency and damping ratio, ±PCT,PCT of each, or a FILE of
    /// `identify --json` with a box for every mode, widened to --box-floor
    #[arg(long = "box", default_value = "5%", value_name = "PCT|FILE", allow_negative_numbers = true)]
    uncertainty: String,
    #[command(flatten)]
    floor: BoxFloor,
}

/// The modes and their boxes.
pub struct Task {
    /// The modes, each with the type of its own stage.
    pub plans: Vec<StagePlan>,
    /// Where each may be, in the same order.
    pub boxes: Vec<ModeBox>,
    /// The boxes in words.
    pub described: String,
    /// What the file of the modes warns of.
    pub remarks: Vec<String>,
}

impl ModeSelection {
    /// The files that are read.
    pub fn files(&self) -> Vec<PathBuf> {
        self.modes_from.iter().cloned().chain(self.box_file()).collect()
    }

    fn box_file(&self) -> Option<PathBuf> {
        match self.uncertainty.parse() {
            Ok(Uncertainty::File(path)) => Some(path),
            _ => None,
        }
    }

    /// The modes, from the command line, from their file or else from the file of the boxes, and their boxes.
    /// Modes that name no type get `kind`.
    ///
    /// # Errors
    /// [`CliError`]: no mode, a bad one, or a file or box that cannot be used.
    pub fn task(&self, kind: StageType) -> Result<Task, CliError> {
        let uncertainty: Uncertainty = self.uncertainty.parse()?;
        let box_file = self.box_file();
        let file = match (self.modes.is_empty(), &self.modes_from) {
            (true, Some(file)) => Some(file.clone()),
            (true, None) => box_file.clone(),
            (false, _) => None,
        };
        let chosen = file.as_deref().map(|file| ChosenModes::read(file, &self.chosen)).transpose()?;
        let plans = match &chosen {
            Some(chosen) => {
                let modes = chosen.shaped(kind.textbook().unwrap_or(DEFAULT_TYPE))?;
                modes.into_iter().map(|mode| StagePlan { mode, kind }).collect()
            }
            None if self.modes.is_empty() => return Err(ShapeError::NoModes.into()),
            None => self.modes.iter().map(|spec| parse_stage(spec, kind)).collect::<Result<Vec<_>, _>>()?,
        };
        let same_file = chosen.as_ref().filter(|_| file == box_file);
        let floor = self.floor.spread()?;
        let boxes = mode_boxes(&plans, &uncertainty, floor, same_file)?;
        let remarks = chosen.as_ref().map(ChosenModes::remarks).unwrap_or_default();
        Ok(Task { plans, boxes, described: uncertainty.describe(floor), remarks })
    }
}

/// The rate that the board runs when it is asked for this one, so that its table is the same to the bit. A
/// rate that no board takes is left for the design to refuse.
pub fn board_rate_hz(wanted_hz: f64, streams: &mut Streams<'_>) -> f64 {
    let Some(wanted) = TickRate::from_hz(wanted_hz) else { return wanted_hz };
    let attainable_hz = wanted.attainable(TIMER_CLOCK_HZ).hz();
    if attainable_hz != wanted_hz {
        streams
            .say(&format!("the board's timer runs {attainable_hz} Hz for {wanted_hz} Hz; designed for that"));
    }
    attainable_hz
}
