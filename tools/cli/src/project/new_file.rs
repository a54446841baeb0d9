//! A new project: its folders, and its file with a comment on every entry.

use std::path::{Path, PathBuf};

use toml::Value;

use super::error::ProjectError;
use super::file::{ProjectFile, SCHEMA};
use super::find::FILE_NAME;
use super::places;

/// Makes the folders of a project and its file, and says what the file is called.
///
/// # Errors
/// [`ProjectError::Occupied`] where there is one already; [`ProjectError::System`].
pub fn create(folder: &Path, file: &ProjectFile) -> Result<PathBuf, ProjectError> {
    let path = folder.join(FILE_NAME);
    refuse_occupied(folder)?;
    for place in places::ALL {
        let place = folder.join(place);
        std::fs::create_dir_all(&place).map_err(|error| ProjectError::system(&place, &error))?;
    }
    std::fs::write(&path, text(file)).map_err(|error| ProjectError::system(&path, &error))?;
    Ok(path)
}

/// Refuses a folder that is a project already.
///
/// # Errors
/// [`ProjectError::Occupied`].
pub fn refuse_occupied(folder: &Path) -> Result<(), ProjectError> {
    match folder.join(FILE_NAME).exists() {
        true => Err(ProjectError::Occupied { folder: folder.display().to_string() }),
        false => Ok(()),
    }
}

/// The file's text. An entry that has no value stands there as a comment with an example.
pub fn text(file: &ProjectFile) -> String {
    let mut text = Text(format!(
        "# A project of stillbeam: commands that run in this folder, or below it, take from here what is not typed.\n\
         # Paths are relative to this folder. An entry behind a # is not there; the value is an example.\n\n\
         schema = {SCHEMA}\n"
    ));
    let model = file.model.as_ref().map(|model| Value::from(model.display().to_string()));
    text.entry(
        "The model that diagnose, simulate and model take. `stillbeam identify` writes models/identified.toml anew\n\
         each time: give a model of your own another name.",
        "model",
        model,
        "\"models/machine.toml\"",
    );
    text.recordings(file);
    text.board(file);
    text.limits(file);
    text.shaper(file);
    text.0
}

struct Text(String);

impl Text {
    fn table(&mut self, name: &str) {
        self.0 += &format!("\n[{name}]\n");
    }

    fn entry(&mut self, comment: &str, key: &str, value: Option<Value>, example: &str) {
        for line in comment.lines() {
            self.0 += &format!("# {line}\n");
        }
        self.0 += &match value {
            Some(value) => format!("{key} = {value}\n"),
            None => format!("# {key} = {example}\n"),
        };
    }

    fn recordings(&mut self, file: &ProjectFile) {
        let it = &file.recordings;
        let text = |value: &Option<String>| value.clone().map(Value::from);
        self.table("recordings");
        self.entry(
            "The column that drives the machine, ending in its unit: a position of the base (m), its acceleration\n\
             (m_s2) or a force (N). Without it a recording says itself what it is: a knock, a decay, ambient noise.",
            "input",
            text(&it.input),
            "\"setpoint_m\"",
        );
        self.entry("The column that responds.", "output", text(&it.output), "\"tip_deflection_m\"");
        let columns = (!it.columns.is_empty()).then(|| Value::from(it.columns.clone()));
        self.entry(
            "Columns to take, what to call them and their scale; without it all that name their unit.",
            "columns",
            columns,
            "[\"tip_deflection_m=y*0.001\"]",
        );
        self.entry(
            "The column of the time and how many seconds its unit is, where the file does not say.",
            "time",
            text(&it.time),
            "\"millis*0.001\"",
        );
        self.entry(
            "Samples per second (Hz), of files that hold no time.",
            "sample_rate_hz",
            it.sample_rate_hz.map(Value::from),
            "1000.0",
        );
        // What few files need stands there only where it was asked for.
        let rare = [
            ("format", text(&it.format)),
            ("skip_lines", it.skip_lines.map(|lines| Value::from(i64::from(lines)))),
            ("separator", text(&it.separator)),
            ("decimal", text(&it.decimal)),
        ];
        for (key, value) in rare {
            if value.is_some() {
                self.entry("As the option of this name takes it.", key, value, "");
            }
        }
    }

