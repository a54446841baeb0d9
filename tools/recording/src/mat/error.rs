//! What can be wrong with a MAT-file.

use thiserror::Error;

use crate::error::some;

/// Why a MATLAB file cannot be read. Offsets count bytes from the start of the file or, within a compressed
/// variable, of its contents.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MatProblem {
    /// The file ends too early, or a length in it is wrong.
    #[error("byte {offset}: {what} goes beyond the end of {container}; copy or save the file again")]
    Ends {
        /// Where it begins.
        offset: usize,
        /// What was being read.
        what: &'static str,
        /// The file, or a compressed variable.
        container: &'static str,
    },
    /// Something else stands where the format has a certain element.
    #[error("byte {offset}: the {what} is {found}; save the file again, with -v7 or -v6")]
    Element {
        /// Where it begins.
        offset: usize,
        /// What it should be.
        what: &'static str,
        /// What was found.
        found: String,
    },
    /// A compressed variable that cannot be uncompressed.
    #[error("byte {offset}: the compressed variable is damaged ({reason}); copy or save the file again")]
    Compressed {
        /// Where it begins.
        offset: usize,
        /// What the decompressor said.
        reason: String,
    },
    /// More content than is taken into memory.
    #[error(
        "the file's contents are larger than {limit_mib} MiB; save the time and the measured signals alone"
    )]
    TooLarge {
        /// The limit, MiB.
        limit_mib: usize,
    },
    /// Structures within structures without end.
    #[error("byte {offset}: structures lie more than {limit} deep; save the signals as plain variables")]
    TooDeep {
        /// Where the innermost begins.
        offset: usize,
        /// The limit.
        limit: usize,
    },
    /// Another format where matrices are wanted.
    #[error(
        "the file is in the format {looks_like}; save the matrices with -v7 in MATLAB or scipy.io.savemat"
    )]
    NotMat {
        /// The format found.
        looks_like: String,
    },
    /// Nothing says when the samples were taken.
    #[error(
        "no variable is called time_s, interval_s or rate_hz; say where the time is, with --time VARIABLE or --sample-rate HZ; \
         the file holds {}",
        some(present)
    )]
    NoTime {
        /// The variables there are.
        present: Vec<String>,
    },
    /// The variable that holds the time does not.
    #[error(
        "`{variable}` is {found}, not {wanted}; name another with --time; the file holds {}",
        some(present)
    )]
    BadTime {
        /// The variable.
        variable: String,
        /// What it is.
        found: String,
        /// What it would have to be.
        wanted: &'static str,
        /// The variables there are.
        present: Vec<String>,
    },
}
