//! A compiler for the board.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use super::{apt, version};
use crate::cargo::root;
use crate::failure::Failure;
use crate::firmware::{Compiler, TARGET};
use crate::run::{output, run_within, say};

/// The distribution's compiler, its library source and a linker.
const PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];
/// Oldest compiler the workspace builds with (`rust-version`).
const OLDEST_RUSTC: (u32, u32) = (1, 95);
/// Enough to fetch 30 MB over a slow line.
const RUSTUP_LIMIT: Duration = Duration::from_secs(120);

/// Finds a compiler for the board, installing one where there is none: first what is already
/// there, then rustup's target, then the distribution's packages.
pub fn compiler() -> Result<Compiler, Failure> {
    let forced = std::env::var("STILLBEAM_CROSS").is_ok_and(|value| value == "distribution");
    if rustup_target_installed() && !forced {
        return Ok(Compiler::Rustup);
    }
    if distribution_pair_installed() {
        return Ok(Compiler::Distribution);
    }
    if !forced {
        say(format!("installing the target {TARGET} with rustup"));
        let mut add = Command::new("rustup");
        add.current_dir(root()).args(["target", "add", TARGET]);
        match run_within(&mut add, RUSTUP_LIMIT) {
            Ok(()) if rustup_target_installed() => return Ok(Compiler::Rustup),
            Ok(()) => say("rustup reports success, but the compiler does not see the target"),
            Err(failure) => say(format!("{failure}; trying the distribution's compiler")),
        }
    }
    say(format!("installing the packages {}", PACKAGES.join(" ")));
    apt::install(&PACKAGES, None).map_err(|failure| missing(&failure.to_string()))?;
    if distribution_pair_installed() {
        Ok(Compiler::Distribution)
    } else {
        Err(missing("the packages are installed, but too old or incomplete"))
    }
}

fn missing(why: &str) -> Failure {
    Failure::Missing {
        what: "a compiler for the board",
        why: why.to_owned(),
        remedy: "run `rustup target add thumbv7em-none-eabihf` with a network, or on Debian \
                 `apt-get install --no-install-recommends rustc-web cargo-web rust-web-src lld` as root",
    }
}

fn rustup_target_installed() -> bool {
    sysroot("rustc").is_some_and(|sysroot| sysroot.join("lib/rustlib").join(TARGET).join("lib").is_dir())
}

fn distribution_pair_installed() -> bool {
    let recent = output(Command::new("/usr/bin/rustc").arg("--version"))
        .and_then(|text| version::after(&text, "rustc "))
        .is_some_and(|found| found >= OLDEST_RUSTC);
    recent
        && Path::new("/usr/bin/cargo").exists()
        && sysroot("/usr/bin/rustc")
            .is_some_and(|sysroot| sysroot.join("lib/rustlib/src/rust/library/core").is_dir())
        && output(Command::new("ld.lld").arg("--version")).is_some()
}

fn sysroot(rustc: &str) -> Option<PathBuf> {
    let mut ask = Command::new(rustc);
    ask.current_dir(root()).args(["--print", "sysroot"]);
    output(&mut ask).map(|path| PathBuf::from(path.trim()))
}
