//! Everything that reads bytes from outside, as functions that must survive any bytes, and that check what
//! they promise.
//!
//! `cargo xtask fuzz` lets libFuzzer look for inputs that they do not survive; the tests replay the kept
//! inputs and seeded changes of them without it.

mod console;
mod frames;
mod model;
mod plan;
mod recording;
mod settings;
mod table;

use stillbeam_recording::Format;

/// What is fed with bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The console of the firmware, with ticks in between.
    Console,
    /// Frames of samples, and the host's sorting of text and frames.
    Frames,
    /// Tables as bytes, and their way through the console.
    Table,
    /// Plans as bytes, likewise.
    Plan,
    /// The flash that holds the settings.
    Settings,
    /// Recordings, taken for what they look like.
    Recording,
    /// Recordings taken for this format.
    RecordingAs(Format),
    /// Model files.
    Model,
}

impl Target {
    /// Every target.
    pub const ALL: [Self; 17] = [
        Self::Console,
        Self::Frames,
        Self::Table,
        Self::Plan,
        Self::Settings,
        Self::Recording,
        Self::RecordingAs(Format::Csv),
        Self::RecordingAs(Format::Klipper),
        Self::RecordingAs(Format::RepRap),
        Self::RecordingAs(Format::Lvm),
        Self::RecordingAs(Format::Uff58),
        Self::RecordingAs(Format::Mat),
        Self::RecordingAs(Format::Octave),
        Self::RecordingAs(Format::Npy),
        Self::RecordingAs(Format::Wav),
        Self::RecordingAs(Format::Json),
        Self::Model,
    ];

    /// Its name, also of its folder in `corpus/`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Console => "console",
            Self::Frames => "frames",
            Self::Table => "table",
            Self::Plan => "plan",
            Self::Settings => "settings",
            Self::Recording => "recording",
            Self::RecordingAs(Format::Csv) => "csv",
            Self::RecordingAs(Format::Klipper) => "klipper",
            Self::RecordingAs(Format::RepRap) => "reprap",
            Self::RecordingAs(Format::Lvm) => "lvm",
            Self::RecordingAs(Format::Octave) => "octave",
            Self::RecordingAs(Format::Npy) => "npy",
            Self::RecordingAs(Format::Uff58 | Format::Uff58b) => "uff",
            Self::RecordingAs(Format::Mat) => "mat",
            Self::RecordingAs(Format::Wav) => "wav",
            Self::RecordingAs(Format::Json) => "json",
            Self::Model => "model",
        }
    }

    /// The target of this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.name() == name)
    }

    /// Feeds it once.
    ///
    /// # Panics
    /// When a promise is broken; that is what fuzzing looks for.
    pub fn run(self, input: &[u8]) {
        match self {
            Self::Console => console::run(input),
            Self::Frames => frames::run(input),
            Self::Table => table::run(input),
            Self::Plan => plan::run(input),
            Self::Settings => settings::run(input),
            Self::Recording => recording::run(input, None),
            Self::RecordingAs(format) => recording::run(input, Some(format)),
            Self::Model => model::run(input),
        }
    }
}
