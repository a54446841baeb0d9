//! What a reader finds in a file.

use crate::recording::Column;
use crate::spectrum::Spectrum;

/// Signals over time, or functions of frequency; and remarks on what a user should know about how they were
/// read.
pub(crate) struct Content {
    pub(crate) signals: Signals,
    pub(crate) remarks: Vec<String>,
}

pub(crate) enum Signals {
    /// Time stamps in seconds and columns.
    OverTime(Vec<f64>, Vec<Column>),
    /// Functions of frequency, at least one.
    Spectra(Vec<Spectrum>),
}

impl From<crate::csv_reader::Parsed> for Content {
    fn from((time_s, columns, remarks): crate::csv_reader::Parsed) -> Self {
        Self { signals: Signals::OverTime(time_s, columns), remarks }
    }
}
