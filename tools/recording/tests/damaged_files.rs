//! Damaged files of every kind are read or explained: no panic, and no more memory than the file warrants.

use proptest::prelude::*;
use proptest::sample::Index;
use stillbeam_recording::{ColumnChoice, Format, ReadOptions, TimeBase, parse_recording};

const FILES: [(Format, &str, &[u8]); 10] = [
    (Format::Uff58, "text.uff", include_bytes!("files/text.uff")),
    (Format::Uff58, "uneven.uff", include_bytes!("files/uneven.uff")),
    (Format::Uff58b, "binary.uff", include_bytes!("files/binary.uff")),
    (Format::Uff58b, "uneven_binary.uff", include_bytes!("files/uneven_binary.uff")),
    (Format::Mat, "conventional_v6.mat", include_bytes!("files/conventional_v6.mat")),
    (Format::Mat, "conventional_v7.mat", include_bytes!("files/conventional_v7.mat")),
    (Format::Mat, "foreign_v7.mat", include_bytes!("files/foreign_v7.mat")),
    (Format::Wav, "pcm16.wav", include_bytes!("files/pcm16.wav")),
    (Format::Wav, "float.wav", include_bytes!("files/float.wav")),
    (
        Format::Klipper,
        "klipper.csv",
        b"#time,accel_x,accel_y,accel_z\n1.5,1,2,3\n1.6,1,2,3\n1.7,1,2,3\n1.8,1,2,3\n",
    ),
];

/// Ways to read that reach different parts of the readers.
fn ways(format: Format) -> [ReadOptions; 3] {
    let columns: Vec<ColumnChoice> = vec!["a_m=1*2".parse().unwrap(), "b_m=run1.Y:2".parse().unwrap()];
    let forced = ReadOptions { format: Some(format), ..ReadOptions::default() };
    let chosen = ReadOptions { time: Some(TimeBase::IntervalS(0.1)), columns, ..forced.clone() };
    [ReadOptions::default(), forced, chosen]
}

fn reads_or_explains(bytes: &[u8], format: Format) {
    for options in ways(format) {
        match parse_recording(bytes, "damaged", &options) {
            Ok(found) => {
                found.recording.check().expect("the reader accepts nothing that check refuses");
                let numbers = found.recording.len() * (1 + found.recording.columns.len());
                assert!(numbers <= 4 * bytes.len(), "{numbers} numbers from {} bytes", bytes.len());
            }
            Err(error) => {
                let message = error.to_string();
                assert!(message.starts_with("damaged: ") && !message.contains('\n'), "{message}");
                assert!((30..4000).contains(&message.len()), "{message}");
            }
        }
    }
}

fn damage(file: &[u8], edits: &[(Index, u8, u8)]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for (place, byte, kind) in edits {
        let at = place.index(bytes.len().max(1));
        match kind {
            0..=3 if at < bytes.len() => bytes[at] = *byte,
            4 if at < bytes.len() => bytes[at] ^= 1 << (byte % 8),
            5 if at < bytes.len() => {
                bytes.remove(at);
            }
            6 => bytes.truncate(at),
            7 => {
                let copied: Vec<u8> = bytes.iter().skip(at).take(usize::from(*byte)).copied().collect();
                bytes.splice(at..at, copied);
            }
            _ => bytes.insert(at.min(bytes.len()), *byte),
        }
    }
    bytes
}

#[test]
fn every_file_reads_whole_and_explains_every_shortening() {
    for (format, name, file) in FILES {
        assert_eq!(Format::detect(file).unwrap(), format, "{name}");
        for length in (0..file.len()).step_by(1 + file.len() / 400) {
            reads_or_explains(&file[..length], format);
        }
    }
}

#[test]
fn lengths_that_lie_do_not_reserve_memory() {
    // Four gigabytes announced in a tag, a header, a count.
    for (format, name, file) in FILES {
        for at in (0..file.len().min(700)).step_by(2) {
            let mut bytes = file.to_vec();
            for byte in bytes.iter_mut().skip(at).take(4) {
                *byte = if matches!(format, Format::Uff58 | Format::Klipper) { b'9' } else { 0xff };
            }
            let _named_on_failure = name;
            reads_or_explains(&bytes, format);
        }
    }
}

/// A MAT-file of one compressed variable that uncompresses to `inner`.
fn with_compressed_variable(inner: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(inner).unwrap();
    let packed = packed.finish().unwrap();
    let mut bytes = FILES[6].2[..128].to_vec();
    bytes.extend(15_u32.to_le_bytes());
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

#[test]
fn a_compressed_variable_that_is_one_small_element_is_explained() {
    // A matrix (14) of four bytes within its own tag, at the very beginning of what was compressed.
    let inner = [14, 0, 4, 0, 1, 2, 3, 4];
    for options in ways(Format::Mat) {
        let error = parse_recording(&with_compressed_variable(&inner), "small", &options).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("byte 4: a small element goes beyond the end of the compressed variable"),
            "{error}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_read_or_explained(
        which in 0..FILES.len(),
        edits in prop::collection::vec((any::<Index>(), any::<u8>(), 0..9_u8), 1..6),
    ) {
        let (format, _, file) = FILES[which];
        reads_or_explains(&damage(file, &edits), format);
    }

    #[test]
    fn arbitrary_bytes_in_any_format_are_explained(
        which in 0..FILES.len(),
        kept in any::<Index>(),
        bytes in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let (format, _, file) = FILES[which];
        reads_or_explains(&bytes, format);
        let mut tail = file[..kept.index(file.len())].to_vec();
        tail.extend(bytes);
        reads_or_explains(&tail, format);
    }

    #[test]
    fn damage_inside_a_compressed_variable_is_read_or_explained(
        edits in prop::collection::vec((any::<Index>(), any::<u8>(), 0..9_u8), 1..4),
    ) {
        use std::io::Read;
        // The first variable of a compressed file, damaged after uncompressing and packed again.
        let file = FILES[6].2;
        let mut inner = Vec::new();
        flate2::read::ZlibDecoder::new(&file[136..]).read_to_end(&mut inner).unwrap();
        let bytes = with_compressed_variable(&damage(&inner, &edits));
        for options in ways(Format::Mat) {
            if let Err(error) = parse_recording(&bytes, "damaged", &options) {
                prop_assert!(!error.to_string().contains('\n'));
            }
        }
    }
}
