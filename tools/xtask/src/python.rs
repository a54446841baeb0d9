//! The Python package, installed as a person installs it, and its tests.

use std::path::Path;
use std::process::Command;

use crate::cargo::root;
use crate::failure::Failure;
use crate::run::run;
use crate::setup;

/// Builds and installs the package into an environment of its own.
pub fn install(interpreter: &Path) -> Result<(), Failure> {
    run(setup::pip(interpreter).arg(root().join("tools/python")))
}

/// The command that runs the tests.
pub fn tests(interpreter: &Path) -> Command {
    let mut command = Command::new(interpreter);
    command.args(["-m", "pytest", "-q", "--color=no", "-p", "no:cacheprovider"]);
    command.current_dir(root().join("tools/python"));
    command
}

/// Installs and tests.
pub fn python() -> Result<(), Failure> {
    let interpreter = setup::python()?;
    install(&interpreter)?;
    run(&mut tests(&interpreter))
}
