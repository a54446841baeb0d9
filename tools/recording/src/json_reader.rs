//! JSON in: stillbeam's own, and objects of arrays of numbers.

use serde_json::{Map, Value};

use crate::content::Content;
use crate::error::Problem;
use crate::options::ReadOptions;
use crate::recording::shorten;
use crate::table::{Heading, Table, assemble, decode};

/// Reads an object whose members are arrays of numbers, or an array of objects with numbers as members.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    let (text, _) = decode(bytes);
    let document: Value = serde_json::from_str(&text)
        .map_err(|error| Problem::Json { line: error.line(), reason: error.to_string() })?;
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
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
            let number = |key: &str| members.get(key).and_then(Value::as_f64).filter(|n| *n > 0.0);
            let rate = ["rate_hz", "sample_rate", "sample_rate_hz", "fs"].into_iter().find_map(number);
            interval_s = number("interval_s").or_else(|| rate.map(f64::recip));
        }
        _ => {}
    }
    let longest = columns.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
    let (kept, other): (Vec<_>, Vec<_>) =
        columns.into_iter().partition(|(_, values)| values.len() == longest);
    if kept.is_empty() || longest == 0 {
        return Err(Problem::JsonWithoutSignals);
    }
    let mut table =
        Table { has_header: true, interval_s, clocks: vec![false; kept.len()], ..Table::default() };
    for (position, (name, values)) in (1..).zip(kept) {
        table.headings.push(Heading::parse(&name, position, None));
        table.columns.push(values);
    }
    if !other.is_empty() {
        let names: Vec<String> = other.iter().map(|(name, _)| format!("`{}`", shorten(name))).collect();
        table.remarks.push(format!("left out, of another length: {}", crate::error::some(&names)));
    }
    assemble(table, options)
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Null => Some(f64::NAN),
        Value::Number(number) => number.as_f64().filter(|number| number.is_finite()),
        Value::String(text) if matches!(text.as_str(), "NaN" | "nan" | "") => Some(f64::NAN),
        _ => None,
    }
}

fn from_members(members: &Map<String, Value>, columns: &mut Vec<(String, Vec<f64>)>) {
    for (name, member) in members {
        let Value::Array(values) = member else { continue };
        let numbers: Option<Vec<f64>> = values.iter().map(number).collect();
        columns.extend(numbers.filter(|numbers| !numbers.is_empty()).map(|numbers| (name.clone(), numbers)));
    }
}

fn from_records(records: &[Value], columns: &mut Vec<(String, Vec<f64>)>) {
    let Some(Value::Object(first)) = records.first() else { return };
    for name in first.keys() {
        let values = records.iter().map(|record| number(record.get(name).unwrap_or(&Value::Null)));
        let numbers: Option<Vec<f64>> = values.collect();
        columns.extend(numbers.map(|numbers| (name.clone(), numbers)));
    }
}
