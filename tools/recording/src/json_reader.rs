//! JSON in: stillbeam's own, and objects of arrays of numbers.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::{Map, Value};

use crate::content::Content;
use crate::error::Problem;
use crate::options::ReadOptions;
use crate::recording::{Role, shorten};
use crate::table::{Heading, Table, assemble, decode, interval_of, seconds_after};

/// Reads an object whose members are arrays of numbers, an array of objects with numbers as members, or such
/// objects one behind the other (JSON lines).
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    let (text, _) = decode(bytes);
    let mut remarks = Vec::new();
    let document = document(&text, &mut remarks)?;
    let mut columns: Vec<Signal> = Vec::new();
    let interval_s = signals(&document, &mut columns, DEEPEST);
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

/// What stillbeam's own files say besides their columns; of others nothing is known.
#[derive(Default, Deserialize)]
pub(crate) struct About {
    #[serde(default)]
    pub(crate) role: Option<Role>,
    #[serde(default)]
    pub(crate) notes: toml::Table,
}

/// Reads what one of stillbeam's own files says besides its columns.
pub(crate) fn about(bytes: &[u8]) -> Result<About, Problem> {
    #[derive(Deserialize)]
    struct Mark {
        schema_version: Option<IgnoredAny>,
        columns: Option<IgnoredAny>,
    }
    let (text, _) = decode(bytes);
    match serde_json::from_str(&text) {
        Ok(Mark { schema_version: Some(_), columns: Some(_) }) => serde_json::from_str(&text)
            .map_err(|error| Problem::Json { line: error.line(), reason: error.to_string() }),
        _ => Ok(About::default()),
    }
}

/// Levels of objects that signals are looked for in.
const DEEPEST: usize = 3;

/// Adds the signals of a document, and gives the interval that it states: they lie at the top, in a member as
/// in stillbeam's own files, or deeper where some program packed them with what it says about them.
fn signals(document: &Value, columns: &mut Vec<Signal>, levels: usize) -> Option<f64> {
    let members = match document {
        Value::Array(records) => {
            from_records(records, columns);
            return None;
        }
        Value::Object(members) => members,
        _ => return None,
    };
    match members.get("columns").or_else(|| members.get("data")).unwrap_or(document) {
        Value::Object(members) => from_members(members, columns),
        Value::Array(records) => from_records(records, columns),
        _ => {}
    }
    if columns.is_empty() {
        from_rows(members, columns);
    }
    let own = members.iter().find_map(|(name, value)| interval_of(name, value.as_f64()?));
    if !columns.is_empty() || levels == 0 {
        return own;
    }
    let deeper = members.values().filter(|member| member.is_object()).find_map(|member| {
        let stated = signals(member, columns, levels - 1);
        (!columns.is_empty()).then_some(stated)
    });
    deeper.flatten().or(own)
}

/// Rows of numbers (`"values": [[1, 2], [3, 4]]`), their names in an array beside them (`"sensors": [{"name":
/// "x"}, ...]`) or none.
fn from_rows(members: &Map<String, Value>, columns: &mut Vec<Signal>) {
    let rows = members.values().find_map(|member| {
        let rows: Vec<&Vec<Value>> = member.as_array()?.iter().map(Value::as_array).collect::<Option<_>>()?;
        let width = rows.first()?.len();
        (width > 0 && rows.iter().all(|row| row.len() == width)).then_some((rows, width))
    });
    let Some((rows, width)) = rows else { return };
    let names: Option<Vec<String>> = members.values().find_map(|member| {
        let names = member.as_array().filter(|names| names.len() == width)?;
        names.iter().map(name_of).collect()
    });
    for at in 0..width {
        let values: Vec<Value> = rows.iter().filter_map(|row| row.get(at).cloned()).collect();
        let name = names.as_ref().and_then(|names| names.get(at)).cloned();
        columns.extend(signal(name.unwrap_or_else(|| format!("column_{}", at + 1)), &values));
    }
}

/// What a description of a signal calls it, with its unit.
fn name_of(description: &Value) -> Option<String> {
    if let Some(name) = description.as_str() {
        return Some(name.to_owned());
    }
    let text = |keys: [&str; 2]| keys.iter().find_map(|key| description.get(key)?.as_str());
    let name = text(["name", "label"])?;
    Some(match text(["units", "unit"]) {
        Some(unit) => format!("{name} [{unit}]"),
        None => name.to_owned(),
    })
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
    if let Some(text) = of_python(text)
        && let Ok(records) = serde_json::Deserializer::from_str(&text).into_iter::<Value>().collect()
    {
        remarks.push("read as what Python prints, line by line".to_owned());
        return Ok(Value::Array(records));
    }
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

/// Objects as Python prints them (`{'t': 0.1, 'ax': None}`), as JSON; `None` for other text.
fn of_python(text: &str) -> Option<String> {
    let begins = text.trim_start().trim_start_matches('[').trim_start().strip_prefix('{')?;
    begins.trim_start().starts_with('\'').then(|| {
        let words = [("None", "null"), ("True", "true"), ("False", "false"), ("nan", "null")];
        let words = words.iter().flat_map(|(python, json)| {
            [(format!(": {python},"), format!(": {json},")), (format!(": {python}}}"), format!(": {json}}}"))]
        });
        words.fold(text.replace('\'', "\""), |text, (python, json)| text.replace(&python, &json))
    })
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
