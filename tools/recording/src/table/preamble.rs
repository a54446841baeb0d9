//! What instruments write before the table: keys and values, one pair a line.

use super::cells::{Separator, Value, split, value};
use super::dialect::Dialect;
use crate::unit_label::{enclosed, hertz, of_label, seconds};

/// Keys of the time from sample to sample, in small letters without signs.
const INTERVALS: [&str; 14] = [
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "deltax",
    "dt",
    "deltat",
    "increment",
    "xincrement",
    "timeincrement",
    "timestep",
    "horizontalinterval",
    "hinterval",
    "timebaseinterval",
];
/// Keys of samples per time.
const RATES: [&str; 12] = [
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "fs",
    "rate",
    "abtastrate",
    "samplespersecond",
    "datarate",
    "odr",
    "acquisitionrate",
    "scanrate",
];

/// Seconds from sample to sample, where the lines before the table state them.
pub(super) fn interval_s(lines: &[&str], dialect: &Dialect) -> Option<f64> {
    lines.iter().find_map(|line| pair(line, dialect))
}

fn pair(line: &str, dialect: &Dialect) -> Option<f64> {
    let line = line.trim_start_matches(['#', '%', ';', '!', '/', ' ']);
    let mut cells = Vec::new();
    let sign = [':', '='].into_iter().find(|sign| line.contains(*sign) && line.split(*sign).count() == 2);
    match sign {
        Some(sign) => cells.extend(line.split(sign).map(str::trim)),
        None => {
            let separator = if dialect.separator == Separator::Blanks {
                Separator::Byte(b'\t')
            } else {
                dialect.separator
            };
            split(line, separator, &mut cells);
        }
    }
    let (key, rest) = cells.split_first()?;
    let plain: String = key.split(['(', '[']).next()?.chars().filter(|c| c.is_alphanumeric()).collect();
    let plain = plain.to_lowercase();
    let is = |keys: &[&str]| keys.contains(&plain.as_str());
    let in_key = key.find(['(', '[']).and_then(|at| enclosed(key.get(at..)?.trim()));
    let text = rest.first()?.trim_matches([',', ';', ' ', '"']);
    // The number may carry its unit, or the next cell does.
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | ',' | '-' | '+' | 'e' | 'E')))
        .unwrap_or(text.len());
    let (digits, unit) = (text.get(..end)?.trim(), text.get(end..)?.trim());
    let Value::Number(number) = value(digits, dialect.decimal_comma) else { return None };
    let unit = [unit, in_key.unwrap_or(""), rest.get(1).copied().unwrap_or("")]
        .into_iter()
        .find(|unit| !unit.is_empty());
    let unit = unit.and_then(of_label);
    let interval_s = if is(&INTERVALS) {
        number * unit.as_deref().and_then(seconds).unwrap_or(1.0)
    } else if is(&RATES) {
        1.0 / (number * unit.as_deref().and_then(hertz).unwrap_or(1.0))
    } else {
        return None;
    };
    (interval_s.is_finite() && interval_s > 0.0).then_some(interval_s)
}
