//! Tables that come from files: read, checked against their CRC, and turned back into what runs.

use std::path::Path;

use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::{Mode, ShaperTable, Tap};
use stillbeam_firmware::units::TickRate;

use crate::checksum::Crc32;
use crate::design::{SCHEMA_VERSION, ShaperDesign, StageEntry, design_table, runnable};
use crate::error::{ShapeError, TableFileError, TableProblem};
use crate::table_text::read_table;

impl ShaperDesign {
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
        let at_file = |problem| TableFileError { file: file.to_owned(), problem };
        let design: Self = serde_json::from_str(text).map_err(|error| at_file(TableProblem::Json(error)))?;
        if design.schema_version != SCHEMA_VERSION {
            return Err(at_file(TableProblem::SchemaVersion { found: design.schema_version }));
        }
        design.check().map_err(at_file)?;
        Ok(design)
    }

    /// Checks the stages and compares their CRC with the one written beside them.
    ///
    /// # Errors
    /// [`TableProblem::Stage`] or [`TableProblem::Checksum`].
    pub fn check(&self) -> Result<(), TableProblem> {
        for (number, stage) in (1..).zip(&self.stages) {
            check_stage(stage).map_err(|what| TableProblem::Stage { stage: number, what })?;
        }
        let computed = Crc32::of_stages(&self.stages);
        if computed != self.crc32 {
            return Err(TableProblem::Checksum { written: self.crc32, computed });
        }
        Ok(())
    }

    /// The modes that the stages were designed for; `None` when a stage is none of a single mode's textbook
    /// shaper, which a board could design itself.
    ///
    /// # Errors
    /// [`TableProblem::Design`] when one is no mode.
    pub fn modes(&self) -> Result<Option<Vec<Mode>>, TableProblem> {
        let modes = self.stages.iter().enumerate().map(|(index, stage)| {
            let (Some(frequency_hz), Some(damping_ratio), Some(shaper)) =
                (stage.frequency_hz, stage.damping_ratio, stage.shaper.textbook())
            else {
                return Ok(None);
            };
            let mode = Mode::new(frequency_hz, damping_ratio, shaper).map_err(|error| {
                let error = stillbeam_firmware::shaper::table::TableError::Mode { index, error };
                TableProblem::Design(ShapeError::Table(error))
            })?;
            Ok(Some(mode))
        });
        modes.collect()
    }

    /// The table that runs. Where all stages are textbook shapers it is designed again from the modes and
    /// compared with what the file says; other stages are taken as they are.
    ///
    /// # Errors
    /// [`TableProblem`]: a damaged file, modes that cannot be shaped, or taps that this version does not
    /// make.
    pub fn table(&self) -> Result<ShaperTable, TableProblem> {
        self.check()?;
        let Some(modes) = self.modes()? else { return self.table_of_taps() };
        let table = design_table(&modes, self.rate_hz).map_err(TableProblem::Design)?;
        let (written, designed) = (self.crc32, Crc32(table.crc32()));
        if designed != written {
            return Err(TableProblem::OtherDesign { written, designed });
        }
        Ok(table)
    }

    fn table_of_taps(&self) -> Result<ShaperTable, TableProblem> {
        let rate_hz = self.rate_hz;
        let rate = TickRate::from_hz(rate_hz).ok_or(TableProblem::Design(ShapeError::Rate { rate_hz }))?;
        let stages: Vec<Vec<Tap>> = self
            .stages
            .iter()
            .map(|stage| {
                let taps = stage.taps.iter();
                taps.map(|tap| Tap { delay_ticks: tap.delay_ticks, weight: tap.weight }).collect()
            })
            .collect();
        runnable(rate, &stages).map_err(TableProblem::Design)
    }
}

fn check_stage(stage: &StageEntry) -> Result<(), &'static str> {
    if stage.weight_one != WEIGHT_ONE {
        return Err("weight_one is not 1073741824");
    }
    if stage.taps.first().is_none_or(|tap| tap.delay_ticks != 0) {
        return Err("the first tap does not have a delay of 0");
    }
    let mut pairs = stage.taps.iter().zip(stage.taps.iter().skip(1));
    if !pairs.all(|(earlier, later)| earlier.delay_ticks < later.delay_ticks) {
        return Err("the delays do not increase");
    }
    let sum: i64 = stage.taps.iter().map(|tap| i64::from(tap.weight)).sum();
    if sum != i64::from(stage.weight_one) {
        return Err("the weights do not sum to weight_one");
    }
    Ok(())
}
