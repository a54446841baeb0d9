//! The subcommands, one file each.

pub mod apply;
pub mod completions;
pub mod console;
pub mod convert;
pub mod data;
pub mod demo;
pub mod diagnose;
pub mod flash;
pub mod identify;
pub mod merge;
pub mod model;
pub mod paper;
pub mod plan;
pub mod record;
pub mod shape;
pub mod simulate;
pub mod tune;
pub mod upload;

use clap::{Parser, Subcommand};

use crate::error::CliError;
use crate::streams::Streams;

/// Still beams: identify a flexible machine's modes, design input shapers, and run them on the firmware.
#[derive(Debug, Parser)]
#[command(
    name = "stillbeam",
    version,
    max_term_width = 110,
    after_help = "\
Data goes to standard output, messages and progress to standard error.
Exit status: 0 done, 2 bad input, 1 anything else.

Example:
  stillbeam demo --out out/demo"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Diagnose(diagnose::DiagnoseArgs),
    Identify(identify::IdentifyArgs),
    Tune(tune::TuneArgs),
    Convert(convert::ConvertArgs),
    Merge(merge::MergeArgs),
    Data(data::DataArgs),
    Shape(shape::ShapeArgs),
    Plan(plan::PlanArgs),
    Apply(apply::ApplyArgs),
    Simulate(simulate::SimulateArgs),
    Model(model::ModelArgs),
    Console(console::ConsoleArgs),
    Record(record::RecordArgs),
    Upload(upload::UploadArgs),
    Flash(flash::FlashArgs),
    Demo(demo::DemoArgs),
    Paper(paper::PaperArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
}

impl Cli {
    /// Does what was asked.
    ///
    /// # Errors
    /// [`CliError`], whose message is for people and whose [`CliError::exit_code`] for programs.
    pub fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        match &self.command {
            Command::Diagnose(args) => args.run(streams),
            Command::Identify(args) => args.run(streams),
            Command::Tune(args) => args.run(streams),
            Command::Convert(args) => args.run(streams),
            Command::Data(args) => args.run(streams),
            Command::Shape(args) => args.run(streams),
            Command::Plan(args) => args.run(streams),
            Command::Apply(args) => args.run(streams),
            Command::Simulate(args) => args.run(streams),
            Command::Model(args) => args.run(streams),
            Command::Console(args) => args.run(streams),
            Command::Record(args) => args.run(streams),
            Command::Upload(args) => args.run(streams),
            Command::Flash(args) => args.run(streams),
            Command::Demo(args) => args.run(streams),
            Command::Paper(args) => args.run(streams),
            Command::Merge(args) => args.run(streams),
            Command::Completions(args) => args.run(streams),
            Command::Man(args) => args.run(streams),
        }
    }
}
