//! Runs the command as a person would.

pub mod browser;
pub mod live;
pub mod web;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// What a run of the command gave.
pub struct Run {
    /// Exit status.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub messages: String,
}

/// Runs `stillbeam` with these arguments.
pub fn stillbeam(arguments: &[&str]) -> Run {
    stillbeam_in(Path::new("."), arguments)
}

/// Runs it, expects success and returns standard output.
pub fn accepted(arguments: &[&str]) -> String {
    let run = stillbeam(arguments);
    assert_eq!(run.code, 0, "{arguments:?}: {}", run.messages);
    run.out
}

/// Runs it, expects exit status 2, no panic, nothing on standard output, and every part in the message.
pub fn refused(arguments: &[&str], parts: &[&str]) {
    let run = stillbeam(arguments);
    assert_eq!(run.code, 2, "{arguments:?}: {}", run.messages);
    assert!(
        !run.messages.contains("panicked") && !run.messages.contains("RUST_BACKTRACE"),
        "{}",
        run.messages
    );
    assert_eq!(run.out, "", "{arguments:?}");
    for part in parts {
        assert!(run.messages.contains(part), "{arguments:?}: `{}` lacks `{part}`", run.messages);
    }
}

/// The model that the project comes with.
pub fn paper_beam() -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/paper_beam.toml");
    path.display().to_string()
}

/// Runs `stillbeam` with these arguments in a folder.
pub fn stillbeam_in(folder: &Path, arguments: &[&str]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stillbeam"));
    let Output { status, stdout, stderr } = command.current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Run { code: status.code().unwrap_or(-1), out: text(stdout), messages: text(stderr) }
}
