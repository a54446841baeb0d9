//! Samples in frames: nothing is invented, and whatever the line does, text and samples are told apart again.

use proptest::prelude::*;
use stillbeam::board::receiver::{Received, Receiver};
use stillbeam_firmware::telemetry::frame::{
    FIRST_BYTE, FrameWriter, MAX_ENCODED, MAX_SAMPLES, MAX_WAIT_TICKS, decode,
};
use stillbeam_firmware::telemetry::{Activity, Flags, Sample};
use stillbeam_firmware::units::Nanometres;

fn sample() -> impl Strategy<Value = Sample> {
    (any::<i32>(), any::<i32>(), any::<u8>(), 0..Activity::ALL.len()).prop_map(
        |(command, setpoint, flags, activity)| Sample {
            command: Nanometres(command),
            setpoint: Nanometres(setpoint),
            flags: Flags(flags),
            activity: Activity::ALL[activity],
            ..Sample::default()
        },
    )
}

/// A stream as the tick makes it: now and then samples are dropped, and the encoder comes and goes.
fn stream() -> impl Strategy<Value = (u32, Vec<Sample>)> {
    let one =
        (sample(), prop_oneof![9 => Just(1_u32), 1 => 2..5_u32], prop::option::weighted(0.9, any::<i32>()));
    (1..300_u32, any::<u32>(), any::<u32>(), any::<bool>(), prop::collection::vec(one, 1..80)).prop_map(
        |(decimation, mut sequence, mut tick, encoder, parts)| {
            let samples = parts.into_iter().map(|(mut sample, step, position)| {
                sequence = sequence.wrapping_add(step);
                tick = tick.wrapping_add(step.wrapping_mul(decimation));
                (sample.sequence, sample.tick) = (sequence, tick);
                sample.encoder = position.filter(|_| encoder).map(Nanometres);
                sample
            });
            (decimation, samples.collect())
        },
    )
}

fn frames(decimation: u32, samples: &[Sample]) -> Vec<Vec<u8>> {
    let mut writer = FrameWriter::new();
    let mut frames: Vec<Vec<u8>> = samples
        .iter()
        .filter_map(|sample| writer.push(*sample, decimation))
        .map(|frame| frame.to_vec())
        .collect();
    frames.extend(writer.finish(decimation).map(|frame| frame.to_vec()));
    frames
}

fn received(bytes: &[u8], piece: usize) -> Vec<Received> {
    let mut receiver = Receiver::default();
    bytes.chunks(piece).for_each(|part| receiver.push(part));
    std::iter::from_fn(|| receiver.take()).collect()
}

fn samples_of(received: &[Received]) -> Vec<Sample> {
    received
        .iter()
        .flat_map(|part| match part {
            Received::Samples(samples) => samples.clone(),
            _ => Vec::new(),
        })
        .collect()
}

proptest! {
    #[test]
    fn every_sample_arrives_as_it_was((decimation, samples) in stream(), piece in 1..70_usize) {
        let frames = frames(decimation, &samples);
        for frame in &frames {
            prop_assert!(frame.len() <= MAX_ENCODED && frame[0] == 0 && frame[1] == FIRST_BYTE);
            prop_assert!(!frame[1..frame.len() - 1].contains(&0) && frame[frame.len() - 1] == 0);
        }
        prop_assert_eq!(samples_of(&received(&frames.concat(), piece)), samples);
    }

    /// Replies between the frames, and frames in the middle of a line.
    #[test]
    fn text_and_frames_share_the_line(
        (decimation, samples) in stream(),
        lines in prop::collection::vec("[ -~]{1,40}", 1..20),
        interrupts in prop::collection::vec(0..40_usize, 20),
        piece in 1..70_usize,
    ) {
        let mut frames = frames(decimation, &samples).into_iter();
        let mut bytes = Vec::new();
        for (line, place) in lines.iter().zip(interrupts) {
            let (before, after) = line.split_at(place % line.len());
            bytes.extend(before.as_bytes());
            bytes.extend(frames.next().unwrap_or_default());
            bytes.extend(after.as_bytes());
            bytes.extend(b"\r\n");
        }
        bytes.extend(frames.flatten());
        let received = received(&bytes, piece);
        prop_assert_eq!(samples_of(&received), samples);
        let text: Vec<&str> = received
            .iter()
            .filter_map(|part| if let Received::Line(line) = part { Some(line.as_str()) } else { None })
            .collect();
        prop_assert_eq!(text, lines);
        prop_assert!(!received.contains(&Received::Damaged));
    }

    /// Bytes changed, lost and added: no sample comes that was not sent, and everything after the damage is
    /// whole.
    #[test]
    fn damage_costs_what_it_hits(
        (decimation, samples) in stream(),
        damages in prop::collection::vec((0..4000_usize, any::<u8>(), 0..3_u8), 1..6),
    ) {
        let frames = frames(decimation, &samples);
        let mut bytes = frames.concat();
        for (place, byte, kind) in damages {
            let place = place % bytes.len();
            match kind {
                0 => bytes[place] = byte,
                1 => drop(bytes.remove(place)),
                _ => bytes.insert(place, byte),
            }
        }
        // A reply and a frame after all that.
        let after = Sample { sequence: 7, ..Sample::default() };
        bytes.extend(b"\0\r\nok\r\n");
        bytes.extend(self::frames(1, &[after]).concat());
        let received = received(&bytes, 64);
        for sample in samples_of(&received) {
            prop_assert!(sample == after || samples.contains(&sample), "{sample:?} was never sent");
        }
        prop_assert_eq!(received.last(), Some(&Received::Samples(vec![after])));
        prop_assert!(received.iter().any(|part| matches!(part, Received::Line(line) if line.ends_with("ok"))));
    }

    #[test]
    fn whatever_comes_is_sorted_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        received(&bytes, 7);
        let _ = decode(&bytes);
    }
}

#[test]
fn a_frame_waits_for_no_more_than_its_limit() {
    for decimation in [1, 3, 10, 199, 200, 5000] {
        let mut writer = FrameWriter::new();
        let most = MAX_SAMPLES.min((MAX_WAIT_TICKS.div_ceil(decimation) as usize).max(1));
        let counts: Vec<usize> = (0..100_u32)
            .filter_map(|sequence| {
                writer.push(Sample { sequence, tick: sequence * decimation, ..Sample::default() }, decimation)
            })
            .map(|frame| decode(&frame[1..frame.len() - 1]).expect("a frame").len())
            .collect();
        assert!(!counts.is_empty() && counts.iter().all(|count| *count == most), "{decimation}: {counts:?}");
    }
}

/// What the documentation says a second of samples takes, in bytes of the 92 160 that the line has.
#[test]
fn a_sample_takes_the_documented_share_of_the_line() {
    for (encoder, per_sample) in [(None, 11.4), (Some(Nanometres(1)), 15.4)] {
        let samples: Vec<Sample> = (0..1600)
            .map(|sequence| Sample { sequence, tick: sequence, encoder, ..Sample::default() })
            .collect();
        let bytes = frames(1, &samples).concat().len() as f64 / 1600.0;
        assert!((bytes - per_sample).abs() < 0.1, "{bytes} bytes per sample");
        assert!(bytes * 4000.0 < 0.7 * 92_160.0, "every tick at 4 kHz");
    }
}
