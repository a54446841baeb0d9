//! RIFF/WAVE in.

use hound::{SampleFormat, WavReader};
use thiserror::Error;

use crate::channels::{Channel, select};
use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::format::Format;
use crate::options::ReadOptions;

/// Why a WAV file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum WavProblem {
    /// The header or the samples are not as the format has them.
    #[error("after {samples} samples: {reason}; export as WAV with 8 to 32 bit integers or 32 bit floats")]
    Unreadable {
        /// Samples read so far, over all channels.
        samples: usize,
        /// What the reader said.
        reason: String,
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
    if options.time.is_some() {
        return Err(Problem::OwnTime { format: Format::Wav });
    }
    let unreadable =
        |samples| move |error: hound::Error| WavProblem::Unreadable { samples, reason: error.to_string() };
    let reader = WavReader::new(bytes).map_err(unreadable(0))?;
    let spec = reader.spec();
    if spec.channels == 0 || spec.sample_rate == 0 {
        return Err(WavProblem::Empty { channels: spec.channels, rate_hz: spec.sample_rate }.into());
    }
    let full_scale = 2_f64.powi(i32::from(spec.bits_per_sample) - 1);
    let mut samples = Vec::new();
    match spec.sample_format {
        SampleFormat::Int => {
            for sample in reader.into_samples::<i32>() {
                samples.push(f64::from(sample.map_err(unreadable(samples.len()))?) / full_scale);
            }
        }
        SampleFormat::Float => {
            for sample in reader.into_samples::<f32>() {
                samples.push(f64::from(sample.map_err(unreadable(samples.len()))?));
            }
        }
    }
    let count = samples.len() / usize::from(spec.channels);
    let channels = (0..usize::from(spec.channels)).map(|channel| Channel {
        source: (channel + 1).to_string(),
        name: Some(format!("channel_{}_fullscale", channel + 1)),
        description: format!("{count} samples"),
        samples: samples
            .iter()
            .skip(channel)
            .step_by(usize::from(spec.channels))
            .take(count)
            .copied()
            .collect(),
    });
    let (columns, remarks) = select(channels.collect(), &options.columns)?;
    let time_s = (0..count).map(|k| k as f64 / f64::from(spec.sample_rate)).collect();
    Ok((time_s, columns, remarks))
}
