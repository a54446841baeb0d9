//! Tables that have one row per value (`time,axis,value`) instead of one per instant.

use super::assemble::Table;
use crate::heading::Heading;
use crate::recording::shorten;

/// Makes one column of every word of a column of text, where each stamp comes once with each word, always in
/// the same order. Says whether it did.
///
/// Read as they stand such rows would be several samples of one instant, and a signal that jumps between its
/// axes.
pub(super) fn widen(table: &mut Table, time: usize) -> bool {
    let count = table.columns.get(time).map_or(0, Vec::len);
    let found = (0..table.labels.len()).find_map(|at| Some((at, keys(table, time, at, count)?)));
    let Some((at, words)) = found else { return false };
    let each = words.len();
    let rows = count / each;
    let (mut headings, mut columns, mut clocks) = (Vec::new(), Vec::new(), Vec::new());
    for (place, (heading, values)) in table.headings.drain(..).zip(table.columns.drain(..)).enumerate() {
        let clock = table.clocks.get(place) == Some(&true);
        let every =
            |first: usize| values.iter().skip(first).step_by(each).take(rows).copied().collect::<Vec<f64>>();
        if place == time || clock {
            clocks.push((place, headings.len(), clock));
            columns.push(every(0));
            headings.push(heading);
        } else if !values.is_empty() {
            for (first, word) in words.iter().enumerate() {
                clocks.push((place, headings.len(), false));
                columns.push(every(first));
                headings.push(Heading::of_word(&heading, word, each));
            }
        }
    }
    let key = at + 1;
    table.remarks.push(format!(
        "every time stamp comes {each} times, once for each word of column {key}: read as columns of their own, {}",
        words.iter().map(|word| format!("`{}`", shorten(word))).collect::<Vec<_>>().join(", ")
    ));
    table.clocks = clocks.iter().map(|(_, _, clock)| *clock).collect();
    table.lines = table.lines.iter().step_by(each).take(rows).copied().collect();
    table.labels.clear();
    (table.headings, table.columns) = (headings, columns);
    true
}

/// The words of a column in the order in which every stamp has them.
fn keys(table: &Table, time: usize, at: usize, count: usize) -> Option<Vec<String>> {
    let (words, codes) = table.labels.get(at)?.of(count)?;
    let each = words.len();
    let stamps = table.columns.get(time)?;
    let whole = count / each * each;
    let alike = stamps.get(..whole)?.chunks(each).zip(codes.chunks(each)).all(|(stamps, codes)| {
        stamps.iter().all(|stamp| Some(stamp) == stamps.first())
            && codes.iter().zip(0..).all(|(code, place)| *code == place)
    });
    (alike && whole > each).then(|| words.to_vec())
}
