//! What a recording suggests for a project: which of its columns drives the machine and which responds.

use stillbeam_identify::possible_inputs;
use stillbeam_plant::SETPOINT;
use stillbeam_recording::{Measurement, Recording};

use crate::board_recording::is_of_the_board;
use crate::identification::columns::output_column;

/// What a recording suggests.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proposal {
    /// What its columns are called; none where nothing is known of them.
    pub names: Vec<String>,
    /// Its columns, their units and what they may be, one a line.
    pub columns: Vec<String>,
    /// The column that seems to drive the machine.
    pub input: Option<String>,
    /// The column that seems to respond.
    pub output: Option<String>,
}

impl Proposal {
    /// From what was read of it. Functions of frequency have no input.
    pub fn of(measurement: &Measurement) -> Self {
        match measurement {
            Measurement::Recording(imported) => Self::of_recording(&imported.recording),
            Measurement::Spectra(spectra) => Self { columns: vec![spectra.words()], ..Self::default() },
        }
    }

    fn of_recording(recording: &Recording) -> Self {
        // Where nothing vibrates there is no saying which column responds.
        let output = output_column(recording, None, None).ok().map(|output| output.name);
        let inputs = possible_inputs(recording, output.as_deref().unwrap_or_default());
        let input =
            inputs.iter().find(|name| **name == SETPOINT).or(inputs.first()).map(|name| (*name).to_owned());
        let columns = recording.columns.iter().map(|column| {
            let name = column.name.as_str();
            let role = match name {
                name if Some(name) == input.as_deref() => "taken as the input, by its name",
                name if Some(name) == output.as_deref() => "taken as the output",
                name if inputs.contains(&name) => "may be an input",
                name if is_of_the_board(name) => "what the board did",
                _ => "may be an output",
            };
            format!("{name}, unit {}: {role}", column.unit())
        });
        let names = recording.columns.iter().map(|column| column.name.clone()).collect();
        Self { names, columns: columns.collect(), input, output }
    }

    /// Whether there may be these columns, one or several with commas between.
    ///
    /// # Errors
    /// Which one there is not, and which there are.
    pub fn check(&self, columns: &str) -> Result<(), String> {
        let is_there = |name: &&str| self.names.iter().any(|there| there == name);
        match columns.split(',').map(str::trim).find(|name| !is_there(name)) {
            Some(name) if !self.names.is_empty() => {
                Err(format!("there is no column `{name}`; the columns are {}", self.names.join(", ")))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_told_apart_by_what_they_are_called_and_do() {
        let time_s: Vec<f64> = (0..2000).map(|k| f64::from(k) * 1e-3).collect();
        let ringing =
            |size: f64| -> Vec<f64> { time_s.iter().map(|t| size * (-t).exp() * (40.0 * t).sin()).collect() };
        let recording = Recording::new("r", time_s.clone())
            .with_column("command_m", ringing(0.1))
            .with_column("setpoint_m", ringing(0.1))
            .with_column("beam_mm", ringing(3.0))
            .with_column("state_number", vec![0.0; 2000]);
        let proposal = Proposal::of_recording(&recording);
        assert_eq!(proposal.input.as_deref(), Some("setpoint_m"));
        assert_eq!(proposal.output.as_deref(), Some("beam_mm"));
        assert_eq!(proposal.columns.len(), 4);
        assert_eq!(proposal.check("beam_mm, setpoint_m"), Ok(()));
        assert!(
            proposal.check("beam_mm,tip_m").unwrap_err().contains("`tip_m`; the columns are command_m, ")
        );
        assert_eq!(Proposal::default().check("anything_m"), Ok(()));
        assert_eq!(proposal.columns[0], "command_m, unit m: may be an input");
        assert_eq!(proposal.columns[3], "state_number, unit number: what the board did");
    }
}
