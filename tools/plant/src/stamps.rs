//! Time stamps as the simulation walks along them.

use crate::error::PlantError;

/// Stamps closer to a uniform grid than this fraction of an interval are taken as the grid: they were rounded
/// when they were written, and so many different intervals are none of the plant's doing.
const UNIFORM_WITHIN: f64 = 1e-6;

/// The most rows that are computed at once: an hour at 10 kHz.
const MAX_ROWS: usize = 36_000_000;

/// Strictly increasing times, in seconds.
pub(crate) enum Stamps<'a> {
    /// On a grid.
    Uniform {
        /// The first.
        first_s: f64,
        /// Distance of neighbours.
        interval_s: f64,
        /// How many.
        len: usize,
    },
    /// Anywhere.
    Listed(&'a [f64]),
}

impl<'a> Stamps<'a> {
    pub(crate) fn new(time_s: &'a [f64]) -> Self {
        let (Some(&first_s), Some(&last_s), len @ 2..) = (time_s.first(), time_s.last(), time_s.len()) else {
            return Self::Listed(time_s);
        };
        let interval_s = (last_s - first_s) / (len - 1) as f64;
        let uniform = time_s.iter().enumerate().all(|(index, &stamp_s)| {
            let on_grid_s = first_s + index as f64 * interval_s;
            (stamp_s - on_grid_s).abs() <= UNIFORM_WITHIN * interval_s
        });
        if uniform { Self::Uniform { first_s, interval_s, len } } else { Self::Listed(time_s) }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Uniform { len, .. } => *len,
            Self::Listed(time_s) => time_s.len(),
        }
    }

    /// Stamp number `index`, which is below the length.
    pub(crate) fn at(&self, index: usize) -> f64 {
        match self {
            Self::Uniform { first_s, interval_s, .. } => first_s + index as f64 * interval_s,
            Self::Listed(time_s) => time_s.get(index).copied().unwrap_or(f64::NAN),
        }
    }

    /// From stamp `index` to the next; `None` for the last.
    pub(crate) fn interval_s(&self, index: usize) -> Option<f64> {
        match self {
            Self::Uniform { interval_s, len, .. } => (index + 1 < *len).then_some(*interval_s),
            Self::Listed(time_s) => Some(time_s.get(index + 1)? - time_s.get(index)?),
        }
    }

    /// All of them.
    pub(crate) fn to_vec(&self) -> Vec<f64> {
        (0..self.len()).map(|index| self.at(index)).collect()
    }

    /// Times at `rate_hz` from the first stamp to the last.
    pub(crate) fn resampled(&self, rate_hz: f64) -> Result<Vec<f64>, PlantError> {
        if !(rate_hz.is_finite() && rate_hz > 0.0) {
            let found_hz = rate_hz;
            return Err(PlantError::Rate { found_hz });
        }
        let Some(last) = self.len().checked_sub(1) else {
            return Ok(Vec::new());
        };
        let first_s = self.at(0);
        // The last one counts even if rounding puts it just beyond.
        let rows = ((self.at(last) - first_s) * rate_hz + 1e-6).floor() + 1.0;
        if rows > MAX_ROWS as f64 {
            let (found, most) = (rows, MAX_ROWS);
            return Err(PlantError::OutputSize { found, most });
        }
        Ok((0..rows as usize).map(|index| first_s + index as f64 / rate_hz).collect())
    }

    /// How many stamps go by from one output time to the next, where all of these are stamps.
    pub(crate) fn per_output(&self, output_s: &[f64]) -> Option<usize> {
        let interval_s = self.interval_s(0)?;
        let every = ((output_s.get(1)? - output_s.first()?) / interval_s).round() as usize;
        let is_stamp = |(index, time_s): (usize, &f64)| {
            index * every < self.len() && (self.at(index * every) - time_s).abs() < 1e-6 * interval_s
        };
        let fills = output_s.len() == (self.len().checked_sub(1)? / every.max(1)) + 1;
        (every > 0 && fills && output_s.iter().enumerate().all(is_stamp)).then_some(every)
    }
}
