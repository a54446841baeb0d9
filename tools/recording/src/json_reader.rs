//! JSON in: stillbeam's own, and objects of arrays of numbers.

use serde_json::{Map, Value};

use crate::content::Content;
use crate::error::Problem;
use crate::options::ReadOptions;
use crate::recording::shorten;
use crate::table::{Heading, Table, assemble, decode, interval_of, seconds_after};

/// Reads an object whose members are arrays of numbers, an array of objects with numbers as members, or such
/// objects one behind the other (JSON lines).
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    let (text, _) = decode(bytes);
    let mut remarks = Vec::new();
    let document = document(&text, &mut remarks)?;
    let mut columns: Vec<Signal> = Vec::new();
    let mut interval_s = None;
    match &document {
        Value::Array(records) => from_records(records, &mut columns),
        Value::Object(members) => {
            // The arrays lie at the top, or one level down as in stillbeam's own files.
            let inner = members.get("columns").or_else(|| members.get("data")).unwrap_or(&document);
            match inner {
                Value::Object(members) => from_members(members, &mut columns),
                Value::Array(records) => from_records(records, &mut columns),
                _ => {}
            }
            interval_s = members.iter().find_map(|(name, value)| interval_of(name, value.as_f64()?));
        }
        _ => {}
    }
    let longest = columns.iter().map(|column| column.values.len()).max().unwrap_or(0);
    let (kept, other): (Vec<_>, Vec<_>) =
        columns.into_iter().partition(|column| column.values.len() == longest);
    if kept.is_empty() || longest == 0 {
        return Err(Problem::JsonWithoutSignals);
    }
    let mut table = Table { has_header: true, interval_s, remarks, ..Table::default() };
    for (position, signal) in (1..).zip(kept) {
        table.headings.push(Heading::parse(&signal.name, position, None));
        table.clocks.push(signal.is_clock);
        table.columns.push(signal.values);
    }
    if !other.is_empty() {
        let names: Vec<String> = other.iter().map(|signal| format!("`{}`", shorten(&signal.name))).collect();
        table.remarks.push(format!("left out, of another length: {}", crate::error::some(&names)));
    }
    assemble(table, options)
}

/// One array of numbers, or of dates as seconds after the first.
struct Signal {
    name: String,
    values: Vec<f64>,
    is_clock: bool,
}

/// The whole text as one value; of several objects one behind the other an array.
fn document(text: &str, remarks: &mut Vec<String>) -> Result<Value, Problem> {
    let failed = |error: &serde_json::Error| Problem::Json { line: error.line(), reason: error.to_string() };
    let whole = match serde_json::from_str(text) {
        Ok(document) => return Ok(document),
        Err(error) => failed(&error),
    };
    let mut records = Vec::new();
    for record in serde_json::Deserializer::from_str(text).into_iter::<Value>() {
        match record {
            Ok(record) => records.push(record),
            // A logger that was switched off leaves its last line unfinished.
            Err(error) if error.is_eof() && records.len() > 1 => {
                remarks.push("the last line is cut and was left out".to_owned())
            }
            Err(error) if records.len() > 1 => return Err(failed(&error)),
            Err(_) => return Err(whole),
        }
    }
    Ok(Value::Array(records))
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Null => Some(f64::NAN),
        Value::Number(number) => number.as_f64().filter(|number| number.is_finite()),
        Value::String(text) if matches!(text.as_str(), "NaN" | "nan" | "") => Some(f64::NAN),
        _ => None,
    }
}

fn from_members(members: &Map<String, Value>, columns: &mut Vec<Signal>) {
    for (name, member) in members {
        let Value::Array(values) = member else { continue };
        columns.extend(signal(name.clone(), values));
    }
}

/// Numbers, or dates; `None` for anything else.
fn signal(name: String, values: &[Value]) -> Option<Signal> {
    let numbers: Option<Vec<f64>> = values.iter().map(number).collect();
    if let Some(values) = numbers.filter(|numbers| !numbers.is_empty()) {
        return Some(Signal { name, values, is_clock: false });
    }
    let texts: Option<Vec<&str>> = values.iter().map(Value::as_str).collect();
    let values = seconds_after(texts?.into_iter())?;
    Some(Signal { name, values, is_clock: true })
}

/// A signal of every member of the records; of members that are objects or arrays themselves (`"acc": {"x":
/// 1, "y": 2}`) a signal of each of theirs.
fn from_records(records: &[Value], columns: &mut Vec<Signal>) {
    let Some(Value::Object(first)) = records.first() else { return };
    let all = |pointer: &str| -> Vec<Value> {
        records.iter().map(|record| record.pointer(pointer).cloned().unwrap_or(Value::Null)).collect()
    };
    let escaped = |key: &str| key.replace('~', "~0").replace('/', "~1");
    for (name, member) in first {
        let at = format!("/{}", escaped(name));
        let inner: Vec<String> = match member {
            Value::Object(members) => members.keys().cloned().collect(),
            Value::Array(values) => (0..values.len()).map(|place| place.to_string()).collect(),
            _ => {
                columns.extend(signal(name.clone(), &all(&at)));
                continue;
            }
        };
        columns.extend(
            inner
                .iter()
                .filter_map(|key| signal(format!("{name}_{key}"), &all(&format!("{at}/{}", escaped(key))))),
        );
    }
}
