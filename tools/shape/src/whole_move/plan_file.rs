//! A plan in a file: what `stillbeam plan --json` writes of it and `stillbeam upload` reads.

use std::path::Path;

use serde::{Deserialize, Serialize};
use stillbeam_firmware::motion::{Piece, PlanOutline};
use stillbeam_firmware::units::TickRate;

use super::board_plan::BoardPlan;
use crate::checksum::Crc32;
use crate::design::SCHEMA_VERSION;
use crate::error::{TableFileError, TableProblem};
use crate::table_text::read_table;

/// A plan as it stands in a file: ticks and jerk of each piece, the jerk in 2⁻³⁸ nm per tick³.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct PlanEntry {
    rate_hz: f64,
    crc32: Crc32,
    pieces: Vec<(u32, i64)>,
}

#[derive(Deserialize)]
struct File {
    schema_version: u32,
    plan: Option<PlanEntry>,
}

impl BoardPlan {
    /// What is written of it.
    pub fn entry(&self) -> PlanEntry {
        let pieces = self.pieces.iter().map(|piece| (piece.ticks, piece.jerk)).collect();
        PlanEntry { rate_hz: self.rate_hz, crc32: self.crc32(), pieces }
    }

    /// Reads and checks the plan in a file of `stillbeam plan --json`; `None` where the file has none.
    ///
    /// # Errors
    /// [`TableFileError`] names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Option<Self>, TableFileError> {
        read_table(path, |file, text| {
            parse(text).map_err(|problem| TableFileError { file: file.to_owned(), problem })
        })
    }
}

fn parse(text: &str) -> Result<Option<BoardPlan>, TableProblem> {
    // What is no such file at all is for the reader of tables to refuse.
    let Ok(File { schema_version, plan: Some(entry) }) = serde_json::from_str(text) else { return Ok(None) };
    if schema_version != SCHEMA_VERSION {
        return Err(TableProblem::SchemaVersion { found: schema_version });
    }
    let rate_hz = entry.rate_hz;
    let rate = TickRate::from_hz(rate_hz).ok_or(TableProblem::Design(crate::ShapeError::Rate { rate_hz }))?;
    let pieces = entry.pieces.into_iter().map(|(ticks, jerk)| Piece { ticks, jerk }).collect();
    let plan = BoardPlan { rate_hz, pieces };
    let (written, computed) = (entry.crc32, plan.crc32());
    if written != computed {
        return Err(TableProblem::Checksum { written, computed });
    }
    PlanOutline::of(rate, &plan.bytes()).map_err(TableProblem::Plan)?;
    Ok(Some(plan))
}
