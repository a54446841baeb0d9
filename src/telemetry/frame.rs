//! Samples in binary frames, for programs: several in one, with their sequence number and a CRC-32.
//!
//! A frame travels between two zero bytes, encoded with COBS so that there is none in it (Cheshire and Baker,
//! IEEE/ACM Trans. Networking 7, 1999). Its second byte decoded is zero, which makes [`FIRST_BYTE`] the first
//! byte encoded. Text has neither zeros nor that byte, so the two are told apart at once and after any loss.
//! Decoded, little-endian:
//!
//! | bytes | meaning |
//! |---|---|
//! | 1 | [`KIND`] |
//! | 1 | 0 |
//! | 1 | bit 0: the samples have an encoder |
//! | 4 | sequence number of the first sample; the others follow without a gap |
//! | 4 | tick of the first sample |
//! | 4 | ticks from one sample to the next |
//! | 4 | command in nanometres, of the first sample |
//! | 4 | setpoint in nanometres |
//! | 0 or 4 | encoder in nanometres |
//! | 1 | flags and digital inputs, [`Flags`] |
//! | 1 | state: the number of [`Activity`] |
//! | ... | up to [`MAX_SAMPLES`] samples |
//! | 4 | CRC-32 (ISO-HDLC) of all before |

use core::fmt;

use heapless::Vec;

use super::{Activity, Flags, Sample};
use crate::shaper::uploaded::crc32;
use crate::units::Nanometres;

/// The first byte of a frame of samples, before encoding.
pub const KIND: u8 = 1;

/// The first byte of an encoded frame: where its first zero was.
pub const FIRST_BYTE: u8 = 2;

/// The most samples of a frame.
pub const MAX_SAMPLES: usize = 16;

/// Ticks that the first sample of a frame may wait for the others.
pub const MAX_WAIT_TICKS: u32 = 200;

const WITH_ENCODER: u8 = 1;
const HEADER: usize = 15;
const CRC: usize = 4;
const MAX_BYTES: usize = HEADER + MAX_SAMPLES * 14 + CRC;

/// The most bytes of an encoded frame: its zeros, and COBS adds one byte to what is below 255.
pub const MAX_ENCODED: usize = MAX_BYTES + 3;
const _: () = assert!(MAX_BYTES < 255);

/// A frame on the line, zeros included.
pub type Encoded = Vec<u8, MAX_ENCODED>;

/// Collects samples into frames.
#[derive(Debug, Default)]
pub struct FrameWriter {
    samples: Vec<Sample, MAX_SAMPLES>,
}

impl FrameWriter {
    /// Nothing collected.
    pub const fn new() -> Self {
        Self { samples: Vec::new() }
    }

    /// Takes a sample of a stream of one per `decimation` ticks. Returns a frame when it is full, when its
    /// first sample should wait no longer, or when this sample does not follow the one before.
    pub fn push(&mut self, sample: Sample, decimation: u32) -> Option<Encoded> {
        let frame = if self.is_followed_by(&sample, decimation) { None } else { self.finish(decimation) };
        // There is room: full frames do not stay.
        let _fits = self.samples.push(sample);
        let waits = decimation.saturating_mul(self.samples.len() as u32) >= MAX_WAIT_TICKS;
        // A sample that begins a frame after a gap may wait for the next; two frames at once cannot be
        // returned.
        if frame.is_none() && (waits || self.samples.is_full()) { self.finish(decimation) } else { frame }
    }

    fn is_followed_by(&self, sample: &Sample, decimation: u32) -> bool {
        self.samples.last().is_none_or(|last| {
            !self.samples.is_full()
                && sample.sequence == last.sequence.wrapping_add(1)
                && sample.tick == last.tick.wrapping_add(decimation)
                && sample.encoder.is_some() == last.encoder.is_some()
        })
    }

