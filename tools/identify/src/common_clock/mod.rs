//! Two recordings of one experiment on one clock: offset and drift between their clocks, with standard
//! errors.
//!
//! The clocks run as t_fast = t_slow + offset + drift (t_slow - first), `first` being the slow recording's
//! first stamp. They are found from edges that both recorded ([`clock_by_edges`]) or from a motion that
//! both saw ([`clock_by_motion`]).

mod motion;

use nalgebra::{Matrix2, Vector2};
use thiserror::Error;

use crate::result::Estimate;

pub use motion::{Derivative, Signal, clock_by_motion};

/// How one recording's clock runs against another's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockFit {
    /// What the faster sampled recording's clock is ahead at the slower one's first stamp, s.
    pub offset_s: Estimate,
    /// What it gains, s per s; none where a single event tells the offset only.
    pub drift: Option<Estimate>,
    /// First stamp of the slower sampled recording, s.
    pub first_s: f64,
    /// Samples or edges that were compared.
    pub pairs: usize,
    /// Share of the motion's power that is the same in both; 1 for edges.
    pub explained: f64,
}

impl ClockFit {
    /// The same where the roles are the other way round; `first_s` is the other recording's first stamp.
    #[must_use]
    pub fn reversed(&self, first_s: f64) -> Self {
        let drift = self.drift.map(|drift| Estimate { value: 1.0 / (1.0 + drift.value) - 1.0, ..drift });
        let offset_s = Estimate { value: self.to_slow(first_s) - first_s, ..self.offset_s };
        Self { offset_s, drift, first_s, ..*self }
    }

    /// A time of the slower sampled recording on the clock of the faster one, s.
    pub fn to_fast(&self, slow_s: f64) -> f64 {
        let drift = self.drift.map_or(0.0, |drift| drift.value);
        slow_s + self.offset_s.value + drift * (slow_s - self.first_s)
    }

    /// A time of the faster sampled recording on the clock of the slower one, s.
    pub fn to_slow(&self, fast_s: f64) -> f64 {
        let drift = self.drift.map_or(0.0, |drift| drift.value);
        self.first_s + (fast_s - self.offset_s.value - self.first_s) / (1.0 + drift)
    }
}

/// Why two recordings cannot be brought onto one clock.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ClockError {
    /// The signals are not the same motion.
    #[error(
        "at no offset do they show the same motion (at best {:.0} % of its power agrees); name two columns that saw the same thing, or a trigger",
        100.0 * explained
    )]
    NothingInCommon {
        /// Share of the power that agrees at the best offset.
        explained: f64,
    },
    /// The motion repeats itself.
    #[error(
        "the motion repeats itself: offsets of {first_s:.4} s and {second_s:.4} s fit equally well; record a motion that does not repeat, such as a sweep, or use a trigger"
    )]
    Ambiguous {
        /// One offset, s.
        first_s: f64,
        /// Another one, s.
        second_s: f64,
    },
    /// Too little to compare.
    #[error("{found} samples are too few to compare, {needed} are needed; record longer")]
    TooFew {
        /// How many there are.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// Edges that do not belong to each other.
    #[error(
        "{slow} frames or edges cannot be paired with {fast} edges; there has to be one edge for every frame, or one for the first"
    )]
    EdgesDiffer {
        /// In the slower sampled recording.
        slow: usize,
        /// In the faster sampled one.
        fast: usize,
    },
    /// Edges at times that no steady clock makes.
    #[error(
        "the edges do not keep step: they scatter by {scatter_s:.2e} s, more than the samples' distance of {interval_s:.2e} s; frames were lost, or the trigger bounces"
    )]
    EdgesScatter {
        /// Scatter around the straight line, s.
        scatter_s: f64,
        /// Distance of the samples that saw the edges, s.
        interval_s: f64,
    },
}

/// Times at which a signal passes the middle of its range upwards, each in the middle between two samples;
/// with a margin, so that noise makes no edges. Also a first sample that is high after none.
pub fn rising_edges_s(time_s: &[f64], level: &[f64]) -> Vec<f64> {
    let present = || time_s.iter().zip(level).filter(|(_, value)| value.is_finite());
    let (low, high) = present().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, value)| {
        (low.min(*value), high.max(*value))
    });
    let (below, above) = (low + 0.3 * (high - low), low + 0.7 * (high - low));
    let mut edges = Vec::new();
    let mut last_low_s = None;
    for (time, value) in present() {
        if *value < below {
            last_low_s = Some(*time);
        } else if *value > above
            && high > low
            && let Some(low_s) = last_low_s.take()
        {
            edges.push(0.5 * (low_s + time));
        }
    }
    edges
}

/// The clocks from times of the same events in both recordings: every one of the slower sampled
/// recording's, or one of the faster one's for the first. `interval_s` is the distance of the samples that
/// saw the edges.
///
/// # Errors
/// [`ClockError`] where they do not belong together.
pub fn clock_by_edges(slow_s: &[f64], fast_s: &[f64], interval_s: f64) -> Result<ClockFit, ClockError> {
    let (Some(&first_s), Some(&first_edge_s)) = (slow_s.first(), fast_s.first()) else {
        return Err(ClockError::EdgesDiffer { slow: slow_s.len(), fast: fast_s.len() });
    };
    // An edge lies anywhere between two samples.
    let least = interval_s / 12.0_f64.sqrt();
    if fast_s.len() == 1 {
        let offset_s = Estimate { value: first_edge_s - first_s, stderr: least };
        return Ok(ClockFit { offset_s, drift: None, first_s, pairs: 1, explained: 1.0 });
    }
    if slow_s.len() != fast_s.len() {
        return Err(ClockError::EdgesDiffer { slow: slow_s.len(), fast: fast_s.len() });
    }
    let rows: Vec<(f64, f64)> =
        slow_s.iter().zip(fast_s).map(|(slow, fast)| (slow - first_s, fast - slow)).collect();
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| rows.iter().map(of).sum::<f64>();
    let normal = Matrix2::new(rows.len() as f64, sum(&|r| r.0), sum(&|r| r.0), sum(&|r| r.0 * r.0));
    let Some(inverse) = normal.try_inverse() else {
        return Err(ClockError::TooFew { found: rows.len(), needed: 2 });
    };
    let found = inverse * Vector2::new(sum(&|r| r.1), sum(&|r| r.0 * r.1));
    let left = sum(&|r| (r.1 - found[0] - found[1] * r.0).powi(2));
    let scatter_s = (left / (rows.len().max(3) - 2) as f64).sqrt();
    if scatter_s > 2.0 * interval_s {
        return Err(ClockError::EdgesScatter { scatter_s, interval_s });
    }
    // Edges and samples may keep step, and then all errors have one sign.
    let error = scatter_s.max(least);
    let stderr = |index: usize| error * inverse[(index, index)].sqrt();
    Ok(ClockFit {
        offset_s: Estimate { value: found[0], stderr: stderr(0).max(least) },
        drift: Some(Estimate { value: found[1], stderr: stderr(1) }),
        first_s,
        pairs: rows.len(),
        explained: 1.0,
    })
}
