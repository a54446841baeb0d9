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
    /// [`CliError::ModesFile`] for the file; [`CliError::Usage`] for a number that is not in it, and for more
    /// modes than a shaper takes.
    pub fn read(path: &Path, numbers: &[usize]) -> Result<Self, CliError> {
        Self::of(ModesFile::read(path)?, &path.display().to_string(), numbers)
    }

    /// The same of a file that was read before; `name` is what messages call it.
    ///
    /// # Errors
    /// As [`ChosenModes::read`].
    pub fn of(file: ModesFile, name: &str, numbers: &[usize]) -> Result<Self, CliError> {
        let count = file.modes.len();
        if numbers.is_empty() && count > MAX_MODES {
            return Err(CliError::Usage(format!(
                "the file has {count} modes and a shaper takes {MAX_MODES}; choose with --use, for example --use 1,2"
            )));
        }
        if numbers.is_empty() {
            return Self { filed: file.modes }.without_doubtful(name);
        }
        let choose = |number: &usize| {
            number.checked_sub(1).and_then(|index| file.modes.get(index)).cloned().ok_or_else(|| {
                CliError::Usage(format!("--use {number}: the file has the modes 1 to {count}"))
            })
        };
        Self { filed: numbers.iter().map(choose).collect::<Result<_, _>>()? }.without_doubtful(name)
    }

    /// Refuses what the identification itself calls no mode.
    fn without_doubtful(self, name: &str) -> Result<Self, CliError> {
        let doubted = self.filed.iter().find_map(|mode| {
            let doubt = mode.doubts.iter().find(|doubt| doubt.is_no_mode)?;
            Some((mode.frequency_hz.value, doubt))
        });
        match doubted {
            Some((frequency_hz, doubt)) => Err(CliError::Usage(format!(
                "{name}: the line at {frequency_hz:.4} Hz is no mode to shape for: {}; choose others with --use, or record again",
                doubt.message
            ))),
            None => Ok(self),
        }
    }

    /// What else the identification warned of, one sentence each.
    pub fn remarks(&self) -> Vec<String> {
        self.filed
            .iter()
            .flat_map(|mode| &mode.doubts)
            .map(|doubt| format!("warning: {}", doubt.message))
            .collect()
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
