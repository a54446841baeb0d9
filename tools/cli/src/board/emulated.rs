//! The firmware image on an emulated board, reached through the emulator's serial port.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use super::serial::SerialBoard;
use super::{BoardError, ByteLink};
use crate::workspace;

/// Names an image to run instead of building one.
pub const IMAGE_VARIABLE: &str = "STILLBEAM_IMAGE";

/// How long the emulator may take to boot, its own build included.
const BOOT_PATIENCE: Duration = Duration::from_secs(300);

/// The emulator.
const PROGRAM: &str = "qemu-system-arm";

const REMEDY: &str = "run `cargo xtask setup`, then `cargo xtask emulate` to see what it says";

/// An emulated board. It ends with this value.
pub struct EmulatedBoard {
    // In this order: the port is closed before the emulator goes.
    port: SerialBoard,
    _emulator: EmulatorProcess,
}

impl EmulatedBoard {
    /// Builds the image (unless [`IMAGE_VARIABLE`] names one), boots it and opens its serial port. `say` is
    /// told what takes long.
    ///
    /// # Errors
    /// [`BoardError::Emulator`] when the image cannot be built or booted; [`BoardError::Open`].
    pub fn start(say: &mut dyn FnMut(&str)) -> Result<Self, BoardError> {
        let root = workspace::root()
            .ok_or_else(|| failed("the source tree was not found; run this from within it".to_owned()))?;
        emulator_is_installed(std::env::var_os("PATH"))?;
        let image = match std::env::var_os(IMAGE_VARIABLE) {
            Some(image) => PathBuf::from(image),
            None => {
                say("building the firmware image");
                build_image(&root)?
            }
        };
        if !image.is_file() {
            return Err(failed(format!("there is no image {}", image.display())));
        }
        say("booting the image on the emulated board");
        let (emulator, path) = EmulatorProcess::boot(&root, &image)?;
        Ok(Self { port: SerialBoard::open(&path)?, _emulator: emulator })
    }
}

impl ByteLink for EmulatedBoard {
    fn name(&self) -> &str {
        "emulated board"
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.port.write_all(bytes)
    }

    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> std::io::Result<usize> {
        self.port.read(buffer, patience)
    }

    fn clock(&self) -> Duration {
        self.port.clock()
    }

    fn pause(&mut self, duration: Duration) {
        self.port.pause(duration);
    }
}

/// Refuses where the emulator is not on the search path: an image for it takes a minute to build.
fn emulator_is_installed(search_path: Option<std::ffi::OsString>) -> Result<(), BoardError> {
    let found = search_path
        .is_some_and(|folders| std::env::split_paths(&folders).any(|folder| folder.join(PROGRAM).is_file()));
    if found {
        return Ok(());
    }
    Err(failed(format!("`{PROGRAM}` is not installed (QEMU 10 or newer for ARM); `--port core` needs none")))
}

/// Builds the release image and returns its path.
///
/// # Errors
/// [`BoardError::Emulator`] when the chore fails; it says why on standard error itself.
pub fn build_image(root: &Path) -> Result<PathBuf, BoardError> {
    let output = cargo(root)
        .args(["run", "--quiet", "--package", "xtask", "--", "firmware"])
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| failed(format!("cargo did not run: {error}")))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let path = text.lines().last().map(str::trim).filter(|path| !path.is_empty());
    match path {
        Some(path) if output.status.success() => Ok(PathBuf::from(path)),
        _ => Err(failed(format!("`cargo xtask firmware` failed ({})", output.status))),
    }
}

/// The process that runs the emulator; it ends when its standard input closes.
struct EmulatorProcess {
    child: Child,
    input: Option<ChildStdin>,
}

impl EmulatorProcess {
    fn boot(root: &Path, image: &Path) -> Result<(Self, String), BoardError> {
        let mut child = cargo(root)
            .args([
                "run",
                "--quiet",
                "--package",
                "stillbeam-host-tests",
                "--bin",
                "stillbeam-emulator",
                "--",
            ])
            .arg(image)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .map_err(|error| failed(format!("cargo did not run: {error}")))?;
        let output = child.stdout.take();
        let emulator = Self { input: child.stdin.take(), child };
        let (send, receive) = mpsc::channel();
        // A pipe cannot be read with a time limit, so a thread waits for the line; it ends with the pipe.
        std::thread::spawn(move || {
            let lines = output.into_iter().flat_map(|output| BufReader::new(output).lines());
            let path = lines
                .map_while(Result::ok)
                .find_map(|line| line.strip_prefix("serial ").map(|path| path.trim().to_owned()));
            // The other side may have given up.
            let _received = send.send(path);
        });
        match receive.recv_timeout(BOOT_PATIENCE) {
            Ok(Some(path)) => Ok((emulator, path)),
            Ok(None) => Err(failed("the emulator ended before its serial port was ready".to_owned())),
            Err(_) => Err(failed(format!("no serial port after {} s", BOOT_PATIENCE.as_secs()))),
        }
    }
}

impl Drop for EmulatorProcess {
    fn drop(&mut self) {
        // Closing the input asks it to end, and `cargo run` ends with it.
        drop(self.input.take());
        for _ in 0..100 {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        // It did not listen. Failing here means that it is gone.
        let _gone = self.child.kill();
        let _reaped = self.child.wait();
    }
}

/// The cargo that built this program, or the one on the search path, working in the source tree.
fn cargo(root: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}

fn failed(reason: String) -> BoardError {
    BoardError::Emulator { reason, remedy: REMEDY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_emulator_that_is_missing_is_told_before_anything_is_built() {
        let folder = std::env::temp_dir().join(format!("stillbeam-no-emulator-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let refused = emulator_is_installed(Some(folder.clone().into_os_string())).unwrap_err().to_string();
        assert!(refused.contains("qemu-system-arm") && refused.contains("--port core"), "{refused}");
        assert!(emulator_is_installed(None).is_err());
        std::fs::write(folder.join(PROGRAM), "").unwrap();
        assert!(emulator_is_installed(Some(folder.clone().into_os_string())).is_ok());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
