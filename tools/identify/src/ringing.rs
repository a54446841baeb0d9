//! Where in a recording a structure rings freely: from which sample on, and until when.

use stillbeam_recording::Recording;

use crate::decay_modes::Uniform;
use crate::error::IdentifyError;
use crate::forced_record::{MIN_ROWS, present, refuse_constant};
use crate::free_decay::FreeDecayOptions;
use crate::signal_checks::clipping;
use crate::time_stamps::stamp_warnings;
use crate::tones::{Tone, find_tones};
use crate::warnings::Warning;

/// A recording that is to be read as a free decay.
pub(crate) struct Ringing<'r> {
    pub(crate) recording: &'r Recording,
    column: String,
    time_s: Vec<f64>,
    values: Vec<f64>,
    /// Driven lines anywhere in the recording.
    pub(crate) tones: Vec<Tone>,
    pub(crate) warnings: Vec<Warning>,
}

/// The ringing part of a record; time counts from its first sample.
pub(crate) struct DecayRecord {
    pub(crate) name: String,
    pub(crate) column: String,
    pub(crate) time_s: Vec<f64>,
    pub(crate) output: Vec<f64>,
    pub(crate) origin_s: f64,
    /// Mean square of what is left after the decay, where the record goes on for long enough.
    noise_power: Option<f64>,
}

/// Shares of the largest deflection from which the decay is tried, one after the other.
const STARTS: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
/// Share of a decay's energy that its modes explain when it is one, and how many times the noise they may leave
/// where that is less.
const ENOUGH: f64 = 0.9;
const NEAR_NOISE: f64 = 2.0;
/// Blocks that a record is cut into to see where it is quiet.
const BLOCKS: usize = 200;
/// Blocks whose rms is below this many times that of the quietest tenth hold noise.
const QUIET: f64 = 1.5;
/// And so many of them in a row.
const QUIET_BLOCKS: usize = 10;
/// How much of the noise after the decay is kept, as a share of the decay.
const KEPT_NOISE: f64 = 0.5;
/// A quiet end is cut when it is longer than this share of what follows the peak.
const LONG_QUIET: f64 = 0.5;

impl<'r> Ringing<'r> {
    pub(crate) fn new(recording: &'r Recording, options: &FreeDecayOptions) -> Result<Self, IdentifyError> {
        let all = present(recording, &options.output)?;
        refuse_constant(recording, &options.output, &all.values)?;
        let mut warnings = clipping(&options.output, &all.values);
        warnings.extend(stamp_warnings(&recording.name, &all.time_s, &all.values));
        Ok(Self {
            tones: find_tones(&Uniform::new(&all.time_s, &all.values)),
            recording,
            column: options.output.clone(),
            time_s: all.time_s,
            values: all.values,
            warnings,
        })
    }

    /// Rows from which the decay may be read: where it was said to begin, or the largest deflection and then ever
    /// smaller ones.
    pub(crate) fn starts(&self, start_s: Option<f64>) -> Vec<usize> {
        if let Some(start_s) = start_s {
            return vec![self.time_s.partition_point(|t| *t < start_s)];
        }
        let rest = self.rest();
        let away: Vec<f64> = self.values.iter().map(|value| (value - rest).abs()).collect();
        let first = (0..away.len()).rev().max_by(|a, b| away[*a].total_cmp(&away[*b])).unwrap_or(0);
        let end = self.end_of_decay(first);
        let later = STARTS.iter().filter_map(|share| {
            let last = (first..end).rev().find(|&k| away[k] >= share * away[first])?;
            (last > first).then_some(last)
        });
        std::iter::once(first).chain(later).collect()
    }

    /// Where the record ends up.
    fn rest(&self) -> f64 {
        let tail = &self.values[self.values.len() - self.values.len().div_ceil(10)..];
        tail.iter().sum::<f64>() / tail.len() as f64
    }

    /// The row at which a decay from `start` has long sunk into the noise; the end of the record where it has not.
    fn end_of_decay(&self, start: usize) -> usize {
        let rows = self.values.len();
        let length = (rows / BLOCKS).max(8);
        let rest = self.rest();
        let rms = |block: &[f64]| {
            (block.iter().map(|y| (y - rest).powi(2)).sum::<f64>() / block.len() as f64).sqrt()
        };
        let mut sizes: Vec<f64> = self.values.chunks(length).map(rms).collect();
        let after: Vec<f64> = self.values[start..].chunks(length).map(rms).collect();
        sizes.sort_by(f64::total_cmp);
        let quiet = QUIET * sizes[sizes.len() / 10];
        // Many blocks in a row: a slow oscillation is quiet for a moment at every zero crossing.
        let is_noise = |some: &[f64]| some.iter().all(|size| *size < quiet);
        let Some(block) = after.windows(QUIET_BLOCKS).position(is_noise) else { return rows };
        let noise = start + block * length;
        if (rows - noise) as f64 <= LONG_QUIET * (rows - start) as f64 {
            return rows;
        }
        (noise + (KEPT_NOISE * (noise - start) as f64) as usize).max(start + 64).min(rows)
    }

    /// The decay from a row on.
    pub(crate) fn from(&self, start: usize) -> Result<DecayRecord, IdentifyError> {
        let end = self.end_of_decay(start.min(self.values.len() - 1));
        let rows = end.saturating_sub(start);
        if rows < MIN_ROWS {
            return Err(self.too_short(rows));
        }
        let origin_s = self.time_s[start];
        let noise_power = (end < self.values.len()).then(|| mean_square(&self.values[end..]));
        Ok(DecayRecord {
            noise_power,
            name: self.recording.name.clone(),
            column: self.column.clone(),
            time_s: self.time_s[start..end].iter().map(|t| t - origin_s).collect(),
            output: self.values[start..end].to_vec(),
            origin_s,
        })
    }

    /// The error of a decay with too few samples.
    pub(crate) fn too_short(&self, found: usize) -> IdentifyError {
        IdentifyError::TooFewSamples {
            recording: self.recording.name.clone(),
            column: self.column.clone(),
            found,
            required: MIN_ROWS,
            context: " from the start of the decay on",
        }
    }
}

fn mean_square(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    values.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count
}

impl DecayRecord {
    /// Whether a fit that leaves this much explains the decay: nearly all of it, or down to what noise may leave.
    pub(crate) fn is_explained(&self, residual_rms: f64) -> bool {
        self.explained(residual_rms) > ENOUGH
            || self.noise_power.is_some_and(|noise| residual_rms < NEAR_NOISE * noise.sqrt())
    }

    /// The share of the decay's energy, less what noise after it would have, that a fit explains.
    pub(crate) fn explained(&self, residual_rms: f64) -> f64 {
        let noise = self.noise_power.unwrap_or(0.0);
        let signal = mean_square(&self.output) - noise;
        let left = (residual_rms.powi(2) - noise).max(0.0);
        if signal > 0.0 { 1.0 - left / signal } else { 0.0 }
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }
}
