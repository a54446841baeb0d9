//! Modes read back from a file: the one reader of what `stillbeam identify --json` writes.
//!
//! Of the whole result a design needs, per mode, frequency, damping ratio and where either may be. Those are
//! the same fields in the JSON of one recording ([`IdentifiedModes`](crate::IdentifiedModes)), of several
//! together and in the summary of `stillbeam demo`; other fields are passed over. A file without
//! `uncertainty_box` gets one of [`BOX_STANDARD_ERRORS`] standard errors either way.

use std::path::Path;

use serde::Deserialize;
use thiserror::Error;

use crate::result::{Estimate, SCHEMA_VERSION, UncertaintyBox};

/// Half the width of an uncertainty box, in standard errors: 95 % of a normal error. Dependence on amplitude
/// comes on top of it.
pub const BOX_STANDARD_ERRORS: f64 = 2.0;

/// The modes of a file, by their numbers there.
#[derive(Debug, Clone, PartialEq)]
pub struct ModesFile {
    /// At least one.
    pub modes: Vec<FiledMode>,
}

/// What a file says of one mode. The values are possible ones (frequency above 0, damping ratio from 0 to
/// below 1) and lie inside their box.
#[derive(Debug, Clone, PartialEq)]
pub struct FiledMode {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: Estimate,
    /// Damping ratio.
    pub damping_ratio: Estimate,
    /// Where either may be.
    pub uncertainty_box: UncertaintyBox,
    /// Output per modal coordinate, where the experiment showed it.
    pub participation: Option<Estimate>,
    /// What the identification warned of.
    pub doubts: Vec<Doubt>,
}

/// A warning of the identification that bears on the use of one mode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Doubt {
    /// The sentence.
    pub message: String,
    /// Whether what is in the file is no mode to shape for: a line that does not decay, or a value at the
    /// limit of the search.
    pub is_no_mode: bool,
}

/// A box over which nothing can be designed.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum UnusableBox {
    /// The standard errors are not known.
    #[error(
        "the mode at {frequency_hz} Hz has no standard errors, so its uncertainty is not known; record longer or ask for fewer modes"
    )]
    Unknown {
        /// Its frequency, Hz.
        frequency_hz: f64,
    },
    /// The box reaches zero frequency or critical damping.
    #[error(
        "the mode at {frequency_hz} Hz is only known to lie from {} to {} Hz with a damping ratio from {} to {}; excite it more and record again",
        area.frequency_hz[0], area.frequency_hz[1], area.damping_ratio[0], area.damping_ratio[1]
    )]
    TooWide {
        /// Its frequency, Hz.
        frequency_hz: f64,
        /// Its box.
        area: UncertaintyBox,
    },
}

impl FiledMode {
    /// The box, for a design that is to hold over all of it: frequencies above 0, damping ratios from 0 to
    /// below 1.
    ///
    /// # Errors
    /// [`UnusableBox`], with the remedy.
    pub fn design_box(&self) -> Result<UncertaintyBox, UnusableBox> {
        let frequency_hz = self.frequency_hz.value;
        if !(self.frequency_hz.stderr.is_finite() && self.damping_ratio.stderr.is_finite()) {
            return Err(UnusableBox::Unknown { frequency_hz });
        }
        let area = self.uncertainty_box;
        let possible = area.frequency_hz[0] > 0.0
            && area.frequency_hz[1].is_finite()
            && area.damping_ratio[0] >= 0.0
            && area.damping_ratio[1] < 1.0;
        if possible { Ok(area) } else { Err(UnusableBox::TooWide { frequency_hz, area }) }
    }
}

/// Why a file gives no modes.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModesFileError {
    /// It cannot be read.
    #[error("{file}: {source}; check the path and its permissions")]
    Io {
        /// The file.
        file: String,
        /// The system's words.
        source: std::io::Error,
    },
    /// It is no JSON of this kind.
    #[error("{file}: not a file of modes: {source}; write one with `stillbeam identify --json`")]
    Json {
        /// The file.
        file: String,
        /// What the parser met, with line and column.
        source: serde_json::Error,
    },
    /// It is of another version.
    #[error(
        "{file}: schema_version {found}, and this program reads {SCHEMA_VERSION}; identify again with this version"
    )]
    Version {
        /// The file.
        file: String,
        /// Its version.
        found: u32,
    },
    /// It has no modes.
    #[error("{file}: there is no mode in it; look at the warnings of `stillbeam identify`")]
    NoModes {
        /// The file.
        file: String,
    },
    /// A number that no mode can have.
    #[error("{file}: mode {number}: {problem}; identify again, or correct the file")]
    Mode {
        /// The file.
        file: String,
        /// Its number, from 1.
        number: usize,
        /// What is wrong.
        problem: String,
    },
}

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    schema_version: Option<u32>,
    modes: Vec<Entry>,
    #[serde(default)]
    warnings: Vec<FiledWarning>,
}

