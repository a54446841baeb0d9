//! `stillbeam new`: a project for one machine.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;
use stillbeam_firmware::settings::Settings;
use stillbeam_recording::ColumnChoice;

use crate::error::CliError;
use crate::project::ProjectFile;
use crate::project::file::{BoardTable, LimitsTable, RecordingsTable, SCHEMA, ShaperTable};
use crate::project::new_file::{create, refuse_occupied};
use crate::project::places;
use crate::project::proposal::Proposal;
use crate::project::questions::{Questions, above_zero};
use crate::project::si_columns::name_in_si;
use crate::reading::ReadArgs;
use crate::shaping::Travel;
use crate::shell_word::shell_word;
use crate::streams::Streams;

/// Make a folder for one machine, in which commands need no repeated options.
///
/// It gets a `stillbeam.toml` with a comment on every entry, and folders for recordings, modes, models,
/// tables and reports. Commands that run in it, or below it, take from that file what is not typed:
/// `stillbeam tune` alone goes from the recordings to a table. On a terminal it asks for what no option says.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam new gantry
  stillbeam new gantry --from sweep.csv --port /dev/ttyACM0 --velocity 300 --acceleration 2000
  stillbeam new gantry --input setpoint_m --output tip_m --column 'setpoint_m=ref [mm]*0.001' \\
    --column 'tip_m=tip [mm]*0.001'
  cd gantry && stillbeam tune")]
pub struct NewArgs {
    /// The folder; made if need be
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Propose the columns of this recording, in SI units; it is read, not copied
    #[arg(long, value_name = "EXAMPLE.csv")]
    from: Option<PathBuf>,
    /// The column that drives the machine
    #[arg(long, value_name = "COLUMN")]
    input: Option<String>,
    /// The column that responds
    #[arg(long, value_name = "COLUMN")]
    output: Option<String>,
    #[command(flatten)]
    reading: ReadArgs,
    /// The board's serial port, core or qemu
    #[arg(long, value_name = "PATH")]
    port: Option<String>,
    /// Largest velocity of the machine, mm/s
    #[arg(long, value_name = "MM_S", value_parser = above_zero, allow_negative_numbers = true)]
    velocity: Option<f64>,
    /// Largest acceleration of the machine, mm/s²
    #[arg(long, value_name = "MM_S2", value_parser = above_zero, allow_negative_numbers = true)]
    acceleration: Option<f64>,
    /// Largest jerk of the machine, mm/s³
    #[arg(long, value_name = "MM_S3", value_parser = above_zero, allow_negative_numbers = true)]
    jerk: Option<f64>,
    /// Where the machine may be, mm
    #[arg(long, value_name = "FROM,TO", allow_hyphen_values = true)]
    travel: Option<Travel>,
    /// The board's ticks per second
    #[arg(long, value_name = "HZ", value_parser = above_zero, allow_negative_numbers = true)]
    rate: Option<f64>,
}

