//! From a column of the time to stamps in seconds.

use super::assemble::Table;
use super::counters;
use super::split_seconds::SplitSeconds;
use crate::error::Problem;
use crate::grid::{last_decimal_place, lay, short};
use crate::recording::shorten;
use crate::unit_label;

/// Stamps from here on count from somewhere else, s, and cost digits if they are kept.
const FAR_S: f64 = 1e7;

/// Days that spreadsheets count from 1900, and MATLAB from the year 0: from 1954 to 2119, and from 1900 to
/// 2190.
const DAYS: [std::ops::Range<f64>; 2] = [20_000.0..80_000.0, 693_960.0..800_000.0];
/// The longest interval that is taken for a part of a day, in its unit: 0.17 s.
const SHORT_OF_A_DAY: f64 = 2e-6;

/// The column that holds the time.
pub(super) struct TimeColumn {
    pub(super) at: usize,
    /// Seconds per unit of its numbers, where that was given.
    pub(super) scale: Option<f64>,
    /// A column of times of day that goes with one of dates.
    pub(super) after: Option<usize>,
    /// The two columns that hold it, where it is divided into seconds and fractions of one.
    pub(super) fraction: Option<SplitSeconds>,
}

impl TimeColumn {
    /// The columns that make up the time.
    pub(super) fn used(&self) -> Vec<usize> {
        let pair = self.fraction.into_iter().flat_map(|pair| [pair.whole, pair.fraction]);
        std::iter::once(self.at).chain(self.after).chain(pair).collect()
    }
}

/// The column of times of day beside a column that holds dates alone.
pub(super) fn time_of_day_after(table: &Table, at: usize) -> Option<usize> {
    const DAY_S: f64 = 86_400.0;
    let clock = |at: usize| table.clocks.get(at) == Some(&true);
    let dates = clock(at) && table.columns.get(at)?.iter().all(|t| t.is_nan() || t % DAY_S == 0.0);
    (dates && clock(at + 1)).then_some(at + 1)
}

/// Stamps in seconds, increasing; remarks say what was made of them.
pub(super) fn seconds(
    table: &Table,
    time: &TimeColumn,
    remarks: &mut Vec<String>,
) -> Result<Vec<f64>, Problem> {
    let empty = Vec::new();
    // Beside times of day, which go on after midnight by themselves, dates say nothing new.
    let at = time.after.unwrap_or(time.at);
    let joined = time.fraction.map(|pair| pair.joined(table));
    let raw = joined.as_ref().or(table.columns.get(at)).unwrap_or(&empty);
    let row = |index: usize| u64::from(table.lines.get(index).copied().unwrap_or(index as u32 + 1));
    if let Some(index) = raw.iter().position(|stamp| !stamp.is_finite()) {
        return Err(Problem::MissingTime { row: row(index) });
    }
    let is_clock = table.clocks.get(at) == Some(&true);
    let whole = if is_clock || joined.is_some() { None } else { counters::unwrapped(raw) };
    if let Some((_, turns)) = &whole {
        remarks
            .push(format!("the counter of the time stamps begins anew {turns} times: it was taken to go on"));
    }
    let raw = whole.as_ref().map_or(raw, |(stamps, _)| stamps);
    let (scale, counted) = match time.fraction {
        Some(pair) => {
            let name = |at: usize| table.headings.get(at).map_or("", |heading| heading.source.as_str());
            remarks.push(format!(
                "the time is `{}` and `{}` together, and starts with the first whole second",
                shorten(name(pair.whole)),
                shorten(name(pair.fraction))
            ));
            (1.0, false)
        }
        None if is_clock => (1.0, false),
        None => scale(table, time, raw, remarks),
    };
    let first = raw.first().copied().unwrap_or(0.0);
    let moved = counted || table.from_zero || (first * scale).abs() >= FAR_S;
    let origin = if moved { first } else { 0.0 };
    let mut time_s: Vec<f64> = raw.iter().map(|stamp| seconds_of(stamp - origin, scale)).collect();
    if moved && first != 0.0 {
        let clock = if table.from_zero { "the printer's clock" } else { "the clock" };
        let unit = if scale == 1.0 { " s" } else { "" };
        remarks.push(format!("{clock} stood at {first}{unit}, which became 0"));
    }
    let quantum = last_decimal_place(&raw.iter().map(|stamp| stamp - origin).collect::<Vec<_>>());
    if let Some(laid) = lay(&time_s, quantum * scale) {
        time_s = laid.time_s;
        remarks.push(laid.remark);
    }
    let pairs = time_s.iter().zip(time_s.iter().skip(1));
    if let Some((index, (previous_s, time_s))) = pairs.enumerate().find(|(_, (a, b))| b <= a) {
        return Err(Problem::TimeNotIncreasing {
            row: row(index + 1),
            previous_s: *previous_s,
            time_s: *time_s,
        });
    }
    Ok(time_s)
}

/// A thousandth is not a number of the machine, a thousand is: the nearest stamp comes from a division.
fn seconds_of(stamp: f64, scale: f64) -> f64 {
    let inverse = (1.0 / scale).round();
    if scale < 1.0 && (inverse * scale - 1.0).abs() < 1e-12 { stamp / inverse } else { stamp * scale }
}

/// Seconds per unit of the stamps, and whether they count from 1970.
fn scale(table: &Table, time: &TimeColumn, raw: &[f64], remarks: &mut Vec<String>) -> (f64, bool) {
    if let Some(scale) = time.scale {
        return (scale, false);
    }
    let heading = table.headings.get(time.at);
    let source = heading.map_or("", |heading| heading.source.as_str());
    if let Some(unit) = heading.and_then(|heading| heading.unit.as_ref()) {
        if let Some(scale) = unit_label::seconds(unit) {
            if scale != 1.0 {
                remarks.push(format!("the time `{}` is in {unit}", shorten(source)));
            }
            return (scale, false);
        }
        remarks.push(format!(
            "`{unit}`, the unit of the time `{}`, is none of time: taken as seconds",
            shorten(source)
        ));
        return (1.0, false);
    }
    let first = raw.first().copied().unwrap_or(0.0);
    // From 1985 to 2096.
    let epoch = [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")]
        .into_iter()
        .find(|(scale, _)| (5e8..4e9).contains(&(first * scale)));
    if let Some((scale, unit)) = epoch {
        remarks.push(format!("the time `{}` counts {unit} from 1970", shorten(source)));
        return (scale, true);
    }
    let interval = raw.last().map_or(0.0, |last| (last - first) / raw.len().saturating_sub(1).max(1) as f64);
    // Spreadsheets and MATLAB count days. In seconds such an interval would be that of a digitiser which has
    // run for half a day and more.
    let days = DAYS.iter().any(|days| days.contains(&first)) && interval > 0.0 && interval < SHORT_OF_A_DAY;
    if days {
        remarks.push(format!("the time `{}` counts days, as spreadsheets and MATLAB do", shorten(source)));
        return (86_400.0, true);
    }
    let what = if table.has_header {
        format!("`{}` states no unit and", shorten(source))
    } else {
        "there is no header: the first column, which increases,".to_owned()
    };
    remarks
        .push(format!("{what} is taken as the time in seconds, {} s from sample to sample", short(interval)));
    (1.0, false)
}
