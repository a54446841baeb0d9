//! A Python of its own for the tests of the Python package.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{apt, version};
use crate::cargo::root;
use crate::failure::Failure;
use crate::run::{output, run, say};

const PROGRAM: &str = "python3";
/// The packages that the tests are pinned to need it.
const OLDEST: (u32, u32) = (3, 11);

/// Makes a virtual environment in the target folder, with what the tests need in it, and gives its Python.
/// Where the machine has no Python, or one that cannot make environments, it is installed.
pub fn python() -> Result<PathBuf, Failure> {
    if !usable() {
        say(format!("installing {PROGRAM} {}.{} or newer", OLDEST.0, OLDEST.1));
        apt::install(&["python3", "python3-venv"], None).map_err(|failure| missing(&failure.to_string()))?;
        if !usable() {
            return Err(missing("the package is installed, but the program is too old"));
        }
    }
    let environment = root().join("target").join("python");
    let interpreter = environment.join("bin").join("python");
    if output(Command::new(&interpreter).arg("--version")).is_none() {
        run(Command::new(PROGRAM).args(["-m", "venv", "--clear"]).arg(&environment))?;
    }
    let requirements = root().join("tools/python/tests/requirements.txt");
    run(pip(&interpreter).arg("--requirement").arg(requirements))?;
    Ok(interpreter)
}

/// `pip install` of an interpreter, quiet.
pub fn pip(interpreter: &Path) -> Command {
    let mut command = Command::new(interpreter);
    command.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    command
}

fn usable() -> bool {
    let asked = ["-c", "import ensurepip, sys; print('Python %d.%d' % sys.version_info[:2])"];
    output(Command::new(PROGRAM).args(asked))
        .and_then(|text| version::after(&text, "Python "))
        .is_some_and(|found| found >= OLDEST)
}

fn missing(why: &str) -> Failure {
    Failure::Missing {
        what: "a Python that makes virtual environments",
        why: why.to_owned(),
        remedy: "install Python 3.11 or newer with its `venv` module (`python3-venv` on Debian) so that `python3` \
                 is found first on the search path",
    }
}
