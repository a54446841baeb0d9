//! One signal that goes on from line to line, several values to a line: records of strong motion (PEER's
//! `.AT2`, `.VT2`, `.DT2`) are written so. As a table it would be as many signals as a line has values.
//!
//! What tells it from a table is its head, which states how many values there are together.

/// Lines before the values that are looked at.
const HEAD: usize = 64;
/// Lines of values at least.
const LEAST_LINES: usize = 8;

/// The signal as a table of times and values; `None` for text that is a table, or states no count or no
/// interval.
pub(super) fn as_table(text: &str) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().take(HEAD).position(|line| !values(line).is_empty())?;
    let (head, rows) = lines.split_at(first);
    let rows: Vec<Vec<&str>> =
        rows.iter().map(|line| values(line)).take_while(|row| !row.is_empty()).collect();
    let (last, full) = rows.split_last()?;
    let width = full.first()?.len();
    let is_filled = full.iter().all(|row| row.len() == width) && last.len() <= width;
    if width < 2 || full.len() < LEAST_LINES || !is_filled {
        return None;
    }
    let count = full.len() * width + last.len();
    let interval_s = head.iter().filter(|line| states(line, count)).find_map(|line| interval_s(line))?;
    let mut table = format!("time_s,{}\n", name(head));
    for (k, value) in rows.iter().flatten().enumerate() {
        table += &format!("{:.9},{value}\n", k as f64 * interval_s);
    }
    Some(table)
}

/// The numbers of a line that holds nothing else; empty for any other.
fn values(line: &str) -> Vec<&str> {
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    if words.iter().all(|word| word.parse::<f64>().is_ok()) { words } else { Vec::new() }
}

fn words(line: &str) -> Vec<&str> {
    line.split([' ', '\t', '=', ',', ':', ';']).filter(|word| !word.is_empty()).collect()
}

/// Whether a line states so many.
fn states(line: &str, count: usize) -> bool {
    words(line).iter().any(|word| word.parse() == Ok(count))
}

/// Seconds from sample to sample: the number behind `DT`, before `SEC`, or in its place among numbers whose
/// names follow them (`4000 .0050 NPTS, DT`).
fn interval_s(line: &str) -> Option<f64> {
    let words = words(line);
    let number = |at: usize| words.get(at)?.parse::<f64>().ok().filter(|number| *number > 0.0);
    let is = |word: &str, what: &str| word.eq_ignore_ascii_case(what);
    let key = words.iter().position(|word| is(word, "DT"));
    let behind = key.and_then(|at| number(at + 1));
    let among = key.and_then(|at| {
        let numbers = words.iter().take_while(|word| word.parse::<f64>().is_ok()).count();
        number(at.checked_sub(numbers).filter(|place| *place < numbers)?)
    });
    let seconds = words.iter().position(|word| is(word.trim_end_matches('.'), "SEC"));
    behind.or(among).or_else(|| number(seconds?.checked_sub(1)?))
}

/// What the head calls the signal, with its unit.
fn name(head: &[&str]) -> String {
    let head: Vec<String> = head.iter().map(|line| line.to_ascii_lowercase()).collect();
    let quantities = ["acceleration", "velocity", "displacement"];
    let is_named = |quantity: &&str| head.iter().any(|line| line.contains(*quantity));
    let quantity = quantities.into_iter().find(is_named).unwrap_or("signal");
    let unit = head.iter().find_map(|line| line.split_once("units of ")?.1.split_whitespace().next());
    unit.map_or_else(|| quantity.to_owned(), |unit| format!("{quantity} ({unit})"))
}
