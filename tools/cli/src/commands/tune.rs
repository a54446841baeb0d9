//! `stillbeam tune`: from recordings to a recommended shaper, with its reasons.

use std::path::{Path, PathBuf};

use clap::Args;
use stillbeam_identify::ModesFile;

use crate::error::CliError;
use crate::identification::from_recordings::{Identified, JointFit};
use crate::identification::options::IdentificationArgs;
use crate::outputs::keep_apart;
use crate::report::identify_page::identify_page;
use crate::report::shape_page::{Purpose, shape_page};
use crate::shaping::{BoxFloor, Candidate, Tolerance, board_rate_hz, describe_measured};
use crate::streams::{Streams, json_on_stdout};
use crate::tuning::{NextCommands, Reasons, Tuning, TuningNumbers, TuningRequest, print_tables};

/// Find the modes in recordings, recommend a shaper for them, and say why.
///
/// It takes the shortest shaper that leaves no more vibration than --tolerance, wherever the modes may be: within
/// what was measured, what differs between the recordings, and at least --box-floor. It writes the modes, the
/// shaper's table for `stillbeam upload`, and a report on each.
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
    #[arg(long, default_value = "out/tune", value_name = "DIR")]
    out: PathBuf,
    /// Write the recommendation as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
}

/// What is written into the folder.
struct Files {
    modes: PathBuf,
    modes_page: PathBuf,
    table: PathBuf,
    shaper_page: PathBuf,
}

impl Files {
    fn within(folder: &Path) -> Self {
        let [modes, modes_page, table, shaper_page] =
            ["modes.json", "modes.html", "table.json", "shaper.html"].map(|name| folder.join(name));
        Self { modes, modes_page, table, shaper_page }
    }

    fn names(&self) -> [String; 4] {
        [&self.modes, &self.modes_page, &self.table, &self.shaper_page].map(|path| path.display().to_string())
    }
}

impl TuneArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let (floor, tolerance) = (self.floor.spread()?, self.tolerance.fraction()?);
        let files = Files::within(&self.out);
        std::fs::create_dir_all(&self.out)
            .map_err(|error| CliError::file(self.out.display().to_string(), &error))?;
        let names = files.names();
        let written = names.iter().map(String::as_str).chain(self.json.as_deref());
        keep_apart(self.recorded.files(), written.map(Some))?;

        let identified = self.recorded.identify(JointFit::WhereTheyAgree, streams)?;
        let modes = write_modes(&identified, &files, streams)?;
        let request = TuningRequest {
            chosen: self.chosen.clone(),
            floor,
            tolerance,
            rate_hz: board_rate_hz(self.rate, streams),
        };
        let tuning = Tuning::new(&identified, &modes, request)?;
        write_shaper(&tuning, &files, streams)?;
        if !json_on_stdout(self.json.as_deref()) {
            print(&tuning, &NextCommands::of(&tuning, &files.modes, &files.table), streams)?;
        }
        let numbers = TuningNumbers::of(&tuning);
        self.json.as_ref().map_or(Ok(()), |file| streams.write_json(file, &numbers))
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
    let (file, json) = (files.modes.display().to_string(), identified.modes_json()?);
    streams.write_text(&file, &json)?;
    streams.write_text(&files.modes_page.display().to_string(), &identify_page(&identified.all(), &[]))?;
    Ok(ModesFile::parse(&file, json.as_bytes())?)
}

/// The table and its report, as `shape` writes them.
fn write_shaper(tuning: &Tuning, files: &Files, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let recommendation = &tuning.recommendation;
    let best = recommendation.best();
    streams.write_text(&files.table.display().to_string(), &best.design.to_json())?;
    let own = Candidate { name: "this one".to_owned(), ..best.clone() };
    let purpose = Purpose {
        boxes: &tuning.modes.boxes(),
        described: &describe_measured(&files.modes, tuning.request.floor),
        tolerance: recommendation.tolerance(),
        reasons: &Reasons::of(tuning).all(),
    };
    let page = shape_page(&own, recommendation.candidates().to_vec(), &purpose);
    streams.write_text(&files.shaper_page.display().to_string(), &page)
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
    writeln!(streams.out, "\nSend it to the board:\n  {}", next.upload)?;
    if let Some((name, command)) = &next.another {
        writeln!(streams.out, "Another one of the list, for example {name}:\n  {command}")?;
    }
    Ok(())
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
