//! What of a record can be believed: without wild samples, before a sensor that died, without what is cut off
//! at the ends of its range.

use stillbeam_recording::Recording;

use crate::result::Rejected;
use crate::signal_checks::{clipped_rows, clipping};
use crate::warnings::{Warning, WarningKind};
use crate::wild_samples::wild_samples;

/// Rows of one value that a dead sensor shows at least, and as a share of the record.
const STANDS_STILL: (usize, f64) = (16, 0.02);
/// Steps of the recorder's resolution that the signal still moved by before it stood still, for it to have
/// died.
const ALIVE: f64 = 6.0;

/// The samples that can be believed, and what is said of the others.
pub(crate) struct SoundPart {
    pub(crate) time_s: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) warnings: Vec<Warning>,
    pub(crate) left_out: Vec<Rejected>,
    /// The row at which it was first overdriven: there the signal is largest, whatever is left of it.
    pub(crate) overdriven: Option<usize>,
}

impl SoundPart {
    /// Takes the sound part of a column.
    pub(crate) fn new(recording: &Recording, column: &str, time_s: Vec<f64>, values: Vec<f64>) -> Self {
        let mut sound = Self { time_s, values, warnings: Vec::new(), left_out: Vec::new(), overdriven: None };
        sound.warnings.extend(doubled(recording, column));
        sound.without_wild_samples(&recording.name, column);
        sound.before_it_died(&recording.name, column);
        sound.without_clipped_samples(&recording.name, column);
        sound
    }

    fn without_wild_samples(&mut self, recording: &str, column: &str) {
        let wild = wild_samples(&self.values);
        let Some(&first) = wild.first() else { return };
        let samples: Vec<[f64; 2]> = wild.iter().map(|k| [self.time_s[*k], self.values[*k]]).collect();
        self.left_out.push(Rejected::Samples {
            recording: recording.to_owned(),
            count: wild.len(),
            first_s: self.time_s[first],
            last_s: self.time_s[wild[wild.len() - 1]],
            reason: "far outside all samples around them".to_owned(),
        });
        self.warnings.push(WarningKind::WildSamples { column: column.to_owned(), samples }.into());
        let keep = |k: &usize| wild.binary_search(k).is_err();
        self.time_s = (0..self.time_s.len()).filter(keep).map(|k| self.time_s[k]).collect();
        self.values = (0..self.values.len()).filter(keep).map(|k| self.values[k]).collect();
    }

    fn before_it_died(&mut self, recording: &str, column: &str) {
        let Some(end) = dies_at(&self.values) else { return };
        let (at_s, level, last_s) = (self.time_s[end], self.values[end], self.time_s[self.time_s.len() - 1]);
        self.warnings.push(WarningKind::NothingChanges { column: column.to_owned(), at_s, level }.into());
        self.left_out.push(Rejected::Samples {
            recording: recording.to_owned(),
            count: self.values.len() - end,
            first_s: at_s,
            last_s,
            reason: format!("the column stays at {level} to the end"),
        });
        self.time_s.truncate(end);
        self.values.truncate(end);
    }

    fn without_clipped_samples(&mut self, recording: &str, column: &str) {
        self.warnings.extend(clipping(column, &self.values, true));
        self.overdriven = clipped_rows(&self.values).first().copied();
        self.left_out.extend(leave_out_clipped(recording, &mut self.time_s, &mut self.values));
    }
}

/// Leaves out the samples at which a signal is cut off: where they were there is nothing to be known but that
/// it was beyond. Returns what is to be said of them.
pub(crate) fn leave_out_clipped(
    recording: &str,
    time_s: &mut Vec<f64>,
    values: &mut Vec<f64>,
) -> Option<Rejected> {
    let clipped = clipped_rows(values);
    let left_out = Rejected::Samples {
        recording: recording.to_owned(),
        count: clipped.len(),
        first_s: time_s[*clipped.first()?],
        last_s: time_s[*clipped.last()?],
        reason: "cut off at the end of the sensor's range".to_owned(),
    };
    let keep = |k: &usize| clipped.binary_search(k).is_err();
    *time_s = (0..time_s.len()).filter(keep).map(|k| time_s[k]).collect();
    *values = (0..values.len()).filter(keep).map(|k| values[k]).collect();
    Some(left_out)
}

/// The row from which nothing changes although the signal was still moving; `None` where it came to rest, or
/// goes on.
fn dies_at(values: &[f64]) -> Option<usize> {
    let last = values.last()?;
    let start = values.iter().rposition(|value| value != last)? + 1;
    let stands = values.len() - start;
    if stands < STANDS_STILL.0.max((STANDS_STILL.1 * values.len() as f64) as usize)
        || start < 2 * STANDS_STILL.0
    {
        return None;
    }
    let before = &values[start.saturating_sub(stands.clamp(STANDS_STILL.0, 400))..start];
    let steps = before.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let finest = steps.fold(f64::INFINITY, f64::min);
    let (low, high) =
        before.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(*y), high.max(*y)));
    (high - low > ALIVE * finest).then_some(start)
}

/// Other columns that hold the same samples.
fn doubled(recording: &Recording, column: &str) -> Vec<Warning> {
    let Ok(own) = recording.column(column) else { return Vec::new() };
    let same = |other: &[f64]| own.iter().zip(other).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
    let twins = recording.columns.iter().filter(|other| other.name != column && same(&other.samples));
    twins
        .map(|twin| WarningKind::DoubledColumn { column: column.to_owned(), other: twin.name.clone() }.into())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decay(step: f64) -> Vec<f64> {
        (0..2000)
            .map(|k| {
                let t = f64::from(k);
                ((-0.004 * t).exp() * (0.3 * t).cos() / step).round() * step
            })
            .collect()
    }

    #[test]
    fn a_sensor_that_dies_is_told_from_a_decay_that_comes_to_rest_below_the_resolution() {
        for step in [1e-6, 1e-3, 0.02, 0.05] {
            let at_rest = decay(step);
            assert_eq!(dies_at(&at_rest), None, "{step}");
            for at in [150, 200, 333] {
                let mut dead = at_rest.clone();
                let level = dead[at - 1];
                dead[at..].fill(level);
                let found = dies_at(&dead).unwrap();
                assert!(found < at && at - found < 9, "{step} {at}: {found}");
            }
        }
    }
}
