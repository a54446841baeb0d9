//! `--tolerance`: how much vibration may be left.

use clap::Args;

use crate::error::CliError;

/// The most vibration that a mode may keep.
#[derive(Clone, Debug, Args)]
pub struct Tolerance {
    /// The most vibration that a mode may keep anywhere in its box, as a fraction of the unshaped command's
    #[arg(long, value_name = "FRACTION", default_value_t = 0.05, allow_negative_numbers = true)]
    tolerance: f64,
}

impl Tolerance {
    /// A fraction above 0 and below 1.
    ///
    /// # Errors
    /// [`CliError::Usage`] for any other.
    pub fn fraction(&self) -> Result<f64, CliError> {
        if self.tolerance > 0.0 && self.tolerance < 1.0 {
            return Ok(self.tolerance);
        }
        Err(CliError::Usage(format!("--tolerance {}: give a fraction above 0 and below 1", self.tolerance)))
    }
}
