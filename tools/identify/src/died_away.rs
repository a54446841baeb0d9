//! The part of an impact test in which something happens: what is recorded long after the last blow is noise,
//! and a tap on a tool is over within a few thousandths of its record.

use crate::forced_record::ForcedRecord;
use crate::input_rest::median;
use crate::result::Rejected;

/// Blocks in which the level of an output is looked at, and the last ones of them, which tell its noise.
const BLOCKS: usize = 512;
const LAST: usize = 256;
/// Level of a block above that of the noise, as a ratio of root mean squares, at which something still rings:
/// blocks of noise stay below.
const ABOVE: f64 = 1.5;
/// Times it takes to fall into the noise that are kept: by then it is as far below the noise as it began
/// above it, twice.
const KEPT: f64 = 3.0;
/// Share of the record that has to be noise for it to be left out.
const WORTH: f64 = 0.5;
/// Share of the input's largest value below which it is over.
const OVER: f64 = 0.02;
/// Rows that are kept in any case.
const LEAST_ROWS: usize = 512;

/// The record up to where its response to the last blow has long died away; as it is where that is most of
/// it.
pub(crate) fn until_died_away(record: ForcedRecord) -> ForcedRecord {
    match rows_alive(&record) {
        Some(rows) => shortened(record, rows),
        None => record,
    }
}

fn rows_alive(record: &ForcedRecord) -> Option<usize> {
    let rows = record.time_s.len();
    let length = rows / BLOCKS;
    if length < 4 {
        return None;
    }
    let input: Vec<f64> =
        record.input.sample(record.time_s.iter().copied()).into_iter().map(|value| value[0].abs()).collect();
    let largest = input.iter().fold(0.0_f64, |top, value| top.max(*value));
    let blow_ends = input.iter().rposition(|value| *value > OVER * largest)?;
    if blow_ends as f64 > (1.0 - WORTH) * rows as f64 {
        return None;
    }
    let levels: Vec<f64> = record
        .output
        .chunks_exact(length)
        .map(|block| {
            let mean = block.iter().sum::<f64>() / length as f64;
            (block.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / length as f64).sqrt()
        })
        .collect();
    let noise = median(levels[levels.len().saturating_sub(LAST)..].to_vec())?;
    let last_alive = levels.iter().rposition(|level| *level > ABOVE * noise)?;
    let alive = ((last_alive + 1) * length).saturating_sub(blow_ends).max(length);
    let kept = (blow_ends + (KEPT * alive as f64) as usize).max(LEAST_ROWS);
    (noise > 0.0 && (kept as f64) < (1.0 - WORTH) * rows as f64).then_some(kept)
}

fn shortened(mut record: ForcedRecord, rows: usize) -> ForcedRecord {
    let last_s = record.time_s[record.time_s.len() - 1];
    record.left_out.push(Rejected::Samples {
        recording: record.name.clone(),
        count: record.time_s.len() - rows,
        first_s: record.time_s[rows] + record.origin_s,
        last_s: last_s + record.origin_s,
        reason: "long after the last blow: the response has died away, and only noise is left".to_owned(),
    });
    record.time_s.truncate(rows);
    record.output.truncate(rows);
    // The input as far as it may be delayed; it rests there.
    let beyond_s = record.input.knots_s[record.input.knots_s.len() - 1] - last_s;
    let first_s = record.input.knots_s[0];
    let ends_s = record.time_s[rows - 1] + beyond_s.max(0.0);
    record.input = record.input.between(first_s, ends_s);
    record
}
