//! RIFF/WAVE in, as programs and pipes write it.

use thiserror::Error;

use crate::channels::{Channel, select};
use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::format::Format;
use crate::options::{ReadOptions, TimeBase};

/// Format tags.
const PCM: u16 = 1;
const FLOAT: u16 = 3;
const EXTENSIBLE: u16 = 0xfffe;
/// Chunks that are met with.
const USUAL: [&[u8]; 14] = [
    b"fmt ", b"data", b"fact", b"LIST", b"bext", b"junk", b"JUNK", b"PEAK", b"cue ", b"smpl", b"iXML",
    b"id3 ", b"inst", b"PAD ",
];

/// Why a WAV file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WavProblem {
    /// A part that the format needs is not there.
    #[error("the file has no `{chunk}` chunk; export it again, as WAV with integers or floats")]
    Missing {
        /// Name of the chunk.
        chunk: &'static str,
    },
    /// Samples that are compressed or of a width that is none.
    #[error(
        "samples of {bits} bits in format {tag}; export as WAV with 8 to 32 bit integers or 32 or 64 bit floats"
    )]
    Unreadable {
        /// Format tag: 1 integers, 3 floats, others compressed.
        tag: u16,
        /// Bits per sample.
        bits: u16,
    },
    /// No channel, or no rate.
    #[error("{channels} channels at {rate_hz} Hz; export the file again")]
    Empty {
        /// Channels by the header.
        channels: u16,
        /// Rate by the header.
        rate_hz: u32,
    },
}

/// Reads the channels of a WAV file, integers as fractions of full scale.
///
/// A WAV file does not say what its samples mean: without a choice of columns they are called
/// `channel_1_fullscale` and so on.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    if matches!(options.time, Some(TimeBase::Source { .. })) {
        return Err(Problem::OwnTime { format: Format::Wav });
    }
    let chunks = Chunks::find(bytes)?;
    let layout = Layout::read(chunks.format)?;
    let width = layout.frame_bytes / usize::from(layout.channels);
    let frames = chunks.data.chunks_exact(layout.frame_bytes);
    let count = frames.len();
    let channels = (0..usize::from(layout.channels)).map(|channel| Channel {
        source: (channel + 1).to_string(),
        name: Some(format!("channel_{}_fullscale", channel + 1)),
        description: format!("{count} samples"),
        samples: frames
            .clone()
            .map(|frame| layout.sample(frame.get(channel * width..(channel + 1) * width).unwrap_or(&[])))
            .collect(),
    });
    let (columns, more) = select(channels.collect(), &options.columns)?;
    let mut remarks = chunks.remarks;
    remarks.extend(more);
    let time_s = (0..count).map(|k| k as f64 / f64::from(layout.rate_hz)).collect();
    Ok((time_s, columns, remarks))
}

/// The two chunks that matter.
struct Chunks<'b> {
    format: &'b [u8],
    data: &'b [u8],
    remarks: Vec<String>,
}

