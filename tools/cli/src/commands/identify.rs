//! `stillbeam identify`: modes from recordings.

use clap::Args;
use stillbeam_identify::{IdentifiedMode, IdentifiedModes};

use crate::error::CliError;
use crate::identification::arguments::IdentificationArgs;
use crate::identification::axis_shapers::{AXIS_COLUMNS, AxisArgs, AxisShapers};
use crate::identification::from_recordings::{Identified, JointFit};
use crate::identification::modal_file::{ModalFile, modal_file};
use crate::outputs::keep_apart;
use crate::report::identify_page::identify_page;
use crate::streams::{Streams, json_on_stdout};

/// Natural frequencies and damping ratios, with standard errors, from recordings.
///
/// With --input the record is a forced one (a sweep, say) and the input may be a base position (unit m), a
/// base acceleration (m_s2) or a force (N). Without it the record says itself what it is: a free decay is
/// fitted, of several knocks one decay, of a random record (ambient noise, traffic, wind) the outputs alone
/// are read, and a sweep, a multisine or a tone is refused with what it needs. Several forced recordings are
/// also fitted together: same modes, each with its own initial state and offset.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam identify sweep.csv --input setpoint_m --modes 2 --json modes.json --report modes.html
  stillbeam identify ringdown.csv --modes 3
  stillbeam identify raw_data_x.csv raw_data_y.csv --sweep 5,133.33,1Hz/s --axes
  stillbeam identify frf.uff")]
pub struct IdentifyArgs {
    #[command(flatten)]
    recorded: IdentificationArgs,
    #[command(flatten)]
    axes: AxisArgs,
    /// Write JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report with plots to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
    /// Write a modal model for `simulate` to this file, from all recordings together where they are forced,
    /// else from the first one
    #[arg(long, value_name = "FILE.toml")]
    model_out: Option<String>,
}

impl IdentifyArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart(
            self.recorded.files(),
            [self.json.as_deref(), self.report.as_deref(), self.model_out.as_deref()],
        )?;
        let joint = if self.axes.axes { JointFit::Never } else { JointFit::Always };
        let identified = self.recorded.identify(joint, streams)?;
        let Identified { results, together } = &identified;
        let combined = identified.combined();
        for warning in &combined.warnings {
            streams.say(&format!("warning: {}", warning.message));
        }
        streams.say(&combined.linearity.statement);
        let axes: Vec<AxisShapers> = match self.axes.axes {
            true => results.iter().map(|axis| self.axes.recommend(axis)).collect::<Result<_, _>>()?,
            false => Vec::new(),
        };
        if !json_on_stdout(self.json.as_deref()) {
            self.print(&identified, &combined.modes, &axes, streams)?;
        }
        if let Some(file) = &self.json {
            streams.write_text(file, &identified.modes_json()?)?;
        }
        if let Some(file) = &self.report {
            streams.write_text(file, &identify_page(&identified.all(), &axes))?;
        }
        match (&self.model_out, together.as_ref().or(results.first())) {
            (Some(file), Some(best)) => {
                let ModalFile { text, remarks } = modal_file(best)?;
                for remark in remarks {
                    streams.say(&remark);
                }
                streams.write_text(file, &text)
            }
            _ => Ok(()),
        }
    }

    /// Modes for people.
    fn print(
        &self,
        identified: &Identified,
        combined: &[IdentifiedMode],
        axes: &[AxisShapers],
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let Identified { results, together } = identified;
        for result in results {
            print_modes(streams, &result.recording, &result.modes)?;
            print_fit(streams, result)?;
            print_real_pole(streams, result)?;
        }
        if results.len() > 1 && !self.axes.axes {
            print_modes(streams, "all recordings together", combined)?;
            together.as_ref().map_or(Ok(()), |together| print_real_pole(streams, together))?;
        }
        for axis in axes {
            writeln!(streams.out, "\n{axis}")?;
        }
        if !axes.is_empty() {
            streams.say(AXIS_COLUMNS);
        }
        Ok(())
    }
}

fn print_real_pole(streams: &mut Streams<'_>, result: &IdentifiedModes) -> Result<(), CliError> {
    if let Some(real) = &result.real_pole {
        writeln!(streams.out, "{}", real.words())?;
    }
    Ok(())
}

/// How much of its output the fit explains.
fn print_fit(streams: &mut Streams<'_>, result: &IdentifiedModes) -> Result<(), CliError> {
    if let Some(record) = result.records.first() {
        writeln!(streams.out, "the fit explains {:.1} % of {}", record.fit_percent, result.output)?;
    }
    Ok(())
}

fn print_modes(streams: &mut Streams<'_>, title: &str, modes: &[IdentifiedMode]) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "{title}")?;
    writeln!(out, "{:>4}{:>16}{:>12}{:>16}{:>12}", "mode", "frequency (Hz)", "±", "damping ratio", "±")?;
    for (number, mode) in (1..).zip(modes) {
        writeln!(
            out,
            "{number:>4}{:>16.6}{:>12.1e}{:>16.6}{:>12.1e}",
            mode.frequency_hz.value,
            mode.frequency_hz.stderr,
            mode.damping_ratio.value,
            mode.damping_ratio.stderr
        )?;
    }
    Ok(())
}
