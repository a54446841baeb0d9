//! The release image.

use std::path::PathBuf;

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

/// Builds the image and returns its path.
pub fn build(compiler: Compiler) -> Result<PathBuf, Failure> {
    let root = root();
    // A directory of its own, or the two compilers and the host builds undo each other's work.
    let directory = root.join("target").join("firmware-image");
    let mut command = match compiler {
        Compiler::Rustup => cargo(),
        Compiler::Distribution => distribution_cargo(),
    };
    command
        // Either would replace the linker arguments of .cargo/config.toml.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .args(["build", "--release", "--package", IMAGE, "--bin", IMAGE])
        .args(["--target", TARGET])
        .arg("--target-dir")
        .arg(&directory)
        // Adds to the linker arguments.
        .args(["--config", &format!("target.{TARGET}.rustflags=[\"-Dwarnings\"]")]);
    match compiler {
        Compiler::Rustup => say("building the image with rustup's target"),
        Compiler::Distribution => {
            say("building the image with the distribution's compiler and library source");
            command
                .arg("-Zbuild-std=core")
                // Unlocks -Zbuild-std on a stable compiler.
                .env("RUSTC_BOOTSTRAP", "1")
                // The distribution does not package rust-lld.
                .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
        }
    }
    run(&mut command)?;
    Ok(directory.join(TARGET).join("release").join(IMAGE))
}
