//! Which rows of a column hold a reading of their own.
//!
//! A logger that runs faster than its sensor writes every reading several times: a staircase, whose edges
//! ring at images of every mode. A tracker that lost its mark writes the same value for "lost" each time.

use crate::warnings::WarningKind;

/// Rows that a reading is held for, on average, from which a column is a staircase.
const HELD: f64 = 1.8;
/// Share of all stays that are of the usual length or one row longer, and share that may be shorter: what a
/// coarse resolution holds stays for any length.
const ALIKE: f64 = 0.8;
const SHORTER: f64 = 0.02;
/// Usual step over the smallest one: a staircase of a fine sensor has steps of any height, a coarse one those
/// of its resolution.
const STEPS: f64 = 4.0;
/// Rows that say "lost" at least, share of all rows at most, and different values that the others have at
/// least.
const LOST: (usize, f64, usize) = (3, 0.5, 20);

/// The readings of a column, and what is said of the rows between them.
pub(crate) struct Readings {
    pub(crate) time_s: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) remarks: Vec<WarningKind>,
}

impl Readings {
    /// Of the rows that are present, those that hold a reading.
    pub(crate) fn of(column: &str, time_s: Vec<f64>, values: Vec<f64>) -> Self {
        let mut readings = Self { time_s, values, remarks: Vec::new() };
        readings.without_lost(column);
        readings.once_each(column);
        readings
    }

    fn without_lost(&mut self, column: &str) {
        let Some(value) = lost_value(&self.values) else { return };
        let rows = self.values.len();
        let kept = self.time_s.iter().zip(&self.values).filter(|(_, one)| **one != value);
        (self.time_s, self.values) = kept.map(|(t, one)| (*t, *one)).unzip();
        let count = rows - self.values.len();
        self.remarks.push(WarningKind::LostReadings { column: column.to_owned(), value, count });
    }

    fn once_each(&mut self, column: &str) {
        let Some((first_rows, rows_each)) = held(&self.values) else { return };
        let stamps: Vec<f64> = first_rows.iter().map(|row| self.time_s[*row]).collect();
        let row_s = (self.time_s[self.time_s.len() - 1] - self.time_s[0]) / (self.time_s.len() - 1) as f64;
        self.values = first_rows.iter().map(|row| self.values[*row]).collect();
        self.time_s = on_grid(stamps, row_s);
        self.remarks.push(WarningKind::HeldReadings { column: column.to_owned(), rows_each });
    }
}

/// The value that stands for "lost": it comes again and again, outside the range of all others by more than
/// that range.
fn lost_value(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [false, true].into_iter().find_map(|from_above| {
        if from_above {
            sorted.reverse();
        }
        let value = *sorted.first()?;
        let count = sorted.iter().take_while(|one| **one == value).count();
        let others = &sorted[count..];
        let (near, far) = (others.first()?, others.last()?);
        let different = 1 + others.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let is_lost = count >= LOST.0
            && (count as f64) < LOST.1 * sorted.len() as f64
            && different >= LOST.2
            && (near - value).abs() > (far - near).abs();
        is_lost.then_some(value)
    })
}

/// The first row of every reading, and how many rows a reading is held for; `None` where each row has its
/// own.
fn held(values: &[f64]) -> Option<(Vec<usize>, f64)> {
    let starts: Vec<usize> = (0..values.len()).filter(|k| *k == 0 || values[*k] != values[k - 1]).collect();
    // The first and the last stay may be cut.
    let inner = starts.get(1..)?;
    let stays: Vec<usize> = inner.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = stays.clone();
    sorted.sort_unstable();
    let usual = *sorted.get(sorted.len() / 2)?;
    // Of a rate that is no whole multiple stays of two lengths come in turn.
    let shortest = *sorted.get(sorted.len() / 10)?;
    let alike: Vec<usize> =
        stays.iter().copied().filter(|stay| (shortest..=shortest + 1).contains(stay)).collect();
    let rows_each = alike.iter().sum::<usize>() as f64 / alike.len().max(1) as f64;
    let share = |count: usize| count as f64 / stays.len() as f64;
    let shorter = stays.iter().filter(|stay| **stay < shortest).count();
    let regular = stays.len() >= crate::forced_record::MIN_ROWS
        && usual <= shortest + 1
        && rows_each >= HELD
        && share(alike.len()) > ALIKE
        && share(shorter) < SHORTER;
    (regular && has_fine_steps(values)).then(|| {
        // Readings that happen to be equal stand in one long stay.
        let ends = starts.iter().skip(1).copied().chain([values.len()]);
        let readings = starts.iter().zip(ends).flat_map(|(start, end)| {
            let count = (((end - start) as f64 / rows_each).round() as usize).max(1);
            (0..count).map(move |k| start + (k as f64 * rows_each).round() as usize)
        });
        (readings.filter(|row| *row < values.len()).collect(), rows_each)
    })
}

