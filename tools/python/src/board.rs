//! A board, talked to on a thread of its own, so that Ctrl-C stops the machine whatever the interpreter does.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Sender};
use std::time::Duration;

use pyo3::{PyErr, PyResult, Python, pyclass, pymethods};
use stillbeam::board::{BoardTarget, Session};
use stillbeam::board_recording::{lost_samples, recording, usual_decimation};
use stillbeam::error::CliError;
use stillbeam_shape::BoardTable;

use crate::failures::{InputError, exception, unusable};
use crate::recordings::{TakenRecording, taken};
use crate::work;

/// Something to do with the board.
type Job = Box<dyn FnOnce(&mut Session) + Send>;

/// The longest time that a motion is waited for.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

/// The board behind a port; `stillbeam.Board` documents it.
#[pyclass(frozen, module = "stillbeam._stillbeam")]
pub struct Board {
    target: BoardTarget,
    /// `None` once it was closed.
    jobs: std::sync::Mutex<Option<Sender<Job>>>,
    /// Set to stop the machine.
    stop: Arc<AtomicBool>,
}

impl Board {
    /// Lets the board's thread do something and waits for it. Ctrl-C stops the machine first.
    fn run<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Session) -> Result<T, CliError> + Send + 'static,
    ) -> PyResult<T> {
        let (send, answer) = mpsc::channel();
        let job: Job = Box::new(move |session| {
            // Nobody listens after Ctrl-C.
            let _nobody = send.send(work(session));
        });
        if !self.send(job) {
            return Err(closed(&self.target));
        }
        work::wait(py, answer, || self.stop_now())?.map_err(exception)
    }

    /// Whether the board's thread is there to do it.
    fn send(&self, job: Job) -> bool {
        self.jobs.lock().is_ok_and(|jobs| jobs.as_ref().is_some_and(|jobs| jobs.send(job).is_ok()))
    }

    /// Stops the machine: at once where something is being done, which ends with it; and again after that,
    /// for it may just have been done.
    fn stop_now(&self) {
        self.stop.store(true, Ordering::SeqCst);
        let asked = Arc::clone(&self.stop);
        self.send(Box::new(move |session| {
            // Where nothing was being done nobody has looked, and the next job is not meant.
            asked.store(false, Ordering::SeqCst);
            // There is nobody to tell.
            let _nobody = session.command("stop");
        }));
    }
}

fn closed(target: &BoardTarget) -> PyErr {
    InputError::new_err(format!("the line to {} was closed; make a new Board", target.name()))
}

#[pymethods]
impl Board {
    #[new]
    fn new(py: Python<'_>, port: &str) -> PyResult<Self> {
        let target = BoardTarget::parse(port);
        let stop = Arc::new(AtomicBool::new(false));
        let (jobs, to_do) = mpsc::channel::<Job>();
        let (send, answer) = mpsc::channel();
        let (opened, asked) = (target.clone(), Arc::clone(&stop));
        std::thread::spawn(move || {
            let session = opened.open(&mut |_| {}).and_then(|link| Session::start_stopped_by(link, asked));
            match session {
                Ok(mut session) => {
                    let _nobody = send.send(Ok(()));
                    to_do.into_iter().for_each(|job| job(&mut session));
                }
                Err(error) => {
                    let _nobody = send.send(Err(error));
                }
            }
        });
        work::wait(py, answer, || stop.store(true, Ordering::SeqCst))?.map_err(exception)?;
        Ok(Self { target, jobs: std::sync::Mutex::new(Some(jobs)), stop })
    }

    /// Whether something real moves.
    fn is_real(&self) -> bool {
        matches!(self.target, BoardTarget::Port(_))
    }

    /// The lines of a reply, and its last line.
    fn command(&self, py: Python<'_>, line: &str) -> PyResult<(Vec<String>, String)> {
        if line.trim().is_empty() || line.contains(char::is_control) || !line.is_ascii() {
            return Err(unusable(format!("command {line:?}: give one line of ASCII text")));
        }
        let line = line.trim().to_owned();
        self.run(py, move |session| {
            let reply = session.command(&line)?;
            Ok((reply.lines, reply.ok_line))
        })
    }

    /// The drive's state.
    fn drive_state(&self, py: Python<'_>) -> PyResult<String> {
        self.run(py, |session| Ok(session.drive_state()?))
    }

    /// Lets the drive run.
    fn enable(&self, py: Python<'_>) -> PyResult<()> {
        let is_real = self.is_real();
        self.run(py, move |session| {
            let enabled = if is_real { session.enable_drive() } else { session.enable_virtual_drive() };
            Ok(enabled?)
        })
    }

    /// Brings the setpoint to rest and switches the drive off.
    fn disable(&self, py: Python<'_>) -> PyResult<()> {
        self.run(py, |session| Ok(session.disable_drive()?))
    }

    /// Waits until nothing moves; the position in nanometres.
    fn wait(&self, py: Python<'_>) -> PyResult<i32> {
        self.run(py, |session| Ok(session.wait_for_rest(LONGEST_WAIT)?))
    }

    /// Sends a table and lets it run; its CRC-32.
    fn upload(&self, py: Python<'_>, table: &str, save: bool) -> PyResult<String> {
        let table = table.to_owned();
        self.run(py, move |session| {
            let table = BoardTable::from_json("shaper", &table)?;
            let crc32 = session.upload_table(&table)?;
            if save {
                session.command_when_ready("save")?;
            }
            Ok(crc32.to_string())
        })
    }

    /// Runs a motion and takes what the board streams; how many samples were lost, and the faults.
    fn record<'py>(
        &self,
        py: Python<'py>,
        motion: &str,
        decimation: Option<u32>,
        after_s: f64,
    ) -> PyResult<(TakenRecording<'py>, u64, Vec<String>)> {
        if decimation == Some(0) || !(0.0..=3600.0).contains(&after_s) {
            return Err(unusable("decimation is at least 1, and after_s from 0 to 3600 seconds"));
        }
        let motion = motion.to_owned();
        let (recording, lost, faults) = self.run(py, move |session| {
            let tick_hz = session.tick_hz()?;
            let decimation = decimation.unwrap_or_else(|| usual_decimation(tick_hz));
            let streamed = session.record_motion(&motion, decimation, after_s, &mut |_| {})?;
            let lost = lost_samples(&streamed);
            Ok((recording(&motion, &motion, &streamed), lost, streamed.faults))
        })?;
        Ok((taken(py, recording), lost, faults))
    }

    /// Stops the machine without waiting for it.
    fn interrupt(&self) {
        self.stop_now();
    }

    /// Ends the conversation; the drive is left as it is.
    fn close(&self) {
        if let Ok(mut jobs) = self.jobs.lock() {
            *jobs = None;
        }
    }
}
