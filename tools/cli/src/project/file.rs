//! What a project's file says.

use std::path::PathBuf;

use serde::Deserialize;
use stillbeam_firmware::settings::Settings;

use super::error::ProjectError;

/// The schema that is read and written.
pub const SCHEMA: i64 = 1;

/// The file. What it leaves out, a command takes as it does without a project.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectFile {
    /// Always [`SCHEMA`].
    pub schema: i64,
    /// The model that `diagnose`, `simulate` and `model` take, relative to the file's folder.
    pub model: Option<PathBuf>,
    /// How the recordings are read, and which of their columns are what.
    #[serde(default)]
    pub recordings: RecordingsTable,
    /// The board.
    #[serde(default)]
    pub board: BoardTable,
    /// What the machine can do.
    #[serde(default)]
    pub limits: LimitsTable,
    /// What a shaper has to hold.
    #[serde(default)]
    pub shaper: ShaperTable,
}

/// How the recordings are read. Texts are written as the options of the same names take them.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingsTable {
    /// The column that drives the machine.
    pub input: Option<String>,
    /// The column that responds.
    pub output: Option<String>,
    /// The sweep that the recordings answer, where its signal was not recorded.
    pub sweep: Option<String>,
    /// What the input is, where its unit does not say.
    pub input_kind: Option<String>,
    /// What the output is, where its unit does not say.
    pub output_quantity: Option<String>,
    /// Columns to take, each `NAME_UNIT=SOURCE*SCALE`.
    #[serde(default)]
    pub columns: Vec<String>,
    /// The column of the time, `SOURCE*SCALE`.
    pub time: Option<String>,
    /// Samples per second, of files that hold no time.
    pub sample_rate_hz: Option<f64>,
    /// The format, where the content does not show it.
    pub format: Option<String>,
    /// Lines to leave out before a table of text.
    pub skip_lines: Option<u32>,
    /// What separates the cells of a table of text.
    pub separator: Option<String>,
    /// The decimal sign of a table of text.
    pub decimal: Option<String>,
}

/// The board.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardTable {
    /// Its serial port, `core` or `qemu`.
    pub port: Option<String>,
    /// Its ticks per second.
    pub rate_hz: Option<f64>,
}

/// What the machine can do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsTable {
    /// Largest velocity, mm/s.
    pub velocity_mm_s: Option<f64>,
    /// Largest acceleration, mm/s².
    pub acceleration_mm_s2: Option<f64>,
    /// Largest jerk, mm/s³.
    pub jerk_mm_s3: Option<f64>,
    /// Where the machine may be: from, to, mm.
    pub travel_mm: Option<[f64; 2]>,
}

/// What a shaper has to hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShaperTable {
    /// The most vibration that a mode may keep, a fraction of the unshaped command's.
    pub tolerance: Option<f64>,
    /// The least that frequencies are taken to move by, ± per cent.
    pub frequency_floor_percent: Option<f64>,
    /// The least that damping ratios are taken to move by, ± per cent; by default as the frequencies.
    pub damping_floor_percent: Option<f64>,
}

impl ProjectFile {
    /// Reads the text of a file that messages call `file`.
    ///
    /// # Errors
    /// [`ProjectError`] for what is no such file.
    pub fn parse(text: &str, file: &str) -> Result<Self, ProjectError> {
        let content = |error: toml::de::Error| ProjectError::Content {
            file: file.to_owned(),
            problem: error.to_string().trim_end().to_owned(),
        };
        // A later schema has other entries: they are not what is wrong with it.
        let table: toml::Table = text.parse().map_err(content)?;
        let schema = table.get("schema");
        if schema.and_then(toml::Value::as_integer) != Some(SCHEMA) {
            let found = schema.map_or_else(|| "nothing".to_owned(), toml::Value::to_string);
            return Err(ProjectError::Schema { file: file.to_owned(), found });
        }
        let parsed: Self = toml::from_str(text).map_err(content)?;
        parsed.check().map_err(|(key, problem)| ProjectError::Value {
            file: file.to_owned(),
            key: key.to_owned(),
            problem,
        })?;
        Ok(parsed)
    }

