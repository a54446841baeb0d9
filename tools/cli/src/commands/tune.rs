//! `stillbeam tune`: from recordings to a recommended shaper, with its reasons.

use std::path::{Path, PathBuf};

use clap::Args;
use stillbeam_identify::ModesFile;

use crate::error::CliError;
use crate::identification::arguments::IdentificationArgs;
use crate::identification::from_recordings::{Identified, JointFit};
use crate::outputs::keep_apart;
use crate::report::identify_page::identify_page;
use crate::report::shape_page::{Purpose, shape_page};
use crate::shaping::{BoxFloor, Candidate, Tolerance, board_rate_hz, describe_measured};
use crate::streams::{Streams, json_on_stdout};
use crate::tuning::{NextCommands, Reasons, Tuning, TuningNumbers, TuningRequest, print_tables};

/// Find the modes in recordings, recommend a shaper for them, and say why.
///
/// It takes the shortest shaper that leaves no more vibration than --tolerance, wherever the modes may be:
/// within what was measured, what differs between the recordings, and at least --box-floor. It writes the
/// modes, the shaper's table for `stillbeam upload`, and a report on each.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam tune empty.csv loaded.csv --input setpoint_m --out out/tune
  stillbeam tune knock.csv --modes 2 --tolerance 0.02
  stillbeam upload out/tune/table.json --port /dev/ttyACM0 --save")]
pub struct TuneArgs {
    #[command(flatten)]
    recorded: IdentificationArgs,
    /// Which of the modes to shape for, counted from 1; by default all, and at most four
    #[arg(long = "use", value_name = "N,N...", value_delimiter = ',')]
    chosen: Vec<usize>,
    #[command(flatten)]
    floor: BoxFloor,
    #[command(flatten)]
    tolerance: Tolerance,
    /// Ticks per second; the board runs the nearest rate that divides its timer clock
    #[arg(long, default_value_t = 4000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate: f64,
    /// Folder for modes.json, modes.html, table.json and shaper.html
    #[arg(
        long,
        default_value = "out/tune",
        value_name = "DIR",
        conflicts_with_all = ["modes_file", "table_file", "report_dir"]
    )]
    out: PathBuf,
    /// Write the modes to this file instead of into a folder for all
    #[arg(long, value_name = "FILE.json")]
    modes_file: Option<PathBuf>,
    /// Write the table to this file instead of into a folder for all
    #[arg(long, value_name = "FILE.json")]
    table_file: Option<PathBuf>,
    /// Write modes.html and shaper.html into this folder instead of into a folder for all
    #[arg(long, value_name = "DIR")]
    report_dir: Option<PathBuf>,
    /// Write the recommendation as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
}

/// What is written.
struct Files {
    modes: String,
    modes_page: String,
    table: String,
    shaper_page: String,
}

impl Files {
    /// Their names, in folders that are made if need be: a file whose place was not named is in the folder
    /// for all.
    fn of(args: &TuneArgs) -> Result<Self, CliError> {
        let placed = |file: &Option<PathBuf>, name: &str| file.clone().unwrap_or_else(|| args.out.join(name));
        let reports = args.report_dir.as_ref().unwrap_or(&args.out);
        let files = [
            placed(&args.modes_file, "modes.json"),
            reports.join("modes.html"),
            placed(&args.table_file, "table.json"),
            reports.join("shaper.html"),
        ];
        for folder in files.iter().filter_map(|file| file.parent()) {
            std::fs::create_dir_all(folder)
                .map_err(|error| CliError::file(folder.display().to_string(), &error))?;
        }
        let [modes, modes_page, table, shaper_page] = files.map(|file| file.display().to_string());
        Ok(Self { modes, modes_page, table, shaper_page })
    }
}

impl TuneArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let (floor, tolerance) = (self.floor.spread()?, self.tolerance.fraction()?);
        let files = Files::of(self)?;
        let Files { modes, modes_page, table, shaper_page } = &files;
        let written = [modes, modes_page, table, shaper_page].map(|file| Some(file.as_str()));
        keep_apart(self.recorded.files(), written.into_iter().chain([self.json.as_deref()]))?;

        let identified = self.recorded.identify(JointFit::WhereTheyAgree, streams)?;
        let filed = write_modes(&identified, &files, streams)?;
        let request = TuningRequest {
            chosen: self.chosen.clone(),
            floor,
            tolerance,
            rate_hz: board_rate_hz(self.rate, streams),
        };
        let tuning = Tuning::new(&identified, &filed, request)?;
        streams.write_text(table, &tuning.recommendation.best().design.to_json())?;
        if !json_on_stdout(self.json.as_deref()) {
            print(&tuning, &NextCommands::of(&tuning, modes, table), streams)?;
        }
        if let Some(file) = &self.json {
            streams.write_json(file, &TuningNumbers::of(&tuning))?;
        }
        // Its chart of all durations takes far longer than the recommendation, which nobody should have to
        // wait for.
        streams.say("drawing the report on the shaper");
        streams.write_text(shaper_page, &report_on_shaper(&tuning, modes))
    }
}

/// The modes and their report, as `identify` writes them.
fn write_modes(
    identified: &Identified,
    files: &Files,
    streams: &mut Streams<'_>,
) -> Result<ModesFile, CliError> {
    for warning in &identified.combined().warnings {
        streams.say(&format!("warning: {}", warning.message));
    }
    let json = identified.modes_json()?;
    streams.write_text(&files.modes, &json)?;
    streams.write_text(&files.modes_page, &identify_page(&identified.all(), &[]))?;
    Ok(ModesFile::parse(&files.modes, json.as_bytes())?)
}

/// The report on the shaper, as `shape` writes it, with the reasons.
fn report_on_shaper(tuning: &Tuning, modes: &str) -> String {
    let recommendation = &tuning.recommendation;
    let own = Candidate { name: "this one".to_owned(), ..recommendation.best().clone() };
    let purpose = Purpose {
        boxes: &tuning.modes.boxes(),
        described: &describe_measured(Path::new(modes), tuning.request.floor),
        tolerance: recommendation.tolerance(),
        reasons: &Reasons::of(tuning).all(),
    };
    shape_page(&own, recommendation.candidates().to_vec(), &purpose)
}

/// The recommendation for people.
fn print(tuning: &Tuning, next: &NextCommands, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let reasons = Reasons::of(tuning);
    writeln!(streams.out, "{}", reasons.take)?;
    for reason in &reasons.because {
        writeln!(streams.out, "- {reason}")?;
    }
    writeln!(streams.out)?;
    print_tables(tuning, streams)?;
    let left_out: Vec<String> = tuning.modes.left_out.iter().map(|mode| mode.why.clone()).collect();
    print_list("Left out, and not shaped for:", &left_out, streams)?;
    print_list("Look at this before you trust it:", &tuning.doubts, streams)?;
    writeln!(
        streams.out,
        "\nSend it to the board (PORT is its serial port, such as /dev/ttyACM0; core tries it without a board):\n  {}",
        next.upload
    )?;
    if let Some((name, command)) = &next.another {
        writeln!(streams.out, "Another one of the list, for example {name}:\n  {command}")?;
    }
    Ok(streams.out.flush()?)
}

fn print_list(title: &str, lines: &[String], streams: &mut Streams<'_>) -> Result<(), CliError> {
    if !lines.is_empty() {
        writeln!(streams.out, "\n{title}")?;
    }
    for line in lines {
        writeln!(streams.out, "- {line}")?;
    }
    Ok(())
}
