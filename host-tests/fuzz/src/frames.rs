//! Any bytes as a frame, and as what comes over the line.

use stillbeam::board::receiver::{Received, Receiver};
use stillbeam_firmware::telemetry::frame::{FrameWriter, decode};

pub(crate) fn run(input: &[u8]) {
    if let Ok(samples) = decode(input) {
        // What was understood can be said again.
        let decimation = match samples.as_slice() {
            [first, second, ..] => second.tick.wrapping_sub(first.tick),
            _ => 0,
        };
        let mut writer = FrameWriter::new();
        let mut again: Vec<_> =
            samples.iter().filter_map(|sample| writer.push(*sample, decimation)).collect();
        again.extend(writer.finish(decimation));
        let read: Vec<_> = again
            .iter()
            .flat_map(|frame| {
                decode(frame.get(1..frame.len() - 1).unwrap_or_default()).expect("its own frame")
            })
            .collect();
        assert_eq!(read, samples.as_slice());
    }
    let sorted = |piece: usize| {
        let mut receiver = Receiver::default();
        input.chunks(piece).for_each(|part| receiver.push(part));
        std::iter::from_fn(|| receiver.take()).collect::<Vec<Received>>()
    };
    assert_eq!(sorted(1), sorted(64), "in pieces or at once");
}