    /// What no option could say about single values: the entry, and what is wrong with it.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let positive = [
            ("recordings.sample_rate_hz", self.recordings.sample_rate_hz),
            ("board.rate_hz", self.board.rate_hz),
            ("limits.velocity_mm_s", self.limits.velocity_mm_s),
            ("limits.acceleration_mm_s2", self.limits.acceleration_mm_s2),
            ("limits.jerk_mm_s3", self.limits.jerk_mm_s3),
        ];
        for (key, value) in positive {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return Err((key, format!("{value} is not above 0")));
            }
        }
        if let Some([from, to]) = self.limits.travel_mm
            && !(from < to && from.is_finite() && to.is_finite())
        {
            return Err(("limits.travel_mm", format!("[{from}, {to}] does not go from less to more")));
        }
        if let Some(tolerance) = self.shaper.tolerance.filter(|it| !(*it > 0.0 && *it < 1.0)) {
            return Err(("shaper.tolerance", format!("{tolerance} is no fraction above 0 and below 1")));
        }
        let floors = [
            ("shaper.frequency_floor_percent", self.shaper.frequency_floor_percent),
            ("shaper.damping_floor_percent", self.shaper.damping_floor_percent),
        ];
        for (key, floor) in floors {
            if let Some(floor) = floor.filter(|floor| !(0.0..100.0).contains(floor)) {
                return Err((key, format!("{floor} is not from 0 to below 100")));
            }
        }
        let recordings = &self.recordings;
        if recordings.time.is_some() && recordings.sample_rate_hz.is_some() {
            return Err((
                "recordings.time",
                "sample_rate_hz is there too; one of them is the time".to_owned(),
            ));
        }
        if recordings.sweep.is_some() && recordings.input.is_some() {
            let problem = "input is there too; a sweep is for recordings without an input".to_owned();
            return Err(("recordings.sweep", problem));
        }
        Ok(())
    }
}

impl LimitsTable {
    /// Velocity, acceleration and jerk, mm/s, mm/s² and mm/s³, the board's own settings as they come for what
    /// is left out; nothing where all are.
    pub fn motion(&self) -> Option<[f64; 3]> {
        if [self.velocity_mm_s, self.acceleration_mm_s2, self.jerk_mm_s3].iter().all(Option::is_none) {
            return None;
        }
        let board = Settings::default().limits();
        Some([
            self.velocity_mm_s.unwrap_or(board.velocity_mm_s),
            self.acceleration_mm_s2.unwrap_or(board.acceleration_mm_s2),
            self.jerk_mm_s3.unwrap_or(board.jerk_mm_s3),
        ])
    }
}

impl ShaperTable {
    /// The floor of the boxes as `--box-floor` takes it; where only that of the damping ratios is said, that
    /// of the frequencies is the option's own, 5 %.
    pub fn floor_argument(&self) -> Option<String> {
        let (frequency, damping) = match (self.frequency_floor_percent, self.damping_floor_percent) {
            (None, None) => return None,
            (Some(frequency), damping) => (frequency, damping.unwrap_or(frequency)),
            (None, Some(damping)) => (5.0, damping),
        };
        Some(format!("{frequency}%,{damping}%"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(text: &str) -> String {
        ProjectFile::parse(text, "stillbeam.toml").unwrap_err().to_string()
    }

    #[test]
    fn an_entry_that_does_not_exist_is_named_with_its_line() {
        let problem = problem("schema = 1\n[limits]\nvelocity = 500\n");
        for part in ["stillbeam.toml", "line 3", "`velocity`", "velocity_mm_s", "--no-project"] {
            assert!(problem.contains(part), "`{problem}` lacks `{part}`");
        }
    }

    #[test]
    fn another_schema_is_refused_before_its_entries_are() {
        assert!(problem("schema = 2\nbrand_new = 1\n").contains("schema = 2"));
        assert!(problem("model = \"m.toml\"\n").contains("schema = nothing"));
    }

    #[test]
    fn values_that_no_machine_has_are_refused_by_their_names() {
        for (text, key) in [
            ("[limits]\nvelocity_mm_s = 0", "limits.velocity_mm_s"),
            ("[limits]\ntravel_mm = [10, -10]", "limits.travel_mm"),
            ("[board]\nrate_hz = nan", "board.rate_hz"),
            ("[shaper]\ntolerance = 1.5", "shaper.tolerance"),
            ("[shaper]\nfrequency_floor_percent = 100", "shaper.frequency_floor_percent"),
            ("[recordings]\ntime = \"t\"\nsample_rate_hz = 100", "recordings.time"),
            ("[recordings]\nsweep = \"1,9,10s\"\ninput = \"setpoint_m\"", "recordings.sweep"),
        ] {
            let problem = problem(&format!("schema = 1\n{text}\n"));
            assert!(problem.contains(key), "`{problem}` lacks `{key}`");
        }
    }

    #[test]
    fn limits_that_are_left_out_are_the_boards() {
        let file = ProjectFile::parse("schema = 1\n[limits]\nvelocity_mm_s = 120\n", "f").unwrap();
        let board = Settings::default().limits();
        assert_eq!(file.limits.motion(), Some([120.0, board.acceleration_mm_s2, board.jerk_mm_s3]));
        assert_eq!(LimitsTable::default().motion(), None);
    }
}
