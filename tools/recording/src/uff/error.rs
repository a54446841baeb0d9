//! What can be wrong with a universal file.

use thiserror::Error;

use crate::error::some;

/// Why a universal file cannot be read. Lines count from 1.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum UffProblem {
    /// A field that holds something else than it should.
    #[error("line {line}: the {what} is `{found}`; write the file again, its fields are in fixed columns")]
    Field {
        /// Line of the file.
        line: u64,
        /// What stands there by the format's definition.
        what: &'static str,
        /// What was found, shortened.
        found: String,
    },
    /// The file ends too early.
    #[error("the file ends at line {line}, inside {what}; copy or export it again")]
    Ends {
        /// Last line of the file.
        line: u64,
        /// What was being read.
        what: &'static str,
    },
    /// A function with more or fewer values than its header says.
    #[error(
        "line {line}: {found} values, where the function's header announces {announced}; export the file again"
    )]
    Count {
        /// Line where the values begin.
        line: u64,
        /// Values announced.
        announced: u64,
        /// Values found.
        found: u64,
    },
    /// A binary representation that is not IEEE 754.
    #[error(
        "line {line}: values in floating-point format {code}, not IEEE 754 (2); export as data set 58, in text"
    )]
    FloatingPoint {
        /// Line of the data set's header.
        line: u64,
        /// Code of the representation: 1 DEC, 3 IBM.
        code: i64,
    },
    /// No data set 58 in the file.
    #[error(
        "there is no data set 58 in the file, only {}; export the time responses as data set 58",
        some(found)
    )]
    NoFunctions {
        /// Numbers of the data sets there are.
        found: Vec<String>,
    },
    /// Data sets 58, none of them over time.
    #[error(
        "none of the {} functions is a time response (type 1); they are {}; export the time data",
        kinds.len(), some(kinds)
    )]
    NoTimeResponse {
        /// Function types found.
        kinds: Vec<String>,
    },
    /// Functions with different time axes.
    #[error(
        "`{first}` and `{second}` do not have the same time axis; take those that do, with --column NAME_UNIT=NUMBER for each: {}",
        some(present)
    )]
    DifferentTimes {
        /// One function.
        first: String,
        /// The other.
        second: String,
        /// All time responses.
        present: Vec<String>,
    },
    /// A column that the format cannot hold.
    #[error(
        "column `{column}` has {missing} missing values, which data set 58 cannot hold; write CSV or JSON"
    )]
    MissingValues {
        /// The column.
        column: String,
        /// How many are missing.
        missing: usize,
    },
    /// Stamps that the format's seven digits cannot tell apart.
    #[error(
        "the uneven time stamps around {time_s} s need more digits than data set 58 has for them; write CSV or JSON, or resample"
    )]
    TimeDigits {
        /// A stamp that would be lost.
        time_s: f64,
    },
}