    fn board(&mut self, file: &ProjectFile) {
        self.table("board");
        self.entry(
            "Its serial port; `core` runs the firmware's core without a board.",
            "port",
            file.board.port.clone().map(Value::from),
            "\"/dev/ttyACM0\"",
        );
        self.entry("Its ticks per second (Hz).", "rate_hz", file.board.rate_hz.map(Value::from), "4000.0");
    }

    fn limits(&mut self, file: &ProjectFile) {
        let it = file.limits;
        self.table("limits");
        self.entry(
            "What the machine can do: the largest velocity (mm/s), acceleration (mm/s²) and jerk (mm/s³), for plan,\n\
             shape and the run that diagnose proposes. The board has settings of its own: `move.velocity_mm_s`.",
            "velocity_mm_s",
            it.velocity_mm_s.map(Value::from),
            "500.0",
        );
        self.entry("", "acceleration_mm_s2", it.acceleration_mm_s2.map(Value::from), "5000.0");
        self.entry("", "jerk_mm_s3", it.jerk_mm_s3.map(Value::from), "1000000.0");
        self.entry(
            "Where it may be, from and to (mm): a run that diagnose proposes starts in the middle.",
            "travel_mm",
            it.travel_mm.map(|ends| Value::from(ends.to_vec())),
            "[-250.0, 250.0]",
        );
    }

    fn shaper(&mut self, file: &ProjectFile) {
        let it = file.shaper;
        self.table("shaper");
        self.entry(
            "The most vibration that a mode may keep, a fraction of what an unshaped command leaves; without it\n\
             0.05 for tune and apply, 0.02 for shape --optimal and plan.",
            "tolerance",
            it.tolerance.map(Value::from),
            "0.05",
        );
        self.entry(
            "The least that the machine's frequencies and damping ratios move by, with payload and temperature\n\
             (± per cent).",
            "frequency_floor_percent",
            it.frequency_floor_percent.map(Value::from),
            "5.0",
        );
        self.entry("", "damping_floor_percent", it.damping_floor_percent.map(Value::from), "5.0");
    }
}

#[cfg(test)]
mod tests {
    use super::super::file::{BoardTable, LimitsTable, RecordingsTable, ShaperTable};
    use super::*;

    #[test]
    fn a_new_file_reads_back_as_what_was_asked_for() {
        let file = ProjectFile {
            schema: SCHEMA,
            model: Some("models/my \"own\".toml".into()),
            recordings: RecordingsTable {
                input: Some("setpoint_m".into()),
                output: Some("tip_deflection_m".into()),
                columns: vec!["setpoint_m=ref [mm]*0.001".into(), "tip_deflection_m=tip\\x*0.001".into()],
                time: Some("millis*0.001".into()),
                format: Some("csv".into()),
                skip_lines: Some(3),
                separator: Some(";".into()),
                decimal: Some("comma".into()),
                ..RecordingsTable::default()
            },
            board: BoardTable { port: Some("core".into()), rate_hz: Some(8000.0) },
            limits: LimitsTable {
                velocity_mm_s: Some(120.0),
                acceleration_mm_s2: Some(900.0),
                jerk_mm_s3: Some(1e6),
                travel_mm: Some([-10.0, 80.5]),
            },
            shaper: ShaperTable {
                tolerance: Some(0.03),
                frequency_floor_percent: Some(4.0),
                damping_floor_percent: Some(20.0),
            },
        };
        assert_eq!(ProjectFile::parse(&text(&file), "new"), Ok(file));
    }

    #[test]
    fn the_examples_of_a_new_file_are_entries_once_their_sign_is_taken_away() {
        let bare = text(&ProjectFile { schema: SCHEMA, ..ProjectFile::default() });
        let is_entry = |line: &&str| line.starts_with("# ") && line.contains(" = ");
        // The time stands in a column or is counted.
        let keys: Vec<&str> =
            bare.lines().filter(is_entry).filter(|line| !line.contains("sample_rate")).collect();
        assert_eq!(keys.len(), 14, "{keys:?}");
        let full: String = bare
            .lines()
            .map(|line| if keys.contains(&line) { line.trim_start_matches("# ") } else { line })
            .map(|line| format!("{line}\n"))
            .collect();
        let full = ProjectFile::parse(&full, "new").unwrap();
        assert_eq!(full.limits.travel_mm, Some([-250.0, 250.0]));
        assert_eq!(full.recordings.columns, ["tip_deflection_m=y*0.001"]);
    }
}
