//! Work that takes a while: without the interpreter's lock, and such that Ctrl-C is seen meanwhile.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

use pyo3::{PyErr, PyResult, Python};
use stillbeam::error::CliError;
use stillbeam::streams::Streams;

use crate::failures::{InternalError, exception};

/// How soon Ctrl-C is noticed.
const NOTICE: Duration = Duration::from_millis(50);

/// What was done, with the messages that a command would have printed meanwhile.
pub struct Done<T> {
    /// The result.
    pub result: T,
    /// One line each.
    pub messages: Vec<String>,
}

/// Does `work` on another thread. After Ctrl-C the interpreter goes on at once, and what the thread comes to
/// is thrown away.
///
/// # Errors
/// The failure of `work`, or what Ctrl-C raised.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&mut Streams<'_>) -> Result<T, CliError> + Send + 'static,
) -> PyResult<Done<T>> {
    let (send, answer) = mpsc::channel();
    std::thread::spawn(move || {
        let (mut out, mut said) = (Vec::new(), Vec::new());
        let result = work(&mut Streams { out: &mut out, messages: &mut said });
        let messages = String::from_utf8_lossy(&said).lines().map(str::to_owned).collect();
        // Nobody listens after Ctrl-C.
        let _nobody = send.send(result.map(|result| Done { result, messages }));
    });
    wait(py, answer, || {})?.map_err(exception)
}

/// Waits for an answer; `stop` is called once if Ctrl-C comes first.
///
/// # Errors
/// What Ctrl-C raised; [`InternalError`] where whoever should answer is gone.
pub fn wait<T: Send>(py: Python<'_>, mut answer: Receiver<T>, stop: impl FnOnce()) -> PyResult<T> {
    loop {
        let waited;
        (answer, waited) = py.detach(move || {
            let waited = answer.recv_timeout(NOTICE);
            (answer, waited)
        });
        match waited {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(gone()),
        }
        if let Err(raised) = py.check_signals() {
            stop();
            return Err(raised);
        }
    }
}

/// The thread that should have answered ended without.
pub fn gone() -> PyErr {
    InternalError::new_err("internal failure: the work ended without a result; please report it")
}
