//! What all pages are told 30 times a second.

use serde::Serialize;
use stillbeam_firmware::drive::Lacking;

use super::picture::Span;
use crate::board::Reply;

/// What `status` says of the drive.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct DriveWords {
    /// Its state.
    pub state: String,
    /// What is to be done before it may be enabled; empty where nothing is.
    pub lacking: String,
    /// The fault that holds the machine, or `none`.
    pub fault: String,
}

impl DriveWords {
    /// Of a reply to `status`.
    pub fn of(status: &Reply) -> Self {
        let line = |key| status.line(key).unwrap_or_default().to_owned();
        Self { state: line("drive"), lacking: remedies(&line("lacking")), fault: line("fault") }
    }
}

/// What to do about what a drive lacks, which `status` tells in words of its own.
fn remedies(lacking: &str) -> String {
    let remedy = |word| Lacking::ALL.into_iter().find(|(_, its, _)| *its == word).map_or(word, |(.., it)| it);
    let words = lacking.split_whitespace().filter(|word| *word != "nothing");
    words.map(remedy).collect::<Vec<_>>().join("; ")
}

/// What is now, and the picture since the frame before.
#[derive(Clone, Debug, Serialize)]
pub struct Frame<'f> {
    /// Counts frames.
    pub number: u64,
    /// The newest tick.
    pub tick: u32,
    /// The command then.
    pub command_nm: i32,
    /// The setpoint then.
    pub setpoint_nm: i32,
    /// The encoder then, if there is one.
    pub encoder_nm: Option<i32>,
    /// What the controller did then.
    pub state: &'f str,
    /// The drive.
    pub drive: &'f DriveWords,
    /// Samples that were lost on the way so far.
    pub lost_samples: u64,
    /// Samples that would be saved now.
    pub kept_samples: usize,
    /// Whether some page controls.
    pub is_controlled: bool,
    /// Pages that are open.
    pub pages: usize,
    /// Stops that were asked for.
    pub stops: u32,
    /// Changes when the board is set to something else.
    pub settings: u32,
    /// The picture.
    pub spans: Vec<Span>,
}

impl Frame<'_> {
    /// As it is sent.
    pub fn to_json(&self) -> String {
        // Numbers, words and lists of them always serialise.
        serde_json::to_string(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_drive_lacks_is_told_with_its_remedy() {
        let told = remedies("emergency_input position");
        assert!(told.contains("set emergency.input to high, low or waived"), "{told}");
        assert!(told.contains("; ") && told.contains("position set MM"), "{told}");
        assert_eq!(remedies("nothing"), "");
        assert_eq!(remedies("a word of a later firmware"), "a; word; of; a; later; firmware");
    }
}
