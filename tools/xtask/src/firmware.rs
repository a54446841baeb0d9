//! The release image.

use std::path::PathBuf;
use std::process::Command;

use crate::cargo::{cargo, distribution_cargo, root};
use crate::failure::Failure;
use crate::run::{run, say};

/// The board's target.
pub const TARGET: &str = "thumbv7em-none-eabihf";
const IMAGE: &str = "stillbeam-firmware";

/// Who compiles for the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compiler {
    /// The workspace's toolchain, with the target that rustup installed.
    Rustup,
    /// The distribution's compiler, which builds the target's `core` from its library source.
    Distribution,
}

/// Builds the release image and returns its path.
pub fn build(compiler: Compiler) -> Result<PathBuf, Failure> {
    match compiler {
        Compiler::Rustup => say("building the image with rustup's target"),
        Compiler::Distribution => {
            say("building the image with the distribution's compiler and library source");
        }
    }
    run(&mut for_board("build", compiler))?;
    Ok(directory().join(TARGET).join("release").join(IMAGE))
}

/// Builds the image that logs over RTT, to see that it builds. It takes the release image's place until
/// [`build`] puts that back.
pub fn build_with_log(compiler: Compiler) -> Result<(), Failure> {
    run(for_board("build", compiler).args(["--features", "defmt"]))
}

/// Lints what is compiled for the board only. The distribution's compiler comes without clippy; there the
/// image's build, which denies warnings, has to do.
pub fn lint(compiler: Compiler) -> Result<(), Failure> {
    match compiler {
        Compiler::Rustup => run(&mut for_board("clippy", compiler)),
        Compiler::Distribution => {
            say("the distribution has no clippy for the board's code");
            Ok(())
        }
    }
}

/// A directory of its own, or the two compilers and the host builds undo each other's work.
fn directory() -> PathBuf {
    root().join("target").join("firmware-image")
}

fn for_board(subcommand: &str, compiler: Compiler) -> Command {
    let mut command = match compiler {
        Compiler::Rustup => cargo(),
        Compiler::Distribution => distribution_cargo(),
    };
    command
        // Either would replace the linker arguments of .cargo/config.toml.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .args([subcommand, "--release", "--package", IMAGE, "--bin", IMAGE])
        .args(["--target", TARGET])
        .arg("--target-dir")
        .arg(directory())
        // Adds to the linker arguments.
        .args(["--config", &format!("target.{TARGET}.rustflags=[\"-Dwarnings\"]")]);
    match compiler {
        Compiler::Rustup => {}
        Compiler::Distribution => {
            command
                .arg("-Zbuild-std=core")
                // Unlocks -Zbuild-std on a stable compiler.
                .env("RUSTC_BOOTSTRAP", "1")
                // The distribution does not package rust-lld.
                .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
        }
    }
    command
}
