//! `--box` and `--box-floor`: where a machine's modes may be.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use stillbeam_identify::{BOX_STANDARD_ERRORS, FiledMode, ModesFile};
use stillbeam_shape::{ModeBox, StagePlan};

use crate::error::CliError;
use crate::identification::modes_file::ChosenModes;

/// ± these fractions of a mode's frequency and damping ratio, each at least 0 and below 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Of the frequency.
    pub frequency: f64,
    /// Of the damping ratio.
    pub damping: f64,
}

impl Spread {
    /// `5`, `5%` or `5%,20%` (frequency, damping ratio); nothing for what is no percentage.
    fn parse(text: &str) -> Option<Result<Self, OutOfRange>> {
        let percent = |part: &str| Some(part.trim().trim_end_matches('%').parse::<f64>().ok()? / 100.0);
        let parts: Vec<Option<f64>> = text.split(',').map(percent).collect();
        let (frequency, damping) = match parts.as_slice() {
            [Some(both)] => (*both, *both),
            [Some(frequency), Some(damping)] => (*frequency, *damping),
            _ => return None,
        };
        let possible = [frequency, damping].iter().all(|fraction| (0.0..1.0).contains(fraction));
        Some(if possible { Ok(Self { frequency, damping }) } else { Err(OutOfRange) })
    }
}

/// A percentage that is none of a box.
struct OutOfRange;

impl Spread {
    /// As it is written on the command line.
    pub fn argument(&self) -> String {
        let percent = |fraction: f64| (1e6 * fraction).round() / 1e4;
        format!("{}%,{}%", percent(self.frequency), percent(self.damping))
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |fraction: f64| (1e6 * fraction).round() / 1e4;
        write!(f, "frequency ±{} %, damping ratio ±{} %", percent(self.frequency), percent(self.damping))
    }
}

/// The least that a machine's modes are taken to move by, whatever one recording's standard errors say.
#[derive(Clone, Debug, Args)]
pub struct BoxFloor {
    /// The least uncertainty of measured modes: ±PCT of frequency and damping ratio, or ±PCT,PCT of each. A
    /// recording's standard errors say nothing of payload, temperature and position
    #[arg(long, value_name = "PCT", default_value = DEFAULT_FLOOR, allow_negative_numbers = true)]
    box_floor: String,
}

/// Payload, temperature and position move most machines by less.
const DEFAULT_FLOOR: &str = "5%";

impl Default for BoxFloor {
    fn default() -> Self {
        Self::new(DEFAULT_FLOOR)
    }
}

impl BoxFloor {
    /// `5%` for both, or `5%,20%` for frequency and damping ratio.
    pub fn new(percentages: &str) -> Self {
        Self { box_floor: percentages.to_owned() }
    }

    /// The floor.
    ///
    /// # Errors
    /// [`CliError::Usage`] for what is no percentage from 0 to below 100.
    pub fn spread(&self) -> Result<Spread, CliError> {
        let text = &self.box_floor;
        Spread::parse(text).and_then(Result::ok).ok_or_else(|| {
            CliError::Usage(format!(
                "--box-floor {text}: percentages are at least 0 and below 100; write 5% for both frequency and damping \
                 ratio, or 5%,20% for each"
            ))
        })
    }
}

/// The box of a measured mode: as wide as was measured, and no narrower than the floor.
///
/// # Errors
/// [`CliError::Usage`] where nothing can be designed over what was measured.
pub fn measured_box(mode: &FiledMode, floor: Spread) -> Result<ModeBox, CliError> {
    let area = mode.design_box().map_err(|error| CliError::Usage(error.to_string()))?;
    let (hz, zeta) = (mode.frequency_hz.value, mode.damping_ratio.value);
    let measured = ModeBox::new(hz, zeta, area.frequency_hz, area.damping_ratio)?;
    Ok(measured.at_least(floor.frequency, floor.damping)?)
}

/// What the boxes of measured modes are, in words.
pub fn describe_measured(file: &std::path::Path, floor: Spread) -> String {
    format!(
        "the largest of what {} measured ({BOX_STANDARD_ERRORS} standard errors either way, and what depends on amplitude), \
         what differs between its recordings, and the floor ({floor}; --box-floor)",
        file.display()
    )
}

/// Where modes may be, as a person says it.
#[derive(Clone, Debug, PartialEq)]
pub enum Uncertainty {
    /// Around each mode.
    Spread(Spread),
    /// The boxes in a file of `identify --json`.
    File(PathBuf),
}

impl FromStr for Uncertainty {
    type Err = CliError;

    /// `5`, `5%`, `5%,20%` (frequency, damping ratio) or else a file.
    fn from_str(text: &str) -> Result<Self, CliError> {
        match Spread::parse(text) {
            None => Ok(Self::File(PathBuf::from(text))),
            Some(Ok(spread)) => Ok(Self::Spread(spread)),
            Some(Err(OutOfRange)) => Err(CliError::Usage(format!(
                "--box {text}: percentages are at least 0 and below 100; write 5% for both frequency and damping ratio, \
                 5%,20% for each, or name a file of `stillbeam identify --json`"
            ))),
        }
    }
}

impl Uncertainty {
    /// In words, for the head of a table.
    pub fn describe(&self, floor: Spread) -> String {
        match self {
            Self::Spread(spread) => spread.to_string(),
            Self::File(path) => describe_measured(path, floor),
        }
    }
}

/// The box of every mode. From a file that the modes were not taken from, every mode gets the box that it
/// lies in.
///
/// # Errors
/// [`CliError`]: boxes that cannot be designed for, or a mode in no box of the file.
pub fn mode_boxes(
    plans: &[StagePlan],
    uncertainty: &Uncertainty,
    floor: Spread,
    chosen: Option<&ChosenModes>,
) -> Result<Vec<ModeBox>, CliError> {
    let nominal = |plan: &StagePlan| (plan.mode.frequency_hz(), plan.mode.damping_ratio());
    let path = match uncertainty {
        Uncertainty::Spread(spread) => {
            let around = plans.iter().map(|plan| {
                let (hz, zeta) = nominal(plan);
                ModeBox::around(hz, zeta, spread.frequency, spread.damping).map_err(CliError::from)
            });
            return around.collect();
        }
        Uncertainty::File(path) => path,
    };
    let filed = match chosen {
        Some(chosen) => chosen.filed.clone(),
        None => ModesFile::read(path)?.modes,
    };
    let areas: Result<Vec<_>, _> = filed.iter().map(|mode| measured_box(mode, floor)).collect();
    let areas = areas.map_err(|error| CliError::Usage(format!("{}: {error}", path.display())))?;
    let held = plans.iter().map(|plan| {
        let (hz, zeta) = nominal(plan);
        let holds = |[low, high]: [f64; 2], value: f64| low <= value && value <= high;
        let area =
            areas.iter().find(|area| holds(area.frequency_hz(), hz) && holds(area.damping_ratio(), zeta));
        let area = area.ok_or_else(|| {
            CliError::Usage(format!(
                "the mode {hz},{zeta} lies in no box of {}; leave --mode out to take the modes from there",
                path.display()
            ))
        })?;
        Ok(ModeBox::new(hz, zeta, area.frequency_hz(), area.damping_ratio())?)
    });
    held.collect()
}
