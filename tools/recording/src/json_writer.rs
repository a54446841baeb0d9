//! JSON out.

use std::io::Write;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::error::{Problem, RecordingError};
use crate::recording::{Recording, Role, TIME_COLUMN};

/// Version of the JSON shape.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Document<'r> {
    schema_version: u32,
    role: Option<Role>,
    notes: &'r toml::Table,
    /// Values by name, the time among them; missing ones are `null`.
    columns: Map<String, Value>,
}

/// Writes a recording as one JSON object: `columns` maps every name to its values, `null` where one is
/// missing.
///
/// # Errors
/// [`Problem::Io`], or whatever [`Recording::check`] finds.
pub fn to_json(mut sink: impl Write, recording: &Recording) -> Result<(), RecordingError> {
    recording.check()?;
    let mut columns = Map::new();
    columns.insert(TIME_COLUMN.to_owned(), recording.time_s.clone().into());
    for column in &recording.columns {
        columns.insert(column.name.clone(), column.samples.clone().into());
    }
    let document =
        Document { schema_version: SCHEMA_VERSION, role: recording.role, notes: &recording.notes, columns };
    let failed = |error| recording.error(Problem::Io(error));
    serde_json::to_writer(&mut sink, &document).map_err(|error| failed(error.into()))?;
    sink.write_all(b"\n").and_then(|()| sink.flush()).map_err(failed)
}
