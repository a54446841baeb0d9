//! A table file as far as the board needs it: the taps, whoever designed them.

use std::path::Path;

use serde::Deserialize;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::{ShaperTable, Tap};
use stillbeam_firmware::units::TickRate;

use crate::checksum::Crc32;
use crate::design::{SCHEMA_VERSION, TapEntry};
use crate::error::{TableFileError, TableProblem};
use crate::table_text::read_table;

/// A table to be uploaded. Files of `stillbeam shape --json` have more in them, which is passed over; a flat
/// table has one stage with all its taps, negative weights included.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardTable {
    /// Ticks per second that it is for, as the file says; the board's timer may be a little off.
    pub rate_hz: f64,
    /// What runs.
    pub table: ShaperTable,
}

#[derive(Deserialize)]
struct File {
    schema_version: u32,
    rate_hz: f64,
    crc32: Crc32,
    stages: Vec<FileStage>,
}

#[derive(Deserialize)]
struct FileStage {
    weight_one: i32,
    taps: Vec<TapEntry>,
}

impl BoardTable {
    /// Reads and checks a table file.
    ///
    /// # Errors
    /// [`TableFileError`] names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, TableFileError> {
        read_table(path, Self::from_json)
    }

    /// Reads and checks the text of a table; `file` is what messages call it.
    ///
    /// # Errors
    /// [`TableFileError`].
    pub fn from_json(file: &str, text: &str) -> Result<Self, TableFileError> {
        parse(text).map_err(|problem| TableFileError { file: file.to_owned(), problem })
    }

    /// The bytes that the board takes.
    pub fn bytes(&self) -> Vec<u8> {
        self.table.words().flatten().collect()
    }

    /// Their CRC, the one in the file.
    pub fn crc32(&self) -> Crc32 {
        Crc32(self.table.crc32())
    }
}

fn parse(text: &str) -> Result<BoardTable, TableProblem> {
    let file: File = serde_json::from_str(text).map_err(TableProblem::Json)?;
    if file.schema_version != SCHEMA_VERSION {
        return Err(TableProblem::SchemaVersion { found: file.schema_version });
    }
    let rate_hz = file.rate_hz;
    let tick_rate =
        TickRate::from_hz(rate_hz).ok_or(TableProblem::Design(crate::ShapeError::Rate { rate_hz }))?;
    let other_scale = file.stages.iter().position(|stage| stage.weight_one != WEIGHT_ONE);
    if let Some(place) = other_scale {
        return Err(TableProblem::Stage { stage: place + 1, what: "weight_one is not 1073741824" });
    }
    let stages: Vec<Vec<Tap>> = file
        .stages
        .iter()
        .map(|stage| {
            let taps = stage.taps.iter();
            taps.map(|tap| Tap { delay_ticks: tap.delay_ticks, weight: tap.weight }).collect()
        })
        .collect();
    let table =
        ShaperTable::from_stages(tick_rate, stages.iter().map(Vec::as_slice)).map_err(TableProblem::Taps)?;
    let (written, computed) = (file.crc32, Crc32(table.crc32()));
    if written != computed {
        return Err(TableProblem::Checksum { written, computed });
    }
    Ok(BoardTable { rate_hz, table })
}
