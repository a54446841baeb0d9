//! What a board finds when it tests itself, and how that is told.

use core::fmt;

use heapless::Vec;

/// The most checks there are.
const MAX_CHECKS: usize = 16;

/// One thing that was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Check {
    /// What, with its unit at the end.
    pub name: &'static str,
    /// The least that is right.
    pub least: i32,
    /// The most that is right.
    pub most: i32,
    /// What was measured; `None` where the measurement did not end.
    pub found: Option<i32>,
}

impl Check {
    /// Whether it is right.
    pub fn is_well(&self) -> bool {
        self.found.is_some_and(|found| (self.least..=self.most).contains(&found))
    }
}

/// A row of the table.
impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, least, most, found } = self;
        let verdict = if self.is_well() { "ok" } else { "FAILED" };
        write!(f, "test {name:<24} {least:>7} {most:>7} ")?;
        match found {
            Some(found) => write!(f, "{found:>7} {verdict}"),
            None => write!(f, "{:>7} {verdict}", "none"),
        }
    }
}

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SelfTest {
    checks: Vec<Check, MAX_CHECKS>,
}

impl SelfTest {
    /// The heading of the table.
    pub const HEADING: &'static str = "test name                       least    most   found verdict";

    /// Adds what was measured. One more than there is room for is lost.
    pub fn note(&mut self, name: &'static str, (least, most): (i32, i32), found: Option<i32>) {
        let _room = self.checks.push(Check { name, least, most, found });
    }

    /// The checks, in the order in which they were made.
    pub fn checks(&self) -> &[Check] {
        &self.checks
    }

    /// How many are not right.
    pub fn failed(&self) -> usize {
        self.checks.iter().filter(|check| !check.is_well()).count()
    }
}
