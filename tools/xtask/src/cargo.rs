//! Cargo from inside `cargo xtask`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The workspace's root.
pub fn root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    // tools/xtask is two below.
    own.ancestors().nth(2).unwrap_or(own).to_owned()
}

/// The cargo that runs this program, in the workspace's root.
pub fn cargo() -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.current_dir(root());
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(describes_this_program) {
            command.env_remove(&name);
        }
    }
    command
}

/// The distribution's cargo and rustc, out of rustup's reach.
pub fn distribution_cargo() -> Command {
    let mut command = Command::new("/usr/bin/cargo");
    command.current_dir(root());
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(|name| describes_this_program(name) || selects_a_toolchain(name)) {
            command.env_remove(&name);
        }
    }
    // The shims of rustup come first on the search path of a program that rustup's cargo runs.
    command.env("PATH", "/usr/bin:/bin:/usr/sbin:/sbin:/usr/local/bin").env("RUSTC", "/usr/bin/rustc");
    command
}

/// What cargo tells the program it runs about itself: wrong for any other package.
fn describes_this_program(name: &str) -> bool {
    const NAMES: [&str; 6] = [
        "CARGO_MANIFEST_DIR",
        "CARGO_MANIFEST_PATH",
        "CARGO_BIN_NAME",
        "CARGO_CRATE_NAME",
        "CARGO_PRIMARY_PACKAGE",
        "OUT_DIR",
    ];
    NAMES.contains(&name) || name.starts_with("CARGO_PKG_")
}

/// What rustup and its cargo say about the compiler to use.
fn selects_a_toolchain(name: &str) -> bool {
    const NAMES: [&str; 8] = [
        "CARGO",
        "RUSTC",
        "RUSTDOC",
        "RUSTC_WRAPPER",
        "RUSTC_WORKSPACE_WRAPPER",
        "RUST_RECURSION_COUNT",
        "LD_LIBRARY_PATH",
        "DYLD_FALLBACK_LIBRARY_PATH",
    ];
    NAMES.contains(&name) || name.starts_with("RUSTUP_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_keeps_the_users_settings_and_loses_those_of_this_program() {
        for name in ["CARGO_PKG_NAME", "CARGO_MANIFEST_DIR", "OUT_DIR"] {
            assert!(describes_this_program(name), "{name}");
        }
        for name in ["RUSTUP_TOOLCHAIN", "RUSTUP_HOME", "RUSTC", "CARGO", "LD_LIBRARY_PATH"] {
            assert!(selects_a_toolchain(name), "{name}");
        }
        for name in ["CARGO_HOME", "CARGO_HTTP_PROXY", "CARGO_NET_OFFLINE", "HOME", "RUST_BACKTRACE"] {
            assert!(!describes_this_program(name) && !selects_a_toolchain(name), "{name}");
        }
    }

    #[test]
    fn the_root_holds_the_workspace() {
        let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("manifest");
        assert!(manifest.contains("[workspace]"));
    }
}