#[derive(Deserialize)]
struct FiledWarning {
    #[serde(default)]
    kind: String,
    #[serde(default)]
    message: String,
    #[serde(default)]
    mode_hz: Option<f64>,
}

/// Kinds of warning after which there is no mode to shape for, and kinds that whoever shapes must hear again.
const NO_MODE: [&str; 2] = ["forced_tone", "at_bound"];
const HEARD_AGAIN: [&str; 4] =
    ["weak_mode", "may_be_aliased", "outside_excited_band", "record_shorter_than_decay"];
/// Share of its frequency within which a warning is about a mode: means of several recordings differ a little
/// from each.
const ABOUT: f64 = 1e-3;

impl FiledWarning {
    fn about(&self, mode: &FiledMode) -> Option<Doubt> {
        let hz = mode.frequency_hz.value;
        let is_about = self.mode_hz.is_some_and(|mode_hz| (mode_hz / hz - 1.0).abs() < ABOUT);
        let is_no_mode = NO_MODE.contains(&self.kind.as_str());
        (is_about && (is_no_mode || HEARD_AGAIN.contains(&self.kind.as_str())))
            .then(|| Doubt { message: self.message.clone(), is_no_mode })
    }
}

#[derive(Deserialize)]
struct Entry {
    frequency_hz: Estimate,
    damping_ratio: Estimate,
    #[serde(default)]
    uncertainty_box: Option<UncertaintyBox>,
    #[serde(default)]
    participation: Option<Estimate>,
}

impl ModesFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`ModesFileError`] names the file, the mode and the remedy.
    pub fn read(path: &Path) -> Result<Self, ModesFileError> {
        let file = path.display().to_string();
        match std::fs::read(path) {
            Ok(bytes) => Self::parse(&file, &bytes),
            Err(source) => Err(ModesFileError::Io { file, source }),
        }
    }

    /// Reads the bytes of a file; `file` is what messages call it.
    ///
    /// # Errors
    /// As [`ModesFile::read`].
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, ModesFileError> {
        let named = || file.to_owned();
        let read: File =
            serde_json::from_slice(bytes).map_err(|source| ModesFileError::Json { file: named(), source })?;
        match read.schema_version {
            Some(found) if found != SCHEMA_VERSION => {
                return Err(ModesFileError::Version { file: named(), found });
            }
            _ => {}
        }
        let modes = (1..).zip(read.modes).map(|(number, entry)| {
            entry.checked().map_err(|problem| ModesFileError::Mode { file: named(), number, problem })
        });
        let mut modes: Vec<FiledMode> = modes.collect::<Result<_, _>>()?;
        for mode in &mut modes {
            mode.doubts = read.warnings.iter().filter_map(|warning| warning.about(mode)).collect();
        }
        if modes.is_empty() {
            return Err(ModesFileError::NoModes { file: named() });
        }
        Ok(Self { modes })
    }
}