impl<'b> Chunks<'b> {
    /// Goes through the chunks, whatever else there is. Some programs forget the byte that makes an odd chunk
    /// even; one that writes into a pipe cannot know the length and announces 0 or the largest there is.
    fn find(bytes: &'b [u8]) -> Result<Self, WavProblem> {
        let mut format = None;
        let mut at = 12;
        let missing = |chunk| WavProblem::Missing { chunk };
        while let (Some(name), Some(&[a, b, c, d])) = (bytes.get(at..at + 4), bytes.get(at + 4..at + 8)) {
            let announced = u32::from_le_bytes([a, b, c, d]);
            let length = announced as usize;
            let rest = bytes.get(at + 8..).unwrap_or(&[]);
            match name {
                b"fmt " => format = Some(rest.get(..length).unwrap_or(rest)),
                b"data" => {
                    let format = format.ok_or(missing("fmt "))?;
                    let unknown = announced == u32::MAX || announced >= 0xffff_ff00 || announced == 0;
                    let data = if unknown { rest } else { rest.get(..length).unwrap_or(rest) };
                    let remarks = match (unknown, data.len() < length) {
                        (true, _) => {
                            vec!["the header states no length: read to the end of the file".to_owned()]
                        }
                        (_, true) => vec![format!(
                            "the file is cut: {} of {length} bytes of samples were read",
                            data.len()
                        )],
                        _ => Vec::new(),
                    };
                    return Ok(Self { format, data, remarks });
                }
                _ => {}
            }
            let next = at.saturating_add(8).saturating_add(length);
            let is_name = |at: usize| {
                bytes.get(at..at + 4).is_some_and(|name| name.iter().all(|byte| (0x20..0x7f).contains(byte)))
            };
            let known = |at: usize| bytes.get(at..at + 4).is_some_and(|name| USUAL.contains(&name));
            let unpadded =
                length % 2 == 1 && (known(next) && !known(next + 1) || is_name(next) && !is_name(next + 1));
            at = if unpadded { next } else { next + length % 2 };
        }
        Err(missing(if format.is_some() { "data" } else { "fmt " }))
    }
}

/// How samples are stored.
struct Layout {
    float: bool,
    channels: u16,
    rate_hz: u32,
    /// Bytes of one sample of every channel.
    frame_bytes: usize,
}

impl Layout {
    fn read(format: &[u8]) -> Result<Self, WavProblem> {
        let word = |at: usize| match format.get(at..at + 2) {
            Some(&[a, b]) => u16::from_le_bytes([a, b]),
            _ => 0,
        };
        let (channels, bits, block) = (word(2), word(14), word(12));
        let rate_hz = u32::from(word(4)) | u32::from(word(6)) << 16;
        // The first two bytes of the extension's identifier are the tag that would stand in a plain header.
        let tag = if word(0) == EXTENSIBLE { word(24) } else { word(0) };
        if channels == 0 || rate_hz == 0 {
            return Err(WavProblem::Empty { channels, rate_hz });
        }
        // Samples fill whole bytes from the top: 20 or 24 valid bits in 32 are the upper ones, so that full
        // scale is that of the container.
        let stated = usize::from(block / channels);
        let needed = usize::from(bits.div_ceil(8));
        let width = if stated >= needed && block % channels == 0 { stated } else { needed };
        let fits = match tag {
            PCM => (1..=4).contains(&width),
            FLOAT => matches!(width, 4 | 8),
            _ => false,
        };
        if !fits || bits == 0 {
            return Err(WavProblem::Unreadable { tag, bits });
        }
        Ok(Self { float: tag == FLOAT, channels, rate_hz, frame_bytes: width * usize::from(channels) })
    }

