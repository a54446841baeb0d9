//! `stillbeam demo`: the main job.

use std::path::PathBuf;

use clap::Args;

use crate::board::{BoardTarget, Consent};
use crate::demo::{output_files, results_table, run};
use crate::error::CliError;
use crate::streams::Streams;

/// Sweep, identify, design six shapers, move with each, and compare with the paper.
///
/// The board side is the firmware: its portable core in this process, its image on an emulated board, or a
/// real board. The beam and the camera are simulated.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam demo
  stillbeam demo --board qemu --out out/emulated
  stillbeam demo --board /dev/ttyACM0")]
pub struct DemoArgs {
    /// core, qemu, or the path of a serial port
    #[arg(long, default_value = "core", value_name = "core|qemu|PORT")]
    board: String,
    /// Folder for recordings, modes, tables, report.html and summary.json
    #[arg(long, default_value = "out/demo", value_name = "DIR")]
    out: PathBuf,
    /// Go on without asking whether the machine may move
    #[arg(long)]
    yes: bool,
}

impl DemoArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let result = run(&BoardTarget::parse(&self.board), Consent::from_yes(self.yes), &self.out, streams)?;
        write!(streams.out, "{}", results_table(&result))?;
        for file in output_files() {
            streams.say(&format!("wrote {}", self.out.join(file).display()));
        }
        Ok(())
    }
}