fn has_fine_steps(values: &[f64]) -> bool {
    let mut steps: Vec<f64> =
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let finest = steps.first().copied().unwrap_or(0.0);
    steps.get(steps.len() / 2).is_some_and(|usual| *usual > STEPS * finest)
}

/// Stamps of the rows in which readings were first seen, laid on the even grid that they come from; as they
/// are where they come from none.
fn on_grid(stamps: Vec<f64>, row_s: f64) -> Vec<f64> {
    let count = stamps.len() as f64;
    let (middle, mean_s) = (0.5 * (count - 1.0), stamps.iter().sum::<f64>() / count);
    let (mut moment, mut spread) = (0.0, 0.0);
    for (k, t) in stamps.iter().enumerate() {
        moment += (k as f64 - middle) * (t - mean_s);
        spread += (k as f64 - middle).powi(2);
    }
    let interval_s = moment / spread;
    let line = |k: usize| mean_s + interval_s * (k as f64 - middle);
    let even = stamps.iter().enumerate().all(|(k, t)| (t - line(k)).abs() < 1.05 * row_s);
    if even { (0..stamps.len()).map(line).collect() } else { stamps }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ringing(row: f64, seed: f64) -> f64 {
        let t = row + 0.3 * seed;
        (-0.002 * t).exp() * (0.05 * t).cos() + 1e-3 * (977.0 * t).sin()
    }

    #[test]
    fn staircases_of_any_ratio_are_read_once_a_step_and_coarse_or_plain_signals_are_left_alone() {
        for seed in 0..8 {
            let at = |row: f64| ringing(row, f64::from(seed));
            for ratio in [2.0, 2.4, 3.0, 5.0, 7.3] {
                let held: Vec<f64> = (0..2000).map(|k| at((f64::from(k) / ratio).floor() * ratio)).collect();
                let time_s: Vec<f64> = (0..2000).map(|k| 0.001 * f64::from(k)).collect();
                let found = Readings::of("a_m", time_s, held);
                let wanted = (2000.0_f64 / ratio).ceil();
                assert!((found.values.len() as f64 - wanted).abs() <= 1.0, "{ratio}: {}", found.values.len());
                assert!(matches!(found.remarks[..], [WarningKind::HeldReadings { .. }]));
                let even = found.time_s.windows(2).all(|t| (t[1] - t[0] - 0.001 * ratio).abs() < 2e-5);
                assert!(even, "{ratio}");
            }
            for quantum in [1e-9, 0.01, 0.05, 0.3] {
                let plain: Vec<f64> =
                    (0..2000).map(|k| (at(f64::from(k)) / quantum).round() * quantum).collect();
                assert!(held(&plain).is_none(), "{quantum}");
            }
        }
    }

    #[test]
    fn a_value_for_lost_is_told_from_an_offset_a_clipped_top_and_a_pulse() {
        for (lost, offset) in [(0.0, 5.0), (-1.0, 5.0), (9999.0, 0.0), (-999.0, 3.0)] {
            let tracked: Vec<f64> = (0..900)
                .map(|k| if k % 17 < 2 { lost } else { offset + ringing(f64::from(k), 0.0) })
                .collect();
            let time_s: Vec<f64> = (0..900).map(f64::from).collect();
            let found = Readings::of("tip_px", time_s, tracked);
            assert!(found.values.iter().all(|value| *value != lost) && found.values.len() > 700);
        }
        let clipped: Vec<f64> = (0..900).map(|k| ringing(f64::from(k), 0.0).min(0.4)).collect();
        let pulse: Vec<f64> = (0..900).map(|k| if k % 90 < 40 { 1.0 } else { 0.0 }).collect();
        let blows: Vec<f64> =
            (0..900).map(|k| if k % 300 < 30 { 50.0 + f64::from(k % 300) } else { 0.0 }).collect();
        for signal in [clipped, pulse, blows] {
            assert_eq!(lost_value(&signal), None);
        }
    }
}
