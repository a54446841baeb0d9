//! Recordings cut where rows are missing.
//!
//! What drove the machine while nothing was recorded is not known, and a lightly damped machine remembers it:
//! a simulation across the gap is another motion. What follows a gap is therefore a recording of its own that
//! begins in motion. A free decay is driven by nothing, and a controller makes its command from what was
//! recorded of its reference: these stay whole.

use std::ops::Range;

use stillbeam_plant::Model;
use stillbeam_recording::{Recording, Role};

use crate::error::DiagnoseError;
use crate::record::Record;

/// Rows are missing where an interval is this many times as long as all but one in twenty are: the input is
/// told over one or two lost samples by its neighbours.
const MISSING: f64 = 3.5;
/// Quantile of the intervals that is taken for the longest regular one.
const REGULAR: f64 = 0.95;

/// A recording of a driven machine as records that have no rows missing, and lines that say so.
pub(crate) fn stretches(
    recording: &Recording,
    role: Role,
    model: &Model,
    (slowest_hz, fastest_hz): (Option<f64>, Option<f64>),
) -> Result<(Vec<Record>, Vec<String>), DiagnoseError> {
    let ready = |recording: &Recording| Record::new(recording, role, model, slowest_hz, fastest_hz);
    let gaps = gaps(&recording.time_s);
    if gaps.is_empty() || model.input().is_none() || ready(recording)?.rerun.is_in_loop() {
        return Ok((vec![ready(recording)?], Vec::new()));
    }
    let ends = gaps.iter().map(|gap| gap.end).chain([recording.len()]);
    let starts = [0].into_iter().chain(gaps.iter().map(|gap| gap.end));
    let mut records = Vec::new();
    let mut too_short = Vec::new();
    for range in starts.zip(ends).map(|(start, end)| start..end) {
        let begins_moving = range.start > 0;
        match ready(&stretch(recording, range.clone())) {
            Ok(record) => records.push(Record { begins_moving, ..record }),
            Err(_) => too_short.push(range),
        }
    }
    if records.is_empty() {
        return Ok((vec![ready(recording)?], Vec::new()));
    }
    let of = |lines: String| format!("{}: {lines}", recording.name);
    let time_s = |index: usize| recording.time_s[index];
    let missing = gaps.iter().map(|gap| {
        of(format!(
            "rows are missing between {:.4} s and {:.4} s, and what drove the machine then: what follows is taken \
             for a recording of its own that begins in motion",
            time_s(gap.start),
            time_s(gap.end)
        ))
    });
    let dropped = too_short.iter().map(|range| {
        of(format!(
            "the stretch from {:.4} s to {:.4} s between missing rows is too short to tell anything and was left out",
            time_s(range.start),
            time_s(range.end - 1)
        ))
    });
    Ok((records, missing.chain(dropped).collect()))
}

/// Where rows are missing: the last before and the first after.
fn gaps(time_s: &[f64]) -> Vec<Range<usize>> {
    let intervals_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = intervals_s.clone();
    sorted.sort_by(f64::total_cmp);
    let Some(regular_s) = sorted.get((REGULAR * sorted.len() as f64) as usize) else { return Vec::new() };
    let is_gap =
        |(index, interval_s): (usize, &f64)| (*interval_s > MISSING * regular_s).then_some(index..index + 1);
    intervals_s.iter().enumerate().filter_map(is_gap).collect()
}

fn stretch(recording: &Recording, range: Range<usize>) -> Recording {
    let mut stretch = recording.clone();
    if let Some(start_s) = recording.time_s.get(range.start).filter(|_| range.start > 0) {
        stretch.name = format!("{} from {start_s:.3} s", recording.name);
    }
    stretch.time_s = recording.time_s[range.clone()].to_vec();
    for column in &mut stretch.columns {
        column.samples = column.samples[range.clone()].to_vec();
    }
    stretch
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_missing_where_an_interval_is_long_among_its_like() {
        let even: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        assert!(gaps(&even).is_empty());
        let one_lost: Vec<f64> = even.iter().copied().filter(|t| (t - 1.0).abs() > 1e-6).collect();
        assert!(gaps(&one_lost).is_empty(), "its neighbours tell what the input was");
        let stopped: Vec<f64> = even.iter().copied().filter(|t| !(0.5..0.6).contains(t)).collect();
        assert_eq!(gaps(&stopped).into_iter().map(|gap| gap.start).collect::<Vec<_>>(), [49]);
        // An uneven clock, whose long intervals are many.
        let uneven: Vec<f64> = even.iter().enumerate().map(|(k, t)| t + 0.04 * (k / 8) as f64).collect();
        assert!(gaps(&uneven).is_empty());
    }
}
