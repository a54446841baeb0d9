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
pub mod live;
pub mod merge;
pub mod model;
pub mod new;
pub mod paper;
pub mod plan;
pub mod record;
pub mod shape;
pub mod simulate;
pub mod tune;
pub mod upload;

use std::ffi::OsString;
use std::path::Path;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::error::CliError;
use crate::project::words::{Misunderstood, understand};
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
    /// Take nothing of the project whose folder this is
    #[arg(long, global = true, display_order = 1000)]
    no_project: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    New(new::NewArgs),
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
    Live(live::LiveArgs),
    Upload(upload::UploadArgs),
    Flash(flash::FlashArgs),
    Demo(demo::DemoArgs),
    Paper(paper::PaperArgs),
    Completions(completions::CompletionsArgs),
    Man(completions::ManArgs),
}

impl Cli {
    /// Reads the words of a command line, the first of them the program's name, in the project around a
    /// working directory; and what to say of that project before the work.
    ///
    /// # Errors
    /// [`Misunderstood`], which is also a request for help.
    pub fn understand(
        words: &[OsString],
        working_directory: &Path,
    ) -> Result<(Self, Vec<String>), Misunderstood> {
        let understood = understand(&Self::command(), words, working_directory)?;
        let cli = Self::from_arg_matches(&understood.matches)
            .map_err(|error| Misunderstood::Words(error.format(&mut Self::command()), Vec::new()))?;
        Ok((cli, understood.told))
    }

    /// Does what was asked.
    ///
    /// # Errors
    /// [`CliError`], whose message is for people and whose [`CliError::exit_code`] for programs.
    pub fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        match &self.command {
            Command::New(args) => args.run(streams),
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
            Command::Live(args) => args.run(streams),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::{Project, ProjectFile, offers, places};

    /// Everything that a file can say.
    const FULL: &str = r#"
schema = 1
model = "models/own.toml"
[recordings]
input = "setpoint_m"
output = "encoder_m"
input_kind = "force"
output_quantity = "position"
time = "t"
format = "csv"
skip_lines = 1
separator = "comma"
decimal = "point"
[board]
port = "core"
rate_hz = 4000
[limits]
velocity_mm_s = 1
acceleration_mm_s2 = 1
jerk_mm_s3 = 1
travel_mm = [-1, 1]
[shaper]
tolerance = 0.1
frequency_floor_percent = 1
"#;

    /// An offer for an option that does not exist would be lost without a word.
    #[test]
    fn everything_that_a_project_offers_is_an_option_of_its_command() {
        let folder = tempfile::tempdir().unwrap();
        for file in [places::MODES_FILE, places::TABLE_FILE, "recordings/a.csv"] {
            std::fs::create_dir_all(folder.path().join(file).parent().unwrap()).unwrap();
            std::fs::write(folder.path().join(file), "").unwrap();
        }
        let mut file = ProjectFile::parse(FULL, "full").unwrap();
        let described = Cli::command();
        let check = |file: &ProjectFile| {
            let project = Project { folder: folder.path().to_owned(), file: file.clone() };
            for name in offers::COMMANDS {
                let command = described.find_subcommand(name).unwrap();
                let offers = project.offers(name).unwrap();
                assert!(!offers.values.is_empty() && offers.missing.is_empty(), "{name}");
                for offer in offers.values {
                    for id in std::iter::once(&offer.id).chain(offer.yields_to).chain(offer.needs) {
                        assert!(command.get_arguments().any(|it| it.get_id() == id), "{name} {id}");
                    }
                }
            }
        };
        check(&file);
        let recordings = &mut file.recordings;
        (recordings.time, recordings.sample_rate_hz) = (None, Some(100.0));
        (recordings.input, recordings.sweep) = (None, Some("1,9,10s".to_owned()));
        recordings.columns = vec!["tip_m=y".to_owned()];
        check(&file);
    }
}
