//! Two recordings of which one clock is known, in one table.

use stillbeam_identify::interpolation::PiecewiseCubic;
use stillbeam_identify::{ClockFit, InputInterpolation};
use stillbeam_recording::Recording;

/// The two recordings, and which one samples slower.
#[derive(Debug, Clone, Copy)]
pub struct Sides<'r> {
    /// The one whose clock is given up.
    pub first: &'r Recording,
    /// The one whose clock is kept.
    pub second: &'r Recording,
    /// Whether it is the first one that samples slower.
    pub first_is_slow: bool,
}

impl<'r> Sides<'r> {
    /// The recording that samples slower.
    pub fn slow(&self) -> &'r Recording {
        if self.first_is_slow { self.first } else { self.second }
    }

    /// The recording that samples faster.
    pub fn fast(&self) -> &'r Recording {
        if self.first_is_slow { self.second } else { self.first }
    }
}

/// Stamps closer than this share of the faster recording's interval are one row.
const ONE_ROW: f64 = 1e-6;

/// A row of the merged table.
#[derive(Debug, Clone, Copy)]
struct Row {
    time_s: f64,
    /// The row of the slower and of the faster recording.
    from: [Option<usize>; 2],
}

/// The rows of both recordings on the second one's clock. The slower one's values stand in its own rows
/// only; the faster one's are read off at the slower one's times, too.
pub fn merged(sides: Sides<'_>, clock: &ClockFit) -> Recording {
    let (slow, fast) = (sides.slow(), sides.fast());
    let on_kept = |own_s: f64, is_slow: bool| match (is_slow, sides.first_is_slow) {
        (true, true) => clock.to_fast(own_s),
        (false, false) => clock.to_slow(own_s),
        _ => own_s,
    };
    let slow_s: Vec<f64> = slow.time_s.iter().map(|t| on_kept(*t, true)).collect();
    let fast_s: Vec<f64> = fast.time_s.iter().map(|t| on_kept(*t, false)).collect();
    let rows = rows(&slow_s, &fast_s);
    let time_s: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
    let mut all = Recording::new(format!("{} with {}", slow.name, fast.name), time_s);
    let name = |own: &str, other: &Recording, from: &str| {
        // Columns of one name are told apart by where they come from.
        match other.columns.iter().any(|column| column.name == own) {
            true => format!("{from}_{own}"),
            false => own.to_owned(),
        }
    };
    let [slow_from, fast_from] = if sides.first_is_slow { ["first", "second"] } else { ["second", "first"] };
    for column in &slow.columns {
        let samples = rows.iter().map(|row| row.from[0].map_or(f64::NAN, |k| column.samples[k]));
        all = all.with_column(name(&column.name, fast, slow_from), samples.collect());
    }
    for column in &fast.columns {
        let samples = between(&fast_s, &column.samples, &rows);
        all = all.with_column(name(&column.name, slow, fast_from), samples);
    }
    all
}

fn rows(slow_s: &[f64], fast_s: &[f64]) -> Vec<Row> {
    let ends = [fast_s.first(), fast_s.last()].map(|end| end.copied().unwrap_or(0.0));
    let near_s = ONE_ROW * (ends[1] - ends[0]) / fast_s.len().max(2) as f64;
    let (mut slow, mut fast) = (0, 0);
    let mut rows = Vec::with_capacity(slow_s.len() + fast_s.len());
    while slow < slow_s.len() || fast < fast_s.len() {
        let next = |times: &[f64], at: usize| times.get(at).copied().unwrap_or(f64::INFINITY);
        let (a, b) = (next(slow_s, slow), next(fast_s, fast));
        let (takes_slow, takes_fast) = (a <= b + near_s, b <= a + near_s);
        rows.push(Row {
            time_s: if takes_fast { b } else { a },
            from: [takes_slow.then_some(slow), takes_fast.then_some(fast)],
        });
        slow += usize::from(takes_slow);
        fast += usize::from(takes_fast);
    }
    rows
}

/// A column of the faster recording in all rows within its time: its own samples, and between two that are
/// present what lies there; levels and numbers of states are held.
fn between(fast_s: &[f64], samples: &[f64], rows: &[Row]) -> Vec<f64> {
    let is_level = samples.iter().all(|value| value.is_nan() || value.fract() == 0.0);
    let present: Vec<(f64, f64)> =
        fast_s.iter().copied().zip(samples.iter().copied()).filter(|(_, value)| value.is_finite()).collect();
    let (times, values): (Vec<f64>, Vec<f64>) = present.into_iter().unzip();
    let read = (times.len() >= 4).then(|| {
        let kind = if is_level { InputInterpolation::Hold } else { InputInterpolation::Cubic };
        PiecewiseCubic::new(&times, &values, kind).sample(rows.iter().map(|row| row.time_s))
    });
    let is_inside = |time_s: f64| {
        let end = fast_s.partition_point(|t| *t < time_s);
        end > 0
            && samples.get(end - 1).is_some_and(|value| value.is_finite())
            && samples.get(end).is_some_and(|value| value.is_finite())
    };
    rows.iter()
        .enumerate()
        .map(|(at, row)| match (row.from[1], &read) {
            (Some(own), _) => samples[own],
            (None, Some(read)) if is_inside(row.time_s) => read[at][0],
            _ => f64::NAN,
        })
        .collect()
}