    /// The frame of what was collected, if there is anything.
    pub fn finish(&mut self, decimation: u32) -> Option<Encoded> {
        let first = self.samples.first()?;
        let mut bytes = Vec::<u8, MAX_BYTES>::new();
        let with_encoder = first.encoder.is_some();
        let mut put = |part: &[u8]| {
            // MAX_BYTES is the length of the largest frame.
            let _fits = bytes.extend_from_slice(part);
        };
        put(&[KIND, 0, if with_encoder { WITH_ENCODER } else { 0 }]);
        put(&first.sequence.to_le_bytes());
        put(&first.tick.to_le_bytes());
        put(&decimation.to_le_bytes());
        for sample in &self.samples {
            put(&sample.command.0.to_le_bytes());
            put(&sample.setpoint.0.to_le_bytes());
            if let Some(encoder) = sample.encoder {
                put(&encoder.0.to_le_bytes());
            }
            put(&[sample.flags.0, sample.activity as u8]);
        }
        let crc = crc32(&bytes);
        let _fits = bytes.extend_from_slice(&crc.to_le_bytes());
        self.samples.clear();
        encode(&bytes)
    }
}

fn encode(bytes: &[u8]) -> Option<Encoded> {
    let mut encoded = [0; MAX_ENCODED];
    let inner = encoded.get_mut(1..MAX_ENCODED - 1)?;
    let length = cobs::try_encode(bytes, inner).ok()?;
    // What follows is zero already.
    Encoded::from_slice(encoded.get(..length + 2)?).ok()
}

/// Why bytes are not a frame of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// Not encoded as frames are, or too long.
    Encoding,
    /// The CRC does not match.
    Damaged,
    /// Of another kind or length: another version of the firmware, if anything.
    Unknown,
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Encoding => "not a frame",
            Self::Damaged => "a frame whose CRC does not match",
            Self::Unknown => "a frame of another kind; firmware and host may differ in version",
        })
    }
}

impl core::error::Error for FrameError {}

/// The samples of what came between two zeros.
///
/// # Errors
/// [`FrameError`]; nothing of a damaged frame is used.
pub fn decode(encoded: &[u8]) -> Result<Vec<Sample, MAX_SAMPLES>, FrameError> {
    if encoded.len() > MAX_ENCODED || encoded.contains(&0) {
        return Err(FrameError::Encoding);
    }
    let mut buffer = [0; MAX_ENCODED];
    let length = cobs::decode(encoded, &mut buffer).map_err(|_| FrameError::Encoding)?;
    let bytes = buffer.get(..length.frame_size()).ok_or(FrameError::Encoding)?;
    let (bytes, crc) = bytes.split_last_chunk::<CRC>().ok_or(FrameError::Damaged)?;
    if crc32(bytes) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Damaged);
    }
    samples(bytes).ok_or(FrameError::Unknown)
}

/// The samples of a decoded frame without its CRC.
fn samples(bytes: &[u8]) -> Option<Vec<Sample, MAX_SAMPLES>> {
    let mut rest = bytes;
    let [KIND, 0, options @ (0 | WITH_ENCODER)] = take::<3>(&mut rest)? else { return None };
    let mut sequence = u32::from_le_bytes(take(&mut rest)?);
    let mut tick = u32::from_le_bytes(take(&mut rest)?);
    let decimation = u32::from_le_bytes(take(&mut rest)?);
    let mut samples = Vec::new();
    while !rest.is_empty() {
        let command = Nanometres(i32::from_le_bytes(take(&mut rest)?));
        let setpoint = Nanometres(i32::from_le_bytes(take(&mut rest)?));
        let encoder = match options {
            WITH_ENCODER => Some(Nanometres(i32::from_le_bytes(take(&mut rest)?))),
            _ => None,
        };
        let [flags, activity] = take(&mut rest)?;
        let (flags, activity) = (Flags(flags), Activity::from_number(activity)?);
        samples.push(Sample { sequence, tick, command, setpoint, encoder, flags, activity }).ok()?;
        sequence = sequence.wrapping_add(1);
        tick = tick.wrapping_add(decimation);
    }
    Some(samples)
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (part, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*part)
}
