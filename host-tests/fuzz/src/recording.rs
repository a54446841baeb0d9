//! Any bytes as a recording, in the format they look like and in every other.

use stillbeam_recording::{Format, ReadOptions, TimeBase, parse_csv, parse_recording};

const FORMATS: [Option<Format>; 6] = [
    None,
    Some(Format::Csv),
    Some(Format::Klipper),
    Some(Format::Uff58),
    Some(Format::Mat),
    Some(Format::Wav),
];

pub(crate) fn run(input: &[u8]) {
    // A refusal is as good as a recording.
    let _read_or_refused = parse_csv(input, "fuzzed");
    for format in FORMATS {
        for time in [None, Some(TimeBase::IntervalS(0.01))] {
            let options = ReadOptions { format, time, ..ReadOptions::default() };
            if let Ok(imported) = parse_recording(input, "fuzzed", &options) {
                let length = imported.recording.time_s.len();
                assert!(imported.recording.columns.iter().all(|column| column.samples.len() == length));
            }
        }
    }
}
