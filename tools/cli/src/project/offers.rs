//! What a command would be told of a project: values for its options, for as long as nobody says otherwise.

use std::path::Path;

use super::error::ProjectError;
use super::file::{LimitsTable, RecordingsTable};
use super::find::Project;
use super::places;
use crate::board_recording::ENCODER;

/// Values for one option of a command.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// The option, by the name of its field.
    pub id: &'static str,
    /// Where it comes from: an entry of the file, or a place of the project.
    pub key: &'static str,
    /// As they would be typed; several for an option that may be repeated.
    pub values: Vec<String>,
    /// Options that exclude this one beside those that the command itself knows to.
    pub yields_to: &'static [&'static str],
    /// Options without one of which this one says nothing.
    pub needs: &'static [&'static str],
    /// Whether the command writes this file or folder.
    pub is_written: bool,
}

/// Something that a project has a place for and that is not there yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// The option that would take it.
    pub id: &'static str,
    /// Where it would be, and how it comes there.
    pub remedy: String,
}

/// All that one command would be told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Offers {
    /// What there is.
    pub values: Vec<Offer>,
    /// What there is not.
    pub missing: Vec<Missing>,
}

/// The commands that take something of a project.
pub const COMMANDS: [&str; 12] = [
    "identify", "tune", "diagnose", "shape", "plan", "apply", "simulate", "model", "console", "record",
    "live", "upload",
];

impl Project {
    /// What a command would be told; nothing where it takes nothing of a project.
    ///
    /// # Errors
    /// [`ProjectError::System`] where the recordings cannot be listed.
    pub fn offers(&self, command: &str) -> Result<Offers, ProjectError> {
        let mut offering = Offering { project: self, offers: Offers::default() };
        let modes = (places::MODES_FILE, "`stillbeam tune` or `stillbeam identify` writes it");
        let table = (places::TABLE_FILE, "`stillbeam tune` or `stillbeam shape` writes it");
        match command {
            "identify" => {
                offering.recordings()?.reading().columns();
                offering.writes("json", places::MODES_FILE).writes("report", "reports/modes.html");
                offering.writes("model_out", places::IDENTIFIED_MODEL);
            }
            "tune" => {
                offering.recordings()?.reading().columns().rate(&[]).floor().tolerance();
                offering.writes("modes_file", places::MODES_FILE).writes("table_file", places::TABLE_FILE);
                offering.writes("report_dir", places::REPORTS);
            }
            "diagnose" => {
                // The model comes first on the line: without recordings it would be taken for one.
                if offering.recordings()?.has("recordings") {
                    offering.model();
                }
                offering.reading().limits(command).travel();
                offering.writes("json", "reports/diagnosis.json").writes("report", "reports/diagnosis.html");
                offering.writes("extended_model", "models/extended.toml");
            }
            "shape" => {
                offering.reads("uncertainty", modes, &["modes", "modes_from"]).rate(&[]).floor();
                offering.tolerance().limits(command);
                offering.writes("json", places::TABLE_FILE).writes("report", "reports/shaper.html");
            }
            "plan" => {
                offering.reads("uncertainty", modes, &["modes", "modes_from"]).rate(&[]).floor();
                offering.tolerance().limits(command);
                offering.writes("out", "tables/move.csv").writes("json", "tables/plan.json");
                offering.writes("report", "reports/move.html");
            }
            "apply" => {
                offering.reads("modes", modes, &[]).port().floor().tolerance();
            }
            // A recording brings its own times, and a shaper its own rate.
            "simulate" => {
                offering.model().rate(&["input", "shaper"]);
            }
            "model" => {
                offering.model();
            }
            "record" => {
                offering.port().board_recording()?;
            }
            "upload" => {
                offering.reads("table", table, &[]).port();
            }
            "console" | "live" => {
                offering.port();
            }
            _ => {}
        }
        Ok(offering.offers)
    }
}

/// What has been gathered for a command.
struct Offering<'p> {
    project: &'p Project,
    offers: Offers,
}

