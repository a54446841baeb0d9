//! `stillbeam flash`: the image onto a connected board.

use std::process::{Command, Stdio};

use clap::Args;

use crate::board::emulated::build_image;
use crate::error::CliError;
use crate::streams::Streams;
use crate::workspace;

const CHIP: &str = "STM32F405RG";

/// Build the firmware image and write it to a connected board with probe-rs.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam flash")]
pub struct FlashArgs {}

impl FlashArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let there =
            Command::new("probe-rs").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !there.is_ok_and(|status| status.success()) {
            return Err(CliError::MissingProgram {
                program: "probe-rs",
                remedy: "install it with `cargo install probe-rs-tools --locked` and run this again",
            });
        }
        let root = workspace::root().ok_or_else(|| {
            CliError::Usage("the source tree was not found; run this from within it".to_owned())
        })?;
        streams.say("building the firmware image");
        let image = build_image(&root)?;
        for (what, arguments) in [("writing", vec!["download", "--verify"]), ("resetting", vec!["reset"])] {
            streams.say(&format!("{what} the board"));
            let mut command = Command::new("probe-rs");
            command.args(&arguments).args(["--chip", CHIP]);
            if what == "writing" {
                command.arg(&image);
            }
            let status = command.status().map_err(|error| CliError::file("probe-rs", &error))?;
            if !status.success() {
                return Err(CliError::Usage(format!(
                    "probe-rs {} failed ({status}); check the probe's cable and that the board has power",
                    arguments.join(" ")
                )));
            }
        }
        Ok(())
    }
}
