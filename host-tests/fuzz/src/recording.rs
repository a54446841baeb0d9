//! Any bytes as a recording, in the format they look like or in one that somebody says they have.

use stillbeam_recording::{Format, ReadOptions, TimeBase, parse_recording};

pub(crate) fn run(input: &[u8], format: Option<Format>) {
    for time in [None, Some(TimeBase::IntervalS(0.01))] {
        let options = ReadOptions { format, time, ..ReadOptions::default() };
        // A refusal is as good as a recording.
        if let Ok(imported) = parse_recording(input, "fuzzed", &options) {
            let length = imported.recording.time_s.len();
            assert!(imported.recording.columns.iter().all(|column| column.samples.len() == length));
        }
    }
}
