//! `cargo xtask fuzz [--runs N] [--only TARGET,...]`: libFuzzer on everything that reads bytes from outside.
//!
//! Coverage is recorded by LLVM's own pass, which the stable compiler can switch on; no sanitizer is needed,
//! for there is no `unsafe` in what is fuzzed, and overflow checks are on. libFuzzer itself is C++.

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

/// The targets, their share of the executions in per cent, and the longest input in bytes. The slow ones get
/// less.
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

/// Runs the targets named, separated by commas, or all of them; `runs` executions in all, shared as
/// [`TARGETS`] says.
pub fn fuzz(runs: usize, only: Option<&str>) -> Result<(), Failure> {
    let targets = chosen(only)?;
    let program = build()?;
    let whole: usize = targets.iter().map(|(_, share, _)| share).sum();
    for (target, share, longest) in &targets {
        let share = (runs * share).div_ceil(whole);
        say(format!("fuzzing {target}, {share} executions ..."));
        run(&mut command(&program, target, share, *longest)?)?;
    }
    println!("{runs} executions of {} targets, no crash", targets.len());
    Ok(())
}

fn chosen(only: Option<&str>) -> Result<Vec<(&'static str, usize, usize)>, Failure> {
    let Some(names) = only else { return Ok(TARGETS.to_vec()) };
    let find = |name: &str| {
        TARGETS.into_iter().find(|(target, ..)| *target == name).ok_or_else(|| {
            let known: Vec<_> = TARGETS.iter().map(|(target, ..)| *target).collect();
            Failure::Usage(format!("{name}: no such target; there are {}", known.join(", ")))
        })
    };
    names.split(',').map(find).collect()
}

/// The few seconds of the test command.
pub fn short() -> Result<(), Failure> {
    fuzz(SHORT_RUNS, None)
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

/// One target. New inputs stay below target/; the kept ones are only read. What crashes is left beside the
/// new ones.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_targets_have_a_hundred_per_cent_and_each_can_be_named() {
        assert_eq!(TARGETS.iter().map(|(_, share, _)| share).sum::<usize>(), 100);
        for target in TARGETS {
            assert_eq!(chosen(Some(target.0)).expect("there is"), [target]);
        }
        assert_eq!(chosen(Some("frames,console")).expect("there are").len(), 2);
        let failure = chosen(Some("consoles")).expect_err("no such").to_string();
        assert!(failure.contains("consoles") && failure.contains("settings"), "{failure}");
    }
}
