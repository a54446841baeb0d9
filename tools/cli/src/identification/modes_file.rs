//! Identified modes as a shaper's modes.

use std::path::Path;

use stillbeam_firmware::shaper::{MAX_MODES, Mode, ShaperType};
use stillbeam_identify::{FiledMode, ModesFile};

use crate::error::CliError;

/// The modes of a file that are to be shaped, in the order in which they were asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenModes {
    /// What the file says of each, its uncertainty box included.
    pub filed: Vec<FiledMode>,
}

impl ChosenModes {
    /// Reads a file and takes the modes of these numbers, counted from 1; all where there are none.
    ///
    /// # Errors
    /// [`CliError::ModesFile`] for the file; [`CliError::Usage`] for a number that is not in it, and for more modes than
    /// a shaper takes.
    pub fn read(path: &Path, numbers: &[usize]) -> Result<Self, CliError> {
        let file = ModesFile::read(path)?;
        let count = file.modes.len();
        if numbers.is_empty() && count > MAX_MODES {
            return Err(CliError::Usage(format!(
                "the file has {count} modes and a shaper takes {MAX_MODES}; choose with --use, for example --use 1,2"
            )));
        }
        if numbers.is_empty() {
            return Ok(Self { filed: file.modes });
        }
        let choose = |number: &usize| {
            number.checked_sub(1).and_then(|index| file.modes.get(index)).cloned().ok_or_else(|| {
                CliError::Usage(format!("--use {number}: the file has the modes 1 to {count}"))
            })
        };
        Ok(Self { filed: numbers.iter().map(choose).collect::<Result<_, _>>()? })
    }

    /// The modes as a shaper of type `kind` for each takes them.
    ///
    /// # Errors
    /// [`CliError::Usage`] for a mode outside the board's range.
    pub fn shaped(&self, kind: ShaperType) -> Result<Vec<Mode>, CliError> {
        let shaped = self.filed.iter().map(|mode| {
            let frequency_hz = mode.frequency_hz.value;
            Mode::new(frequency_hz, mode.damping_ratio.value, kind)
                .map_err(|error| CliError::Usage(format!("the mode at {frequency_hz} Hz: {error}")))
        });
        shaped.collect()
    }
}
