//! From identified modes to the recommended shaper.

use stillbeam_identify::ModesFile;

use super::between_recordings::{Movement, movements, not_in_all};
use super::doubts::doubts;
use super::error::TuningError;
use super::recommendation::Recommendation;
use super::request::TuningRequest;
use super::usable_modes::UsableModes;
use crate::error::CliError;
use crate::identification::from_recordings::Identified;
use crate::identification::vibration_share::vibration_share;
use crate::shaping::candidates;

/// The recommended shaper and all that speaks for and against it.
pub struct Tuning {
    /// What was asked for.
    pub request: TuningRequest,
    /// How many recordings there were.
    pub recordings: usize,
    /// The modes that are shaped for, and those that are not.
    pub modes: UsableModes,
    /// How far each of them moved between the recordings that show it.
    pub movements: Vec<Movement>,
    /// The shaper.
    pub recommendation: Recommendation,
    /// What the identification warns of, one sentence each.
    pub doubts: Vec<String>,
}

impl Tuning {
    /// Recommends a shaper for what was identified; `filed` are the same modes as their file has them.
    ///
    /// # Errors
    /// [`CliError`]: no mode to shape for, or no shaper that is robust enough.
    pub fn new(identified: &Identified, filed: &ModesFile, request: TuningRequest) -> Result<Self, CliError> {
        let combined = identified.combined();
        let results = &identified.results;
        let output = results.first().map(|result| result.output.as_str()).unwrap_or_default();
        let shares: Vec<f64> = combined.modes.iter().map(|mode| vibration_share(mode, output)).collect();
        let mut modes = UsableModes::of(&filed.modes, &shares, &request)?;
        modes.left_out.extend(not_in_all(&combined.modes, results));
        if modes.modes.is_empty() {
            return Err(TuningError::no_usable_mode(&modes.left_out).into());
        }
        let boxes = modes.boxes();
        let found = candidates(&boxes, request.rate_hz, request.tolerance);
        let recommendation = Recommendation::among(found, request.tolerance, request.rate_hz)?;
        let numbers: Vec<usize> = modes.modes.iter().map(|mode| mode.number).collect();
        Ok(Self {
            recordings: results.len(),
            movements: movements(&numbers, &combined.modes, results),
            doubts: doubts(&modes, results),
            modes,
            recommendation,
            request,
        })
    }

    /// The movement of a mode, by its number; nothing where fewer than two recordings show it.
    pub fn movement(&self, number: usize) -> Option<&Movement> {
        self.movements.iter().find(|movement| movement.number == number)
    }
}
