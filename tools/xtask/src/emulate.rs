//! The image on an emulated board, for a person at a terminal.

use crate::cargo::cargo;
use crate::failure::Failure;
use crate::run::{run, say};
use crate::{firmware, setup};

/// Builds the image and runs it until the terminal says end of input or interrupt.
pub fn emulate(shift: Option<usize>) -> Result<(), Failure> {
    let compiler = setup::compiler()?;
    setup::emulator()?;
    let image = firmware::build(compiler)?;
    say("the board's serial port follows; talk to it with `cargo stillbeam console --port PATH`");
    say("end with ctrl-c or ctrl-d");
    let mut command = cargo();
    command
        .args(["run", "--quiet", "--package", "stillbeam-host-tests"])
        .args(["--bin", "stillbeam-emulator", "--"])
        .arg(image);
    if let Some(shift) = shift {
        command.args(["--shift", &shift.to_string()]);
    }
    run(&mut command)
}