    /// One sample, as a fraction of full scale where it is an integer.
    fn sample(&self, bytes: &[u8]) -> f64 {
        let value = match (self.float, bytes) {
            (true, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            (true, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            // Bytes alone have no sign: their zero is 128.
            (false, &[a]) => (f64::from(a) - 128.0) / 128.0,
            (false, &[a, b]) => f64::from(i16::from_le_bytes([a, b])) / 32_768.0,
            (false, &[a, b, c]) => f64::from(i32::from_le_bytes([0, a, b, c])) / 2_147_483_648.0,
            (false, &[a, b, c, d]) => f64::from(i32::from_le_bytes([a, b, c, d])) / 2_147_483_648.0,
            _ => f64::NAN,
        };
        if value.is_finite() { value } else { f64::NAN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A WAV file of the format chunk, the samples, an announced length and chunks before.
    pub(super) fn wav(format: &[u8], data: &[u8], announced: u32, before: &[u8]) -> Vec<u8> {
        let mut bytes = b"RIFF\xff\xff\xff\xffWAVE".to_vec();
        bytes.extend(before);
        bytes.extend(b"fmt ");
        bytes.extend((format.len() as u32).to_le_bytes());
        bytes.extend(format);
        bytes.extend(b"data");
        bytes.extend(announced.to_le_bytes());
        bytes.extend(data);
        bytes
    }

    fn format(tag: u16, bits: u16, width: u16, valid: Option<u16>) -> Vec<u8> {
        let mut bytes = Vec::new();
        for word in [if valid.is_some() { EXTENSIBLE } else { tag }, 1] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(8000_u32.to_le_bytes());
        bytes.extend((8000 * u32::from(width)).to_le_bytes());
        bytes.extend(width.to_le_bytes());
        bytes.extend(bits.to_le_bytes());
        if let Some(valid) = valid {
            bytes.extend(22_u16.to_le_bytes());
            bytes.extend(valid.to_le_bytes());
            bytes.extend(4_u32.to_le_bytes());
            bytes.extend(tag.to_le_bytes());
            bytes.extend(b"\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71");
        }
        bytes
    }

    fn signal() -> Vec<f64> {
        (0..200).map(|k| 0.7 * (0.1 * f64::from(k)).sin()).collect()
    }

    /// The signal in every way that the format has, with the step of its rounding.
    fn ways() -> Vec<(Vec<u8>, Vec<u8>, f64)> {
        let ints = |bits: u32, width: usize| -> Vec<u8> {
            let full = 2_f64.powi(bits as i32 - 1);
            let shift = 8 * width as u32 - bits;
            let sample = |v: &f64| ((v * full).round() as i64) << shift;
            signal().iter().flat_map(|v| sample(v).to_le_bytes().into_iter().take(width)).collect()
        };
        let bytes: Vec<u8> =
            signal().iter().map(|v| (v * 128.0).round() as i64 + 128).map(|v| v as u8).collect();
        let f4: Vec<u8> = signal().iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        let f8: Vec<u8> = signal().iter().flat_map(|v| v.to_le_bytes()).collect();
        vec![
            (format(PCM, 8, 1, None), bytes, 1.0 / 128.0),
            (format(PCM, 16, 2, None), ints(16, 2), 1.0 / 32_768.0),
            (format(PCM, 24, 3, None), ints(24, 3), 2e-7),
            (format(PCM, 24, 4, None), ints(24, 4), 2e-7),
            (format(PCM, 32, 4, Some(24)), ints(24, 4), 2e-7),
            (format(PCM, 32, 4, Some(20)), ints(20, 4), 4e-6),
            (format(PCM, 24, 3, Some(20)), ints(20, 3), 4e-6),
            (format(PCM, 32, 4, None), ints(32, 4), 1e-9),
            (format(FLOAT, 32, 4, None), f4, 1e-7),
            (format(FLOAT, 64, 8, None), f8.clone(), 1e-15),
            (format(FLOAT, 64, 8, Some(64)), f8, 1e-15),
        ]
    }

    #[test]
    fn samples_of_every_width_length_and_company_are_the_same_signal() {
        let odd_with_padding = b"LIST\x05\x00\x00\x00INFOx\x00".as_slice();
        let odd_without = b"junk\x05\x00\x00\x00\x01\x02\x03\x04\x05".as_slice();
        for (format, data, step) in ways() {
            for announced in [data.len() as u32, 0, u32::MAX, data.len() as u32 + 1000] {
                for before in [b"".as_slice(), odd_with_padding, odd_without] {
                    let bytes = wav(&format, &data, announced, before);
                    let (time_s, columns, remarks) = parse(&bytes, &ReadOptions::default()).unwrap();
                    assert_eq!(remarks.is_empty(), announced == data.len() as u32, "{remarks:?}");
                    assert_eq!(time_s.len(), 200);
                    for (found, wanted) in columns[0].samples.iter().zip(signal()) {
                        assert!((found - wanted).abs() <= step, "{found} for {wanted} in {format:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_compressed_or_empty_is_explained() {
        let compressed = parse(&wav(&format(85, 16, 2, None), &[0; 40], 40, b""), &ReadOptions::default());
        assert!(matches!(compressed, Err(Problem::Wav(_))));
        assert!(parse(b"RIFF\x04\x00\x00\x00WAVE", &ReadOptions::default()).is_err());
    }
}
