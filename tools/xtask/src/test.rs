//! The one test command.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use crate::cargo::cargo;
use crate::failure::Failure;
use crate::libtest::Tally;
use crate::run::{cannot_start, describe, run, say};
use crate::{bench_firmware, firmware, fuzz, interrupt, prove, python, setup, size};

/// Set for the emulator tests: the image to boot.
const IMAGE_VARIABLE: &str = "STILLBEAM_IMAGE";

/// Runs every check, all of them even when one fails, and sums up on standard output.
pub fn test() -> Result<ExitCode, Failure> {
    let mut outcome = Outcome::default();
    let compiler = outcome.tool("the firmware image and the emulator tests", setup::compiler);
    let emulator = outcome.tool("the emulator tests", setup::emulator);
    let interpreter = outcome.tool("the Python package", setup::python);
    let fuzzer = outcome.tool("a short run of libFuzzer", fuzz::compiler);
    outcome.format_and_lints();
    if let Some(compiler) = compiler {
        outcome.step("lints of the board", || firmware::lint(compiler));
        outcome.step("logging image", || firmware::build_with_log(compiler));
    }
    let image = compiler.and_then(|compiler| outcome.step("firmware image", || firmware::build(compiler)));
    if let Some(image) = &image {
        outcome.step("tick interrupt", || {
            print!("{}", interrupt::check(image)?);
            Ok(())
        });
        outcome.step("image size", || {
            print!("{}", size::report(image, 0)?);
            Ok(())
        });
    }
    let image = image.filter(|_| emulator.is_some());
    outcome.tests(image.as_deref())?;
    outcome.step("twenty concealed cases", prove::subset);
    if let Some(interpreter) = interpreter {
        outcome.python(&interpreter)?;
    }
    if fuzzer.is_some() {
        outcome.step("a short run of libFuzzer", fuzz::short);
    }
    if let Some(image) = &image {
        outcome.step("cost of the tick", || {
            println!("{}", bench_firmware::gate(image)?);
            Ok(())
        });
    }
    let everything_must_run = std::env::var("CI").is_ok_and(|value| value == "true");
    let (summary, well) = outcome.conclude(everything_must_run);
    print!("{summary}");
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// What takes minutes and guards what seldom breaks: left to [`test`].
const NOT_QUICK: [&str; 3] = ["stillbeam-diagnose", "stillbeam-concealed", "stillbeam-identify"];

/// Format, lints and the tests that take seconds, for people at work; sums up as [`test`] does.
pub fn quick() -> Result<ExitCode, Failure> {
    let mut outcome = Outcome::default();
    outcome.format_and_lints();
    let excluded = NOT_QUICK.iter().flat_map(|package| ["--exclude", package]);
    let mut tests = cargo();
    tests.args(["test", "--workspace", "--no-fail-fast"]).args(excluded).args(["--", "--show-output"]);
    outcome.cargo_tests(tests.env_remove(IMAGE_VARIABLE))?;
    say(format!(
        "left out: tests of {}, the image, the emulator, the Python package, concealed cases, fuzzing; \
         `cargo xtask test` runs them",
        NOT_QUICK.join(", ")
    ));
    let (summary, well) = outcome.conclude(false);
    print!("{summary}");
    Ok(if well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

#[derive(Debug, Default)]
struct Outcome {
    tally: Tally,
    /// Failed steps, each with why.
    broken: Vec<String>,
}

impl Outcome {
    /// A preparation without which `consequence` is not run.
    fn tool<T>(&mut self, consequence: &str, prepare: impl FnOnce() -> Result<T, Failure>) -> Option<T> {
        match prepare() {
            Ok(tool) => Some(tool),
            Err(failure) => {
                self.tally.not_run.push(format!("{consequence}: not run, {failure}"));
                None
            }
        }
    }

    fn step<T>(&mut self, name: &str, work: impl FnOnce() -> Result<T, Failure>) -> Option<T> {
        say(format!("{name} ..."));
        let begun = Instant::now();
        let result = work();
        let seconds = begun.elapsed().as_secs_f64();
        match result {
            Ok(made) => {
                say(format!("{name}: ok ({seconds:.1} s)"));
                Some(made)
            }
            Err(failure) => {
                say(format!("{name}: FAILED ({seconds:.1} s): {failure}"));
                self.broken.push(format!("{name}: {failure}"));
                None
            }
        }
    }

    fn format_and_lints(&mut self) {
        self.step("format", || run(cargo().args(["fmt", "--all", "--check"])));
        self.step("lints", || {
            let mut lint = cargo();
            lint.args(["clippy", "--quiet", "--workspace", "--all-targets", "--", "-D", "warnings"]);
            run(&mut lint)
        });
    }

    /// All tests of the workspace in one go; with an image, the emulator tests boot it.
    fn tests(&mut self, image: Option<&Path>) -> Result<(), Failure> {
        let mut command = cargo();
        command
            .args(["test", "--workspace", "--no-fail-fast", "--", "--show-output"])
            .env_remove(IMAGE_VARIABLE);
        if let Some(image) = image {
            command.env(IMAGE_VARIABLE, image);
        }
        self.cargo_tests(&mut command)
    }

    /// Tests that cargo runs.
    fn cargo_tests(&mut self, command: &mut Command) -> Result<(), Failure> {
        say("tests ...");
        let begun = Instant::now();
        let succeeded = follow(command, &mut self.tally, std::io::stdout())?;
        say(format!("tests: {:.1} s", begun.elapsed().as_secs_f64()));
        // Tests that do not compile, or a test process that crashed, fail without a result line.
        if !succeeded && self.tally.failed == 0 {
            self.broken.push("tests: `cargo test` failed without a failing test".to_owned());
        }
        Ok(())
    }

    /// The Python package and its tests.
    fn python(&mut self, interpreter: &Path) -> Result<(), Failure> {
        if self.step("Python package", || python::install(interpreter)).is_none() {
            return Ok(());
        }
        say("Python tests ...");
        let failed = self.tally.failed;
        let succeeded = follow(&mut python::tests(interpreter), &mut self.tally, std::io::stdout())?;
        if !succeeded && self.tally.failed == failed {
            self.broken.push("Python tests: pytest failed without a failing test".to_owned());
        }
        Ok(())
    }

    /// What failed, what was not run, and the count as the last line; and whether all is well.
    fn conclude(self, everything_must_run: bool) -> (String, bool) {
        let failures: Vec<_> = self.broken.iter().chain(&self.tally.failures).collect();
        let not_run: Vec<_> = self.tally.not_run.iter().collect();
        let mut text = list("failed:", &failures) + &list("not run:", &not_run);
        let mut failed = self.tally.failed + self.broken.len();
        let skipped = not_run.iter().filter(|entry| !is_beyond_set_up(entry)).count();
        if everything_must_run && skipped > 0 {
            text += &format!("CI=true: {skipped} of what was not run count as failures\n");
            failed += skipped;
        }
        text += &format!("{} passed, {failed} failed\n", self.tally.passed);
        (text, failed == 0)
    }
}

/// Whether an entry is about what no set-up could provide to a fresh clone: the published recordings, which
/// are not part of the repository, or a browser, which not every distribution has as a package.
fn is_beyond_set_up(entry: &str) -> bool {
    ["shared/data", "STILLBEAM_DATA", "there is no browser"].iter().any(|what| entry.contains(what))
}

fn list(title: &str, entries: &[&String]) -> String {
    if entries.is_empty() {
        return String::new();
    }
    let lines: String = entries.iter().map(|entry| format!("  {entry}\n")).collect();
    format!("{title}\n{lines}")
}

/// Runs a command, shows what it prints as it comes and reads the results in it.
fn follow(command: &mut Command, tally: &mut Tally, mut shown: impl Write) -> Result<bool, Failure> {
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(|source| cannot_start(command, source))?;
    let broken =
        |error: std::io::Error| Failure::Command { command: describe(command), how: error.to_string() };
    if let Some(pipe) = child.stdout.take() {
        for line in BufReader::new(pipe).split(b'\n') {
            let line = line.map_err(broken)?;
            let line = String::from_utf8_lossy(&line);
            if tally.take(&line) {
                // A reader that went away does not end the tests.
                let _ = writeln!(shown, "{line}");
            }
        }
    }
    Ok(child.wait().map_err(broken)?.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn conclude(lines: &[&str], broken: &[&str], everything_must_run: bool) -> (String, bool) {
        let mut tally = Tally::default();
        for line in lines {
            tally.take(line);
        }
        let broken = broken.iter().map(|&step| step.to_owned()).collect();
        Outcome { tally, broken }.conclude(everything_must_run)
    }

    const PASSED: &str = "test result: ok. 3 passed; 0 failed; 0 ignored";

    #[test]
    fn a_skip_fails_only_where_everything_must_run() {
        let emulator = ["successes:", "boots: not run, no emulator", PASSED];
        let (text, well) = conclude(&emulator, &[], false);
        assert!(well && text.ends_with("\n3 passed, 0 failed\n"), "{text}");
        assert!(text.contains("no emulator"), "{text}");
        let (text, well) = conclude(&emulator, &[], true);
        assert!(!well && text.ends_with("\n3 passed, 1 failed\n"), "{text}");
    }

    #[test]
    fn what_no_set_up_provides_is_listed_and_excused() {
        for what in ["no recordings at ../shared/data", "there is no browser; install chromium"] {
            let not_run = format!("not run: {what}");
            let (text, well) = conclude(&["successes:", &not_run, PASSED], &[], true);
            assert!(well && text.contains(what), "{text}");
        }
    }

    #[test]
    fn a_failed_test_or_step_fails_the_whole() {
        assert_eq!(conclude(&[PASSED], &[], true), ("3 passed, 0 failed\n".to_owned(), true));
        let (text, well) = conclude(&[PASSED], &["format: not formatted"], false);
        assert!(!well && text.ends_with("\n3 passed, 1 failed\n"), "{text}");
        let failing = ["test a ... FAILED", "test result: FAILED. 3 passed; 2 failed; "];
        let (text, well) = conclude(&failing, &[], false);
        assert!(!well && text.contains("  a\n") && text.ends_with("3 passed, 2 failed\n"), "{text}");
    }

    #[test]
    fn output_is_followed_to_the_end_whatever_its_bytes() {
        let mut tally = Tally::default();
        let script =
            "printf 'caf\\351\\ntest a ... FAILED\\ntest result: FAILED. 0 passed; 1 failed; \\n'; exit 1";
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let mut shown = Vec::new();
        assert!(!follow(&mut command, &mut tally, &mut shown).expect("a shell"));
        assert_eq!(String::from_utf8_lossy(&shown).lines().count(), 3);
        assert_eq!((tally.failed, tally.failures), (1, vec!["a".to_owned()]));
    }
}
