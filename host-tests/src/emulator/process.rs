//! The emulator's process: it never outlives its owner, and what it prints is kept for messages.

use std::fs::File;
use std::io::PipeWriter;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread::JoinHandle;

use super::error::EmulatorError;

/// A running emulator; dropping it kills the emulator.
#[derive(Debug)]
pub(super) struct QemuProcess {
    child: Child,
    output: PathBuf,
    /// Dropped to let the supervising thread end.
    release: Option<mpsc::Sender<()>>,
    supervisor: Option<JoinHandle<()>>,
}

impl QemuProcess {
    /// Starts `program` with its output going to the file `output`, or to `errors` what it says on its
    /// standard error.
    ///
    /// Where the system has `setpriv`, the kernel kills the emulator when the thread that started it ends,
    /// even if this process is killed without a chance to clean up: an orphan would keep a core busy for
    /// ever. That thread therefore does nothing else and lives as long as `Self`, whichever threads the owner
    /// is handed between.
    pub(super) fn start(
        program: &Path,
        arguments: &[String],
        output: &Path,
        errors: Option<PipeWriter>,
    ) -> Result<Self, EmulatorError> {
        let failed = |source| EmulatorError::system(format!("starting {program:?}"), source);
        let log = File::create(output).map_err(failed)?;
        let errors = match errors {
            Some(pipe) => Stdio::from(pipe),
            None => Stdio::from(log.try_clone().map_err(failed)?),
        };
        let mut command = if has_setpriv() {
            let mut wrapped = Command::new("setpriv");
            wrapped.arg("--pdeathsig=KILL").arg(program);
            wrapped
        } else {
            Command::new(program)
        };
        command.args(arguments).stdin(Stdio::null()).stdout(log).stderr(errors);
        let (report, started) = mpsc::channel();
        let (release, released) = mpsc::channel::<()>();
        let supervisor = std::thread::Builder::new()
            .name("emulator supervisor".to_owned())
            .spawn(move || {
                if report.send(command.spawn()).is_ok() {
                    // Nothing is ever sent: this waits until the owner drops its end.
                    let _ = released.recv();
                }
            })
            .map_err(failed)?;
        let child = started
            .recv()
            .map_err(|_| failed(std::io::Error::other("the supervising thread ended")))?
            .map_err(failed)?;
        Ok(Self { child, output: output.to_owned(), release: Some(release), supervisor: Some(supervisor) })
    }

    /// Exit status, if the emulator has ended by itself.
    pub(super) fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().ok().flatten()
    }

    /// What the emulator has printed so far.
    pub(super) fn output(&self) -> String {
        std::fs::read(&self.output).map_or_else(
            |error| format!("(unreadable: {error})"),
            |bytes| String::from_utf8_lossy(&bytes).trim().to_owned(),
        )
    }

    /// Process number, for messages and measurements.
    pub(super) fn id(&self) -> u32 {
        self.child.id()
    }
}

impl Drop for QemuProcess {
    fn drop(&mut self) {
        // Both fail only where the process is gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
        drop(self.release.take());
        if let Some(supervisor) = self.supervisor.take() {
            let _ = supervisor.join();
        }
    }
}

fn has_setpriv() -> bool {
    Command::new("setpriv")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_is_kept_and_the_end_is_noticed() {
        let directory = tempfile::tempdir().expect("temporary directory");
        let arguments = ["-c", "echo out; echo err >&2; exit 3"].map(str::to_owned);
        let log = directory.path().join("log");
        let mut process = QemuProcess::start(Path::new("sh"), &arguments, &log, None).expect("a shell");
        let status = (0..500).find_map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(10));
            process.ended()
        });
        assert_eq!(status.and_then(|status| status.code()), Some(3));
        assert_eq!(process.output(), "out\nerr");
    }

    #[test]
    fn dropping_ends_the_process_from_any_thread() {
        let directory = tempfile::tempdir().expect("temporary directory");
        let log = directory.path().join("log");
        let start = move || QemuProcess::start(Path::new("sleep"), &["60".to_owned()], &log, None);
        let mut process = std::thread::spawn(start).join().expect("no panic").expect("sleep");
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(process.ended().is_none(), "outlives the thread that asked for it");
        let entry = PathBuf::from(format!("/proc/{}", process.id()));
        drop(process);
        assert!(!entry.exists());
    }
}