impl NewArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        refuse_occupied(&self.folder)?;
        let proposal = self.from.as_deref().map(|path| self.propose(path, streams)).transpose()?;
        let proposal = proposal.unwrap_or_default();
        for typed in self.input.iter().chain(&self.output) {
            proposal.check(typed).map_err(CliError::Usage)?;
        }
        let mut file = self.file(&proposal);
        let answers = std::io::stdin();
        if answers.is_terminal() {
            let mut questions = Questions { answers: &mut answers.lock(), asked: streams.messages };
            self.ask(&mut file, &proposal, &mut questions)?;
        }
        self.name_columns(&mut file.recordings, &proposal, streams)?;
        let path = create(&self.folder, &file)?;
        streams.say(&format!("wrote {}", path.display()));
        let folder = self.folder.display();
        writeln!(streams.out, "Copy your recordings into {folder}/{}, then:", places::RECORDINGS)?;
        writeln!(streams.out, "  cd {}", shell_word(&folder.to_string()))?;
        writeln!(streams.out, "  stillbeam tune       # modes, a shaper and its reasons")?;
        writeln!(streams.out, "  stillbeam identify   # modes and a model for simulate and diagnose")?;
        let port = if file.board.port.is_some() { "  " } else { " --port PORT" };
        writeln!(streams.out, "  stillbeam upload{port}   # the shaper onto the board")?;
        Ok(())
    }

    /// Reads the example, and says what was found in it.
    fn propose(&self, path: &Path, streams: &mut Streams<'_>) -> Result<Proposal, CliError> {
        let proposal = Proposal::of(&self.reading.measurement(path, streams)?);
        for column in &proposal.columns {
            streams.say(&format!("{}: {column}", path.display()));
        }
        Ok(proposal)
    }

    /// Takes the columns of the example in the units and by the names of models, where it can be read so.
    fn name_columns(
        &self,
        recordings: &mut RecordingsTable,
        proposal: &Proposal,
        streams: &mut Streams<'_>,
    ) -> Result<(), CliError> {
        let Some(example) = &self.from else { return Ok(()) };
        let mut named = recordings.clone();
        name_in_si(&proposal.names, &mut named);
        if named == *recordings {
            return Ok(());
        }
        let columns = named.columns.iter().map(|column| column.parse().map_err(CliError::Usage));
        let columns = columns.collect::<Result<Vec<ColumnChoice>, _>>()?;
        let words = named.columns.join(", ");
        // What there is to say of the file was said.
        let (mut out, mut messages) = (std::io::sink(), std::io::sink());
        let mut silent = Streams { out: &mut out, messages: &mut messages };
        match self.reading.clone().with_columns(columns).read(example, &mut silent) {
            Ok(_) => {
                streams.say(&format!("taken in SI units, by the names that models have: {words}"));
                *recordings = named;
            }
            Err(error) => streams.say(&format!(
                "models have SI units, and these columns could not be taken so ({words}): {error}"
            )),
        }
        Ok(())
    }

    /// What was typed, else proposed, else as it comes.
    fn file(&self, proposal: &Proposal) -> ProjectFile {
        let board = Settings::default().limits();
        let column = |typed: &Option<String>, proposed: &Option<String>| typed.clone().or(proposed.clone());
        ProjectFile {
            schema: SCHEMA,
            model: Some(places::IDENTIFIED_MODEL.into()),
            recordings: RecordingsTable {
                input: column(&self.input, &proposal.input),
                output: column(&self.output, &proposal.output),
                ..self.reading.entries()
            },
            board: BoardTable { port: self.port.clone(), rate_hz: Some(self.rate.unwrap_or(4000.0)) },
            limits: LimitsTable {
                velocity_mm_s: Some(self.velocity.unwrap_or(board.velocity_mm_s)),
                acceleration_mm_s2: Some(self.acceleration.unwrap_or(board.acceleration_mm_s2)),
                jerk_mm_s3: Some(self.jerk.unwrap_or(board.jerk_mm_s3)),
                travel_mm: Some(
                    self.travel.map_or([board.travel_mm.0, board.travel_mm.1], |travel| {
                        [travel.from_mm, travel.to_mm]
                    }),
                ),
            },
            shaper: ShaperTable::default(),
        }
    }

    /// Asks for what was not typed, with what `file` has as the default.
    fn ask(
        &self,
        file: &mut ProjectFile,
        proposal: &Proposal,
        questions: &mut Questions<'_>,
    ) -> Result<(), CliError> {
        let RecordingsTable { input, output, .. } = &mut file.recordings;
        let texts = [
            (&self.input, input, true, "Column that drives the machine, such as setpoint_m"),
            (&self.output, output, true, "Column that responds, such as tip_deflection_m"),
            (&self.port, &mut file.board.port, false, "Serial port of the board, or core to try without one"),
        ];
        for (_, value, is_column, question) in texts.into_iter().filter(|(typed, ..)| typed.is_none()) {
            let default = value.clone().unwrap_or_else(|| NONE.to_owned());
            let read = |answer: &str| match is_column && answer != NONE {
                true => proposal.check(answer).map(|()| answer.to_owned()),
                false => Ok(answer.to_owned()),
            };
            match questions.ask(question, &default, read)? {
                Some(none) if none == NONE => *value = None,
                Some(answer) => *value = Some(answer),
                None => {}
            }
        }
        let limits = &mut file.limits;
        let numbers = [
            (self.velocity, &mut limits.velocity_mm_s, "Largest velocity, mm/s"),
            (self.acceleration, &mut limits.acceleration_mm_s2, "Largest acceleration, mm/s²"),
            (self.rate, &mut file.board.rate_hz, "Ticks per second of the board, Hz"),
        ];
        for (_, value, question) in numbers.into_iter().filter(|(typed, ..)| typed.is_none()) {
            let default = value.map_or_else(|| NONE.to_owned(), |value| value.to_string());
            *value = questions.ask(question, &default, above_zero)?.or(*value);
        }
        if let (None, Some([from, to])) = (self.travel, limits.travel_mm) {
            let read = |answer: &str| answer.parse::<Travel>().map_err(|error| error.to_string());
            let travel = questions.ask("Where it may be, from and to, mm", &format!("{from},{to}"), read)?;
            limits.travel_mm = travel.map(|it| [it.from_mm, it.to_mm]).or(limits.travel_mm);
        }
        Ok(())
    }
}

/// An answer that leaves an entry out.
const NONE: &str = "none";
