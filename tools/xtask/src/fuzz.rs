//! `cargo xtask fuzz [--runs N]`: libFuzzer on everything that reads bytes from outside.
//!
//! Coverage is recorded by LLVM's own pass, which the stable compiler can switch on; no sanitizer is needed, for there is no
//! `unsafe` in what is fuzzed, and overflow checks are on. libFuzzer itself is C++.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::cargo::{cargo, root};
use crate::failure::Failure;
use crate::run::{describe, run, say};

/// Executions when nothing else is said: all targets together.
pub const DEFAULT_RUNS: usize = 600_000;

/// Executions in the test command: seconds.
const SHORT_RUNS: usize = 60_000;

/// Where the coverage goes that guides libFuzzer.
const COVERAGE: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares";

/// The targets, their share of the executions in per cent, and the longest input in bytes. The slow ones get less.
const TARGETS: [(&str, usize, usize); 12] = [
    ("console", 4, 400),
    ("frames", 34, 600),
    ("table", 6, 540),
    ("plan", 2, 600),
    ("settings", 10, 3072),
    ("recording", 4, 1024),
    ("csv", 8, 1024),
    ("klipper", 8, 1024),
    ("uff", 6, 4096),
    ("mat", 6, 2048),
    ("wav", 8, 1024),
    ("model", 4, 1024),
];

/// Runs all targets, `runs` executions in all.
pub fn fuzz(runs: usize) -> Result<(), Failure> {
    let program = build()?;
    for (target, per_cent, longest) in TARGETS {
        let share = (runs * per_cent).div_ceil(100);
        say(format!("fuzzing {target}, {share} executions ..."));
        run(&mut command(&program, target, share, longest)?)?;
    }
    println!("{runs} executions of {} targets, no crash", TARGETS.len());
    Ok(())
}

/// The few seconds of the test command.
pub fn short() -> Result<(), Failure> {
    fuzz(SHORT_RUNS)
}

/// Whether libFuzzer can be compiled here.
pub fn compiler() -> Result<(), Failure> {
    let found = ["c++", "g++", "clang++"].into_iter().any(|program| {
        let version =
            Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        version.is_ok_and(|status| status.success())
    });
    if found {
        return Ok(());
    }
    Err(Failure::Missing {
        what: "a C++ compiler",
        why: "libFuzzer is written in C++".to_owned(),
        remedy: "install g++ or clang; the tests of stillbeam-fuzz replay the kept inputs without it",
    })
}

fn build() -> Result<PathBuf, Failure> {
    compiler()?;
    let folder = root().join("target").join("fuzz");
    let host = host_triple()?;
    say("building the fuzz targets");
    let mut build = cargo();
    // A target is named so that build scripts and macros go without coverage.
    build
        .args([
            "build",
            "--quiet",
            "--package",
            "stillbeam-fuzz",
            "--features",
            "libfuzzer",
            "--target",
            &host,
        ])
        .env("RUSTFLAGS", COVERAGE)
        .env("CARGO_TARGET_DIR", &folder);
    run(&mut build)?;
    Ok(folder.join(host).join("debug").join("stillbeam-fuzz"))
}

fn host_triple() -> Result<String, Failure> {
    let mut command = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    command.arg("-vV").current_dir(root());
    let failed = |how: String| Failure::Command { command: "rustc -vV".to_owned(), how };
    let output = command.output().map_err(|error| failed(error.to_string()))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_owned).ok_or_else(|| failed(format!("no host in {:?}", describe(&command))))
}

/// One target. New inputs stay below target/; the kept ones are only read. What crashes is left beside the new ones.
fn command(program: &PathBuf, target: &str, runs: usize, longest: usize) -> Result<Command, Failure> {
    let found = root().join("target").join("fuzz").join("found").join(target);
    let kept = root().join("host-tests").join("fuzz").join("corpus").join(target);
    std::fs::create_dir_all(&found)
        .map_err(|error| Failure::File { path: found.clone(), reason: error.to_string() })?;
    let mut command = Command::new(program);
    command
        .env("STILLBEAM_FUZZ_TARGET", target)
        .args([
            &format!("-runs={runs}"),
            &format!("-max_len={longest}"),
            "-timeout=120",
            "-rss_limit_mb=3000",
        ])
        .args(["-verbosity=0", "-print_final_stats=1", "-seed=1"])
        .arg(format!("-artifact_prefix={}/crash-", found.with_extension("").display()))
        .args([&found, &kept]);
    Ok(command)
}
