//! What instruments write before the table: keys and values, one pair a line.

use super::cells::{Separator, Value, split, value};
use super::dialect::Dialect;
use crate::heading::Heading;
use crate::unit_label::{enclosed, hertz, of_label, seconds};

/// Keys of the time from sample to sample, in small letters without signs.
const INTERVALS: [&str; 18] = [
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
    "interval",
    "samplingtime",
    "sampletime",
    "hresolution",
];
/// Keys of samples per time.
const RATES: [&str; 15] = [
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
    "framerate",
    "captureframerate",
    "fps",
];

/// Seconds from sample to sample that a number states by its name, such as `Fs`, `sampleRate` or
/// `interval_ms`.
pub(crate) fn interval_of(name: &str, number: f64) -> Option<f64> {
    let heading = Heading::parse(name, 1, None);
    let quantity: String =
        heading.quantity.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let whole: String = name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let is = |keys: &[&str]| keys.contains(&quantity.as_str()) || keys.contains(&whole.as_str());
    let scale = |known: fn(&str) -> Option<f64>| heading.unit.as_deref().map_or(Some(1.0), known);
    // Names as `rate_hz` spell the unit small.
    let of_rate = |unit: &str| hertz(unit).or_else(|| unit.eq_ignore_ascii_case("hz").then_some(1.0));
    let interval_s = if is(&INTERVALS) {
        number * scale(seconds).or_else(|| is(&["sampletime", "samplingtime"]).then_some(1.0))?
    } else if is(&RATES) {
        1.0 / (number * scale(of_rate).or_else(|| RATES.contains(&whole.as_str()).then_some(1.0))?)
    } else {
        return None;
    };
    (interval_s.is_finite() && interval_s > 0.0).then_some(interval_s)
}

/// Seconds from sample to sample, where the lines before the table state them.
pub(super) fn interval_s(lines: &[&str], dialect: &Dialect) -> Option<f64> {
    lines
        .iter()
        .find_map(|line| pair(line, dialect))
        .or_else(|| lines.windows(2).find_map(|two| below(two, dialect)))
}

/// Of two lines the number that stands below a key: some instruments write it behind the units of the
/// columns.
fn below(lines: &[&str], dialect: &Dialect) -> Option<f64> {
    let [keys, values] = lines else { return None };
    let (mut above, mut cells) = (Vec::new(), Vec::new());
    split(keys, dialect.separator, &mut above);
    split(values, dialect.separator, &mut cells);
    above.iter().zip(&cells).find_map(|(key, text)| stated(&[key, text], dialect))
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
    stated(&cells, dialect)
}

/// The interval that a key and the cells after it state.
fn stated(cells: &[&str], dialect: &Dialect) -> Option<f64> {
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
