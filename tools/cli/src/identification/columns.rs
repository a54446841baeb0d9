//! Which column is the output when nobody said.

use stillbeam_identify::possible_inputs;
use stillbeam_plant::{TIP_DEFLECTION, TIP_POSITION};
use stillbeam_recording::Recording;

use crate::board_recording::is_of_the_board;
use crate::error::CliError;

/// The output column: the one asked for, else the tip's, else the only one that is neither the time nor the input nor the
/// state or a general input of the board.
///
/// # Errors
/// [`CliError::Recording`] when the recording has no such column; [`CliError::Usage`] when there are several to choose from.
pub fn output_column(
    recording: &Recording,
    input: Option<&str>,
    asked: Option<&str>,
) -> Result<String, CliError> {
    for column in input.into_iter().chain(asked) {
        recording.column(column)?;
    }
    if let Some(asked) = asked {
        return Ok(asked.to_owned());
    }
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    let candidates: Vec<&str> =
        names.into_iter().filter(|name| Some(*name) != input && !is_of_the_board(name)).collect();
    for tip in [TIP_DEFLECTION, TIP_POSITION] {
        if candidates.contains(&tip) {
            return Ok(tip.to_owned());
        }
    }
    // Without an input, what drives the structure is in the way: a setpoint is no response.
    let drives = if input.is_none() { possible_inputs(recording, "") } else { Vec::new() };
    let responds: Vec<&str> = candidates.iter().copied().filter(|name| !drives.contains(name)).collect();
    let candidates = if responds.is_empty() { candidates } else { responds };
    match candidates.as_slice() {
        [only] => Ok((*only).to_owned()),
        [] => Err(CliError::Usage(format!(
            "{}: there is no column besides the time and the input; record the response too",
            recording.name
        ))),
        several => Err(CliError::Usage(format!(
            "{}: the output could be any of {}; name one with --output",
            recording.name,
            several.join(", ")
        ))),
    }
}
