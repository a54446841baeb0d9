//! Modes out of what `identify --json` or `demo` wrote.

use std::path::Path;

use serde::Deserialize;
use stillbeam_firmware::shaper::{Mode, ShaperType};

use crate::error::CliError;

/// The part of the file that shaping needs.
#[derive(Deserialize)]
struct ModesFile {
    modes: Vec<ModeEntry>,
}

#[derive(Deserialize)]
struct ModeEntry {
    frequency_hz: Value,
    damping_ratio: Value,
}

#[derive(Deserialize)]
struct Value {
    value: f64,
}

/// Reads the modes of a file, each to be shaped with `kind`.
///
/// # Errors
/// [`CliError::File`] names the file and what is wrong with it.
pub fn read_modes(path: &Path, kind: ShaperType) -> Result<Vec<Mode>, CliError> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| CliError::file(name.clone(), &error))?;
    let refused = |problem| CliError::File { file: name.clone(), problem };
    let file: ModesFile = serde_json::from_slice(&bytes).map_err(|error| {
        refused(format!("not a file of modes: {error}; write one with `stillbeam identify --json`"))
    })?;
    let modes = (1..).zip(&file.modes).map(|(number, mode)| {
        Mode::new(mode.frequency_hz.value, mode.damping_ratio.value, kind)
            .map_err(|error| refused(format!("mode {number}: {error}")))
    });
    modes.collect()
}
