//! `--box`: percentages around the modes, or the boxes that `identify` wrote.

use std::path::PathBuf;
use std::str::FromStr;

use stillbeam_identify::{BOX_STANDARD_ERRORS, ModesFile};
use stillbeam_shape::{ModeBox, StagePlan};

use crate::error::CliError;
use crate::identification::modes_file::ChosenModes;

/// Where modes may be, as a person says it.
#[derive(Clone, Debug, PartialEq)]
pub enum Uncertainty {
    /// ± these fractions of frequency and damping ratio.
    Fractions {
        /// Of the frequency.
        frequency: f64,
        /// Of the damping ratio.
        damping: f64,
    },
    /// The boxes in a file of `identify --json`.
    File(PathBuf),
}

impl FromStr for Uncertainty {
    type Err = CliError;

    /// `5`, `5%`, `5%,20%` (frequency, damping ratio) or else a file.
    fn from_str(text: &str) -> Result<Self, CliError> {
        let percent = |part: &str| {
            let number = part.trim().trim_end_matches('%').parse::<f64>().ok()?;
            Some(number / 100.0)
        };
        let parts: Vec<Option<f64>> = text.split(',').map(percent).collect();
        let (frequency, damping) = match parts.as_slice() {
            [Some(both)] => (*both, *both),
            [Some(frequency), Some(damping)] => (*frequency, *damping),
            _ => return Ok(Self::File(PathBuf::from(text))),
        };
        if [frequency, damping].iter().all(|fraction| (0.0..1.0).contains(fraction)) {
            return Ok(Self::Fractions { frequency, damping });
        }
        Err(CliError::Usage(format!(
            "--box {text}: percentages are at least 0 and below 100; write 5% for both frequency and damping ratio, \
             5%,20% for each, or name a file of `stillbeam identify --json`"
        )))
    }
}

impl Uncertainty {
    /// In words, for the head of a table.
    pub fn describe(&self) -> String {
        match self {
            Self::Fractions { frequency, damping } => {
                let percent = |fraction: f64| format!("±{} %", (1e6 * fraction).round() / 1e4);
                format!("frequency {}, damping ratio {}", percent(*frequency), percent(*damping))
            }
            Self::File(path) => format!(
                "of {}: {BOX_STANDARD_ERRORS} standard errors either way, and what depends on amplitude",
                path.display()
            ),
        }
    }
}

/// The box of every mode. From a file that the modes were not taken from, every mode gets the box that it lies in.
///
/// # Errors
/// [`CliError`]: boxes that cannot be designed for, or a mode in no box of the file.
pub fn mode_boxes(
    plans: &[StagePlan],
    uncertainty: &Uncertainty,
    chosen: Option<&ChosenModes>,
) -> Result<Vec<ModeBox>, CliError> {
    match uncertainty {
        Uncertainty::Fractions { frequency, damping } => plans
            .iter()
            .map(|plan| {
                let (hz, zeta) = (plan.mode.frequency_hz(), plan.mode.damping_ratio());
                ModeBox::around(hz, zeta, *frequency, *damping).map_err(CliError::from)
            })
            .collect(),
        Uncertainty::File(path) => {
            let filed = match chosen {
                Some(chosen) => chosen.filed.clone(),
                None => ModesFile::read(path)?.modes,
            };
            let areas: Result<Vec<_>, _> = filed.iter().map(|mode| mode.design_box()).collect();
            let areas = areas.map_err(|error| CliError::Usage(format!("{}: {error}", path.display())))?;
            plans
                .iter()
                .map(|plan| {
                    let (hz, zeta) = (plan.mode.frequency_hz(), plan.mode.damping_ratio());
                    let holds = |[low, high]: [f64; 2], value: f64| low <= value && value <= high;
                    let area = areas.iter().find(|area| {
                        holds(area.frequency_hz, hz) && holds(area.damping_ratio, zeta)
                    });
                    let area = area.ok_or_else(|| {
                        CliError::Usage(format!(
                            "the mode {hz},{zeta} lies in no box of {}; leave --mode out to take the modes from there",
                            path.display()
                        ))
                    })?;
                    Ok(ModeBox::new(hz, zeta, area.frequency_hz, area.damping_ratio)?)
                })
                .collect()
        }
    }
}
