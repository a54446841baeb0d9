//! `stillbeam paper`: every table and figure of the paper, made again.

use std::path::PathBuf;

use clap::Args;

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::paper::sections::results_page;
use crate::paper::{OUTPUT_FILES, run};
use crate::streams::Streams;

/// Make every table and figure of the paper again, beside what it prints.
///
/// Setpoints are made by the firmware's core in this process; beam and camera are simulated.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam paper --out out/paper
  stillbeam paper --results docs/results/paper.md")]
pub struct PaperArgs {
    /// Folder for report.html, results.md, summary.json and the sweeps
    #[arg(long, default_value = "out/paper", value_name = "DIR")]
    out: PathBuf,
    /// Also write the tables to this file
    #[arg(long, value_name = "FILE.md")]
    results: Option<String>,
}

impl PaperArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart([], [self.results.as_deref()])?;
        let result = run(&self.out, streams)?;
        if let Some(file) = &self.results {
            streams.write_text(file, &results_page(&result))?;
        }
        for file in OUTPUT_FILES {
            streams.say(&format!("wrote {}", self.out.join(file).display()));
        }
        streams.say(&format!("took {:.1} s", result.seconds));
        Ok(())
    }
}
