//! Reading what `cargo test -- --show-output`, or `pytest -q -ra`, prints, line by line as it comes.
//!
//! A test that cannot run here (no emulator, no recordings) prints a line with the words "not run"
//! and passes; such lines are the only output of passing tests that a reader needs.

/// What the lines so far have said.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tests that passed, by the result lines.
    pub passed: usize,
    /// Tests that failed, by the result lines.
    pub failed: usize,
    /// Names of failed tests.
    pub failures: Vec<String>,
    /// What was not run, in the tests' own words, each with the test's name.
    pub not_run: Vec<String>,
    /// Inside the output of passing tests.
    quiet: bool,
    /// The test whose output is being read.
    speaker: String,
}

impl Tally {
    /// Takes a line (without its end) and says whether to show it.
    pub fn take(&mut self, line: &str) -> bool {
        if let Some(counts) = line.strip_prefix("test result: ") {
            self.quiet = false;
            self.passed += count(counts, "passed");
            self.failed += count(counts, "failed");
            return true;
        }
        if let Some(pytest) = Pytest::of(line) {
            self.take_pytest(pytest);
            return true;
        }
        match line {
            "successes:" => self.quiet = true,
            "failures:" => self.quiet = false,
            _ => {}
        }
        if self.quiet {
            self.listen(line);
            return false;
        }
        if let Some((name, verdict)) = line.strip_prefix("test ").and_then(|rest| rest.rsplit_once(" ... ")) {
            match verdict {
                "FAILED" => self.failures.push(name.to_owned()),
                "ok" => {}
                _ if verdict.starts_with("ignored") => {
                    self.not_run.push(format!("{name}: not run ({verdict})"));
                }
                _ => {}
            }
        }
        true
    }

    fn take_pytest(&mut self, line: Pytest<'_>) {
        match line {
            Pytest::Counts(counts) => {
                self.passed += count(counts, "passed");
                self.failed += count(counts, "failed") + count(counts, "error") + count(counts, "errors");
            }
            Pytest::Failed(name) => self.failures.push(name.to_owned()),
            Pytest::Skipped(what) => self.not_run.push(format!("not run: {what}")),
        }
    }

    fn listen(&mut self, line: &str) {
        let header = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----"));
        if let Some(name) = header {
            self.speaker = name.to_owned();
        } else if line.to_ascii_lowercase().contains("not run") {
            self.not_run.push(format!("{}: {}", self.speaker, line.trim()));
        }
    }
}

/// A line of pytest's summary.
enum Pytest<'l> {
    /// `1 failed, 72 passed in 18.30s`.
    Counts(&'l str),
    /// `FAILED tests/test_board.py::test_name - AssertionError`.
    Failed(&'l str),
    /// `SKIPPED [1] tests/test_board.py:3: no board`.
    Skipped(&'l str),
}

impl<'l> Pytest<'l> {
    fn of(line: &'l str) -> Option<Self> {
        if let Some(rest) = line.strip_prefix("FAILED tests/").or_else(|| line.strip_prefix("ERROR tests/")) {
            return Some(Self::Failed(rest.split(" - ").next().unwrap_or(rest)));
        }
        if let Some(rest) = line.strip_prefix("SKIPPED [") {
            return Some(Self::Skipped(rest.split_once("] ").map_or(rest, |(_, what)| what)));
        }
        let (counts, seconds) = line.rsplit_once(" in ")?;
        let number = seconds.split(' ').next()?.strip_suffix('s')?;
        let counted = counts
            .split(", ")
            .all(|part| part.split_once(' ').is_some_and(|(number, _)| number.parse::<usize>().is_ok()));
        (counted && number.parse::<f64>().is_ok()).then_some(Self::Counts(counts))
    }
}

/// The number before `word` in `ok. 28 passed; 0 failed; ...`.
fn count(counts: &str, word: &str) -> usize {
    let mut before = None;
    for token in counts.split([' ', ';', '.', ',']).filter(|token| !token.is_empty()) {
        if token == word {
            return before.and_then(|number: &str| number.parse().ok()).unwrap_or(0);
        }
        before = Some(token);
    }
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_BINARIES: &str = "\
running 3 tests
test design::taps_sum_to_one ... ok
test recordings::downey ... ok
test slow ... ignored, takes an hour

successes:

---- design::taps_sum_to_one stdout ----
checked 4000 shapers
---- recordings::downey stdout ----
not run: no recordings at ../shared/data


successes:
    design::taps_sum_to_one
    recordings::downey

test result: ok. 2 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.06s

running 2 tests
test a ... FAILED
test b ... ok

successes:

successes:
    b

failures:

---- a stdout ----
thread 'a' panicked

failures:
    a

test result: FAILED. 1 passed; 1 failed; 0 ignored; 0 measured; 12 filtered out; finished in 0.01s
";

    #[test]
    fn results_add_up_over_binaries() {
        let mut tally = Tally::default();
        let shown: Vec<_> = TWO_BINARIES.lines().filter(|line| tally.take(line)).collect();
        assert_eq!((tally.passed, tally.failed), (3, 1));
        assert_eq!(tally.failures, ["a"]);
        assert_eq!(
            tally.not_run,
            [
                "slow: not run (ignored, takes an hour)",
                "recordings::downey: not run: no recordings at ../shared/data",
            ]
        );
        assert!(shown.contains(&"thread 'a' panicked"));
        assert!(!shown.iter().any(|line| line.contains("4000 shapers")));
        assert_eq!(shown.iter().filter(|line| line.starts_with("test result")).count(), 2);
    }

    #[test]
    fn a_summary_of_pytest_counts_as_well() {
        let mut tally = Tally::default();
        for line in [
            ".F.s                                 [100%]",
            "SKIPPED [1] tests/test_board.py:3: no board",
            "FAILED tests/test_shaper.py::test_a_zv - assert 1 == 2",
            "1 failed, 2 passed, 1 skipped, 1 error in 18.30s",
            "2 passed in 61.02s (0:01:01)",
            "what takes 3 steps in 2s is no summary",
        ] {
            assert!(tally.take(line), "{line}");
        }
        assert_eq!((tally.passed, tally.failed), (4, 2));
        assert_eq!(tally.failures, ["test_shaper.py::test_a_zv"]);
        assert_eq!(tally.not_run, ["not run: tests/test_board.py:3: no board"]);
    }

    #[test]
    fn counts_are_read_by_their_word() {
        assert_eq!(count("ok. 28 passed; 7 failed; 0 ignored", "passed"), 28);
        assert_eq!(count("ok. 28 passed; 7 failed; 0 ignored", "failed"), 7);
        assert_eq!(count("FAILED. x passed", "passed"), 0);
        assert_eq!(count("", "passed"), 0);
    }

    #[test]
    fn lines_that_only_look_like_results_change_nothing() {
        let mut tally = Tally::default();
        for line in ["test", "test  ... ", "testing ... FAILED", "a test result: ok. 5 passed", ""] {
            assert!(tally.take(line));
        }
        assert_eq!(tally, Tally::default());
    }
}
