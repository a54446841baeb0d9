//! Running programs.

use std::io::Write;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::failure::Failure;

/// Announces a step on standard error.
pub fn say(message: impl AsRef<str>) {
    eprintln!("xtask: {}", message.as_ref());
}

/// The command line, for messages.
pub fn describe(command: &Command) -> String {
    let words: Vec<_> = std::iter::once(command.get_program())
        .chain(command.get_args())
        .map(|word| word.to_string_lossy())
        .collect();
    words.join(" ")
}

/// Runs a command to its end, its output shown.
pub fn run(command: &mut Command) -> Result<(), Failure> {
    let mut child = start(command)?;
    let status = child.wait().map_err(|source| cannot_start(command, source))?;
    succeeded(command, status)
}

/// Runs a command, its output shown, and ends it when it takes longer than `limit`.
pub fn run_within(command: &mut Command, limit: Duration) -> Result<(), Failure> {
    let mut child = start(command)?;
    let deadline = Instant::now() + limit;
    loop {
        if let Some(status) = child.try_wait().map_err(|source| cannot_start(command, source))? {
            return succeeded(command, status);
        }
        if Instant::now() >= deadline {
            // Fails only where it has just ended.
            let _ = child.kill();
            let _ = child.wait();
            return Err(Failure::Command {
                command: describe(command),
                how: format!("no end after {} s", limit.as_secs()),
            });
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Runs a command with `input` on its standard input.
pub fn run_with_input(command: &mut Command, input: &str) -> Result<(), Failure> {
    command.stdin(Stdio::piped()).stdout(Stdio::null());
    let mut child = start(command)?;
    if let Some(mut pipe) = child.stdin.take() {
        pipe.write_all(input.as_bytes()).map_err(|source| cannot_start(command, source))?;
    }
    let status = child.wait().map_err(|source| cannot_start(command, source))?;
    succeeded(command, status)
}

/// Standard output of a command, or nothing where it cannot be run or fails.
pub fn output(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Standard output of a command that has to succeed; its standard error is shown.
pub fn required_output(command: &mut Command) -> Result<String, Failure> {
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|source| cannot_start(command, source))?;
    succeeded(command, output.status)?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The failure of a program that could not be started.
pub fn cannot_start(command: &Command, source: std::io::Error) -> Failure {
    Failure::Start { program: command.get_program().to_string_lossy().into_owned(), source }
}

fn start(command: &mut Command) -> Result<Child, Failure> {
    command.spawn().map_err(|source| cannot_start(command, source))
}

fn succeeded(command: &Command, status: std::process::ExitStatus) -> Result<(), Failure> {
    if status.success() {
        return Ok(());
    }
    Err(Failure::Command { command: describe(command), how: status.to_string() })
}
