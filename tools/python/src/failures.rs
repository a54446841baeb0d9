//! Failures as exceptions, in the words of the commands.

use pyo3::PyErr;
use pyo3::exceptions::PyException;
use stillbeam::error::CliError;

pyo3::create_exception!(
    stillbeam,
    StillbeamError,
    PyException,
    "Something that stillbeam could not do; the message says what, where, and the remedy."
);
pyo3::create_exception!(
    stillbeam,
    InputError,
    StillbeamError,
    "A file, an argument or a board that cannot be used as it is; the remedy is the caller's."
);
pyo3::create_exception!(
    stillbeam,
    InternalError,
    StillbeamError,
    "A failure that is not the caller's: a line that broke, or a fault of stillbeam itself."
);

/// The exit status of a command that was given something unusable.
const BAD_INPUT: u8 = 2;

/// The exception for a failure.
pub fn exception(error: impl Into<CliError>) -> PyErr {
    let error = error.into();
    let words = error.to_string();
    if error.exit_code() == BAD_INPUT { InputError::new_err(words) } else { InternalError::new_err(words) }
}

/// The exception for an argument that is none of those there are.
pub fn unusable(words: impl Into<String>) -> PyErr {
    exception(CliError::Usage(words.into()))
}