impl Offering<'_> {
    fn offer(&mut self, id: &'static str, key: &'static str, values: Vec<String>) -> Option<&mut Offer> {
        if values.is_empty() {
            return None;
        }
        let offer = Offer { id, key, values, yields_to: &[], needs: &[], is_written: false };
        self.offers.values.push(offer);
        self.offers.values.last_mut()
    }

    /// An entry of the file that may be left out.
    fn entry(&mut self, id: &'static str, key: &'static str, value: Option<String>) {
        self.offer(id, key, value.into_iter().collect());
    }

    fn has(&self, id: &str) -> bool {
        self.offers.values.iter().any(|offer| offer.id == id)
    }

    fn within(&self, place: impl AsRef<Path>) -> String {
        self.project.folder.join(place).display().to_string()
    }

    /// The recordings of the project.
    fn recordings(&mut self) -> Result<&mut Self, ProjectError> {
        let found = places::recordings(&self.project.folder)?;
        if found.is_empty() {
            let remedy =
                format!("{} holds no recording yet: copy some there", self.within(places::RECORDINGS));
            self.offers.missing.push(Missing { id: "recordings", remedy });
        }
        let paths = found.iter().map(|path| path.display().to_string()).collect();
        self.offer("recordings", "recordings/", paths);
        Ok(self)
    }

    /// How recordings are read.
    fn reading(&mut self) -> &mut Self {
        let RecordingsTable { columns, time, sample_rate_hz, format, skip_lines, separator, decimal, .. } =
            self.project.file.recordings.clone();
        self.entry("format", "recordings.format", format);
        self.entry("time", "recordings.time", time);
        self.entry("sample_rate", "recordings.sample_rate_hz", sample_rate_hz.map(|hz| hz.to_string()));
        self.offer("columns", "recordings.columns", columns);
        self.entry("skip_lines", "recordings.skip_lines", skip_lines.map(|lines| lines.to_string()));
        self.entry("separator", "recordings.separator", separator);
        self.entry("decimal", "recordings.decimal", decimal);
        self
    }

    /// Which columns are what.
    fn columns(&mut self) -> &mut Self {
        let RecordingsTable { input, output, sweep, input_kind, output_quantity, .. } =
            self.project.file.recordings.clone();
        self.entry("input", "recordings.input", input);
        self.entry("output", "recordings.output", output);
        self.entry("sweep", "recordings.sweep", sweep);
        self.entry("input_kind", "recordings.input_kind", input_kind);
        self.entry("output_quantity", "recordings.output_quantity", output_quantity);
        self
    }

    /// The model: what the file names, whether it is there or not, for the file's word is to be kept.
    fn model(&mut self) -> &mut Self {
        let Some(model) = self.project.file.model.clone() else { return self };
        if model == Path::new(places::IDENTIFIED_MODEL) {
            return self.reads("model", (places::IDENTIFIED_MODEL, "`stillbeam identify` writes it"), &[]);
        }
        let path = self.within(model);
        self.entry("model", "model", Some(path));
        self
    }

    /// A file that another command writes, once it is there.
    fn reads(
        &mut self,
        id: &'static str,
        (place, remedy): (&'static str, &str),
        yields_to: &'static [&'static str],
    ) -> &mut Self {
        let path = self.within(place);
        if !Path::new(&path).is_file() {
            let remedy = format!("{path} is not there yet: {remedy}");
            self.offers.missing.push(Missing { id, remedy });
        } else if let Some(offer) = self.offer(id, place, vec![path]) {
            offer.yields_to = yields_to;
        }
        self
    }

    /// A file or folder that the command writes.
    fn writes(&mut self, id: &'static str, place: &'static str) -> &mut Self {
        let path = self.within(place);
        if let Some(offer) = self.offer(id, place, vec![path]) {
            offer.is_written = true;
        }
        self
    }

    /// A new file for what the board streams, where that is all that a recording of this machine has: the
    /// response that another instrument sees has to come in first.
    fn board_recording(&mut self) -> Result<&mut Self, ProjectError> {
        let entries = &self.project.file.recordings;
        if entries.output.as_deref() != Some(ENCODER) || !entries.columns.is_empty() {
            return Ok(self);
        }
        let taken = places::recordings(&self.project.folder)?;
        let free = (1_u32..).map(|number| format!("{}/board-{number:03}.csv", places::RECORDINGS));
        let free =
            free.map(|name| self.within(name)).find(|name| !taken.iter().any(|it| it == Path::new(name)));
        if let Some(path) = free
            && let Some(offer) = self.offer("out", "recordings/", vec![path])
        {
            offer.is_written = true;
        }
        Ok(self)
    }

    fn port(&mut self) -> &mut Self {
        self.entry("port", "board.port", self.project.file.board.port.clone());
        self
    }

    fn rate(&mut self, yields_to: &'static [&'static str]) -> &mut Self {
        let rate = self.project.file.board.rate_hz.map(|hz| hz.to_string());
        if let Some(offer) = self.offer("rate", "board.rate_hz", rate.into_iter().collect()) {
            offer.yields_to = yields_to;
        }
        self
    }

    fn floor(&mut self) -> &mut Self {
        self.entry("box_floor", "shaper.frequency_floor_percent", self.project.file.shaper.floor_argument());
        self
    }

    fn tolerance(&mut self) -> &mut Self {
        let tolerance = self.project.file.shaper.tolerance.map(|fraction| fraction.to_string());
        self.entry("tolerance", "shaper.tolerance", tolerance);
        self
    }

    /// What the machine can do, as the command takes it.
    fn limits(&mut self, command: &str) -> &mut Self {
        let (id, needs): (_, &[&str]) =
            if command == "shape" { ("machine_limits", &["allow_negative"]) } else { ("limits", &[]) };
        let limits: LimitsTable = self.project.file.limits;
        let written = limits.motion().map(|[velocity, acceleration, jerk]| match command {
            "plan" => format!("{velocity},{acceleration},{jerk}"),
            _ => format!("{velocity},{acceleration}"),
        });
        if let Some(offer) = self.offer(id, "limits", written.into_iter().collect()) {
            offer.needs = needs;
        }
        self
    }

    fn travel(&mut self) -> &mut Self {
        let travel = self.project.file.limits.travel_mm.map(|[from, to]| format!("{from},{to}"));
        self.entry("travel", "limits.travel_mm", travel);
        self
    }
}
