//! Which column is the output when nobody said.

use stillbeam_identify::{
    IdentifiedModes, follows_input, loudest_line_hz, possible_inputs, strongest_column,
};
use stillbeam_plant::{SETPOINT, TIP_DEFLECTION, TIP_POSITION};
use stillbeam_recording::Recording;

use crate::board_recording::is_of_the_board;
use crate::error::CliError;

/// The output column, and which others it was chosen from.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// The column.
    pub name: String,
    /// Columns that might have been meant as well.
    pub others: Vec<String>,
}

impl Output {
    fn only(name: &str) -> Self {
        Self { name: name.to_owned(), others: Vec::new() }
    }

    /// How the column came to be taken, where nobody named it.
    pub fn chosen(&self) -> String {
        match self.others.as_slice() {
            [] => " (chosen; --output names another)".to_owned(),
            others => format!(" (the strongest; --output names another: {})", others.join(", ")),
        }
    }

    /// The columns that are loudest where no mode was found, with that frequency: what one axis shows another
    /// may not.
    pub fn unexplained(&self, recording: &Recording, found: &IdentifiedModes) -> Vec<String> {
        let known = found.modes.iter().map(|mode| mode.frequency_hz.value).collect::<Vec<_>>();
        let of_its_own = |name: &&String| {
            let hz = loudest_line_hz(recording, name)?;
            let is_new = known.iter().all(|mode_hz| (hz / mode_hz - 1.0).abs() > SAME_LINE);
            is_new.then(|| {
                format!(
                    "{name} is loudest at {hz:.2} Hz, which is none of these modes: --output {name} reads it"
                )
            })
        };
        self.others.iter().filter_map(|name| of_its_own(&name)).collect()
    }
}

/// Share of its frequency within which a line is a mode's.
const SAME_LINE: f64 = 0.05;

/// The output column: the one asked for, else the tip's, else the strongest one that is neither the time nor
/// the input nor the state or a general input of the board.
///
/// # Errors
/// [`CliError::Recording`] when the recording has no such column; [`CliError::Usage`] when there is none to
/// choose, or several and none vibrates.
pub fn output_column(
    recording: &Recording,
    input: Option<&str>,
    asked: Option<&str>,
) -> Result<Output, CliError> {
    for column in input.into_iter().chain(asked) {
        recording.column(column)?;
    }
    if let Some(asked) = asked {
        return Ok(Output::only(asked));
    }
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    let candidates: Vec<&str> =
        names.into_iter().filter(|name| Some(*name) != input && !is_of_the_board(name)).collect();
    for tip in [TIP_DEFLECTION, TIP_POSITION] {
        if candidates.contains(&tip) {
            return Ok(Output::only(tip));
        }
    }
    // Without an input, what drives the structure is in the way: a setpoint is no response.
    let drives = if input.is_none() { possible_inputs(recording, "") } else { Vec::new() };
    let responds: Vec<&str> = candidates.iter().copied().filter(|name| !drives.contains(name)).collect();
    let candidates = if responds.is_empty() { candidates } else { responds };
    match (candidates.as_slice(), strongest_column(recording, &candidates)) {
        ([only], _) => Ok(Output::only(only)),
        ([], _) => Err(CliError::Usage(format!(
            "{}: there is no column besides the time and the input; record the response too",
            recording.name
        ))),
        (several, Some(strongest)) => Ok(Output {
            name: strongest.to_owned(),
            others: several
                .iter()
                .filter(|name| **name != strongest)
                .map(|name| (*name).to_owned())
                .collect(),
        }),
        (several, None) => Err(CliError::Usage(format!(
            "{}: none of the columns {} vibrates; name the output with --output",
            recording.name,
            several.join(", ")
        ))),
    }
}

/// Units of positions, m.
const LENGTHS: [(&str, f64); 5] = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("cm", 1e-2), ("px", 1.0)];

/// What to say of an output that moves with the base and is not called the tip's position: only under that
/// name the base's own motion is taken out of it.
pub fn holds_base_motion(recording: &Recording, input: &str, output: &str) -> Option<String> {
    let length = |name: &str| {
        let (_, unit) = name.rsplit_once('_')?;
        // Speeds and accelerations end in other units: `m_s`, `mm_s2`.
        LENGTHS.iter().find(|(known, _)| *known == unit).map(|(_, scale)| *scale)
    };
    let (of_input, of_output) = (length(input)?, length(output)?);
    let is_called_so = [TIP_POSITION, TIP_DEFLECTION].contains(&output) || output.contains("deflection");
    if is_called_so || of_input != of_output || !follows_input(recording, input, output) {
        return None;
    }
    let taken = |name: &str, source: &str, scale: f64| match scale {
        1.0 => format!("--column {name}={source}"),
        _ => format!("--column {name}={source}*{scale}"),
    };
    Some(format!(
        "{output} moves as {input} does: if it was measured from beside the machine, say so with {} {} --input {SETPOINT}, which takes the base's own motion out of it; else that motion stands in for modes",
        taken(SETPOINT, input, of_input),
        taken(TIP_POSITION, output, of_output),
    ))
}