impl Entry {
    fn checked(self) -> Result<FiledMode, String> {
        let (frequency_hz, damping_ratio) = (self.frequency_hz, self.damping_ratio);
        if !(frequency_hz.value > 0.0 && frequency_hz.value.is_finite()) {
            return Err(format!("a frequency of {} Hz", frequency_hz.value));
        }
        if !(0.0..1.0).contains(&damping_ratio.value) {
            return Err(format!(
                "a damping ratio of {}, where 0 to below 1 is possible",
                damping_ratio.value
            ));
        }
        // The default is what a program writes that has not worked the box out.
        let given = self.uncertainty_box.filter(|area| *area != UncertaintyBox::default());
        let area = given.unwrap_or_else(|| UncertaintyBox::of(&frequency_hz, &damping_ratio));
        let sides = [
            ("frequency", area.frequency_hz, frequency_hz.value),
            ("damping ratio", area.damping_ratio, damping_ratio.value),
        ];
        for (name, [low, high], value) in sides {
            if !(low <= value && value <= high) {
                return Err(format!(
                    "its box of {name}s from {low} to {high} does not hold its own, {value}"
                ));
            }
        }
        Ok(FiledMode {
            frequency_hz,
            damping_ratio,
            uncertainty_box: area,
            participation: self.participation,
            doubts: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        ModesFile::parse("modes.json", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn the_box_of_the_file_counts_and_without_one_two_standard_errors_do() {
        let text = r#"{"schema_version": 1, "warnings": [], "modes": [
            {"frequency_hz": {"value": 1.1, "stderr": 0.01}, "damping_ratio": {"value": 0.007, "stderr": 0.001},
             "uncertainty_box": {"frequency_hz": [1.0, 1.3], "damping_ratio": [0.004, 0.02]}, "method": "output_error",
             "participation": {"value": 1.5, "stderr": 0.1}},
            {"frequency_hz": {"value": 6.9, "stderr": 0.01}, "damping_ratio": {"value": 0.001, "stderr": 0.001}},
            {"frequency_hz": {"value": 9.0, "stderr": null}, "damping_ratio": {"value": 0.1, "stderr": null}}]}"#;
        let file = ModesFile::parse("modes.json", text.as_bytes()).unwrap();
        let [given, made, unknown] = file.modes.as_slice() else { panic!("{file:?}") };
        assert_eq!(given.uncertainty_box.frequency_hz, [1.0, 1.3]);
        assert_eq!(given.uncertainty_box.damping_ratio, [0.004, 0.02]);
        assert_eq!(given.participation.unwrap().value, 1.5);
        assert_eq!(made.uncertainty_box.frequency_hz, [6.9 - 0.02, 6.9 + 0.02]);
        assert_eq!(made.uncertainty_box.damping_ratio, [0.0, 0.003]);
        assert_eq!(given.design_box().unwrap(), given.uncertainty_box);
        assert!(made.design_box().is_ok());
        assert!(matches!(unknown.design_box(), Err(UnusableBox::Unknown { frequency_hz: 9.0 })));
        assert_eq!(unknown.uncertainty_box.frequency_hz, [9.0, 9.0]);
        let wide = FiledMode { damping_ratio: Estimate { value: 0.5, stderr: 0.3 }, ..made.clone() };
        let area = UncertaintyBox::of(&wide.frequency_hz, &wide.damping_ratio);
        let wide = FiledMode { uncertainty_box: area, ..wide };
        assert!(matches!(wide.design_box(), Err(UnusableBox::TooWide { .. })));
    }

    #[test]
    fn what_the_identification_doubts_stays_with_its_mode() {
        let text = r#"{"warnings": [
            {"message": "weak", "kind": "weak_mode", "mode_hz": 1.1, "amplitude": 1e-5, "damping_share": 0.4},
            {"message": "a tone", "kind": "forced_tone", "mode_hz": 50.0, "duration_s": 3.0},
            {"message": "a gap", "kind": "input_gap", "start_s": 1.0, "length_s": 0.1}],
            "modes": [{"frequency_hz": {"value": 1.1, "stderr": 0.01}, "damping_ratio": {"value": 0.007, "stderr": 0.001}},
            {"frequency_hz": {"value": 50.0, "stderr": 0.01}, "damping_ratio": {"value": 1e-6, "stderr": 1e-7}}]}"#;
        let file = ModesFile::parse("modes.json", text.as_bytes()).unwrap();
        let doubt = |message: &str, is_no_mode| vec![Doubt { message: message.to_owned(), is_no_mode }];
        assert_eq!(file.modes[0].doubts, doubt("weak", false));
        assert_eq!(file.modes[1].doubts, doubt("a tone", true));
    }

    #[test]
    fn what_is_no_mode_is_refused_with_its_number() {
        let mode = |frequency: &str, damping: &str, area: &str| {
            format!(
                r#"{{"modes": [{{"frequency_hz": {{"value": {frequency}, "stderr": 0.1}},
                "damping_ratio": {{"value": {damping}, "stderr": 0.001}} {area}}}]}}"#
            )
        };
        for (text, wanted) in [
            (mode("0", "0.01", ""), "mode 1: a frequency of 0 Hz"),
            (mode("1", "1.2", ""), "mode 1: a damping ratio of 1.2"),
            (
                mode(
                    "1",
                    "0.01",
                    r#", "uncertainty_box": {"frequency_hz": [2, 3], "damping_ratio": [0, 0.1]}"#,
                ),
                "does not hold",
            ),
            (r#"{"modes": []}"#.to_owned(), "no mode"),
            (r#"{"schema_version": 7, "modes": []}"#.to_owned(), "schema_version 7"),
            ("nonsense".to_owned(), "not a file of modes"),
            (r#"{"stages": []}"#.to_owned(), "not a file of modes"),
        ] {
            let found = refusal(&text);
            assert!(found.starts_with("modes.json: ") && found.contains(wanted), "{found}");
        }
        let absent = ModesFile::read(Path::new("absent.json")).unwrap_err().to_string();
        assert!(absent.contains("absent.json"), "{absent}");
    }
}
