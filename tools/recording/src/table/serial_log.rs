//! What a terminal or a logger wrote line by line: `ax:0.12 ay:-0.03`, `t=5, a=1.2`, with what it puts before
//! every line: the time of day (`09:15:07.123 -> `), a board's own clock (`I (1234) imu: `,
//! `[00:00:01.234,000] <inf> imu: `).

use super::cells::{Separator, Value, value};
use super::clock;
use super::lines::{Lines, on_their_lines};

/// Lines that are looked at, and the share of them that has to be of this kind.
const LOOKED_AT: usize = 60;
const MOST: f64 = 0.8;
/// What terminals put between the time of day and the line.
const ARROW: &str = "->";
/// Words that loggers put before a message.
const LEVELS: [&str; 12] = [
    "INFO", "DEBUG", "WARNING", "WARN", "ERROR", "TRACE", "<inf>", "<dbg>", "<wrn>", "<err>", "[INFO]",
    "[DEBUG]",
];

/// The log as a table with tabs, its names in a line before it and every row on its own line; `None` for text
/// that is none.
pub(super) fn as_table(text: &str) -> Option<(String, Separator)> {
    let start: Vec<&str> = Lines::new(text).take(LOOKED_AT).map(|line| line.text).collect();
    let count = |is: &dyn Fn(&str) -> bool| start.iter().filter(|line| is(line)).count() as f64;
    let enough = MOST * start.len() as f64;
    let stampers: [Stamper; 2] = [Stamp::before, dated];
    stampers.into_iter().find_map(|stamp| {
        let usual = start.iter().rev().find_map(|line| labelled(without(stamp, line)))?.0;
        let stamped = count(&|line| stamp(line).is_some()) >= enough;
        let labels = count(&|line| values_of(&usual, without(stamp, line)).is_some()) >= enough;
        labels.then(|| rewritten(text, stamped.then_some(stamp), &usual))
    })
}

/// A log of which only what stands before each line is unusual: the stamps become a cell of their own.
pub(super) fn stamps_as_cells(text: &str) -> Option<String> {
    let start: Vec<&str> = Lines::new(text).take(LOOKED_AT).map(|line| line.text).collect();
    let found: Vec<&str> = start.iter().filter_map(|line| Some(Stamp::before(line)?.1)).collect();
    if found.is_empty() || (found.len() as f64) < MOST * start.len() as f64 {
        return None;
    }
    let last = found.last()?;
    let separator = ['\t', ';', ',', ' '].into_iter().find(|sign| last.contains(*sign)).unwrap_or('\t');
    // A number that blanks part from its unit would be two cells.
    let row = |line: &str| match Stamp::before(line) {
        Some((stamp, rest)) if separator == ' ' => {
            format!("{}\t{}", stamp.cell(), rest.split_whitespace().collect::<Vec<_>>().join("\t"))
        }
        Some((stamp, rest)) => format!("{}{separator}{rest}", stamp.cell()),
        None => line.to_owned(),
    };
    Some(on_their_lines(text, row))
}

/// The numbers of a line that has these labels.
fn values_of<'t>(names: &[&str], line: &'t str) -> Option<Vec<&'t str>> {
    labelled(line).filter(|(found, _)| found == names).map(|(_, cells)| cells)
}

fn rewritten(text: &str, stamped: Option<Stamper>, names: &[&str]) -> (String, Separator) {
    let clock = stamped.map(|_| "time_of_day");
    let head: Vec<&str> = clock.into_iter().chain(names.iter().copied()).collect();
    let row = |line: &str| {
        let (time, rest) = match stamped.map(|stamp| stamp(line)) {
            Some(Some((stamp, rest))) => (Some(stamp.cell()), rest),
            Some(None) => return String::new(),
            None => (None, line),
        };
        let Some(cells) = values_of(names, rest) else { return String::new() };
        time.as_deref().into_iter().chain(cells).collect::<Vec<_>>().join("\t")
    };
    (head.join("\t") + "\n" + &on_their_lines(text, row), Separator::Byte(b'\t'))
}

/// What stands before a line and says when it was written.
#[derive(Debug, Clone, PartialEq)]
enum Stamp {
    /// A time of day, with or without a date.
    Clock(String),
    /// Milliseconds since the board started.
    Milliseconds(u64),
}

type Stamper = fn(&str) -> Option<(Stamp, &str)>;

fn without(stamp: Stamper, line: &str) -> &str {
    stamp(line).map_or(line, |(_, rest)| rest)
}

impl Stamp {
    /// The stamp that a terminal or the logger of a board put before a line, and the line.
    fn before(line: &str) -> Option<(Self, &str)> {
        Self::of_terminal(line).or_else(|| Self::of_esp(line)).or_else(|| Self::of_zephyr(line))
    }

    /// `09:15:07.123 -> `
    fn of_terminal(line: &str) -> Option<(Self, &str)> {
        let (time, rest) = line.split_once(ARROW)?;
        let time = time.trim();
        clock::parse(time)?;
        Some((Self::Clock(time.to_owned()), rest.trim()))
    }

    /// `I (1234) imu: `, also in colours.
    fn of_esp(line: &str) -> Option<(Self, &str)> {
        let line = match line.strip_prefix('\u{1b}') {
            Some(coloured) => coloured.split_once('m')?.1.split('\u{1b}').next()?,
            None => line,
        };
        let (level, rest) = line.split_once(" (")?;
        let (count, rest) = rest.split_once(") ")?;
        let is_level = ["I", "D", "W", "E", "V"].contains(&level.trim());
        Some((Self::Milliseconds(count.parse().ok().filter(|_| is_level)?), message_of(rest)))
    }

    /// `[00:00:01.234,567] <inf> imu: `: milliseconds, a comma, microseconds.
    fn of_zephyr(line: &str) -> Option<(Self, &str)> {
        let (time, rest) = line.trim_start().strip_prefix('[')?.split_once("] ")?;
        let (whole, micros) = time.split_once(',')?;
        clock::parse(whole).filter(|_| micros.len() == 3 && micros.bytes().all(|b| b.is_ascii_digit()))?;
        Some((Self::Clock(format!("{whole}{micros}")), message_of(rest)))
    }

    /// The cell of a table that says the same.
    fn cell(&self) -> String {
        match self {
            Self::Clock(time) => time.clone(),
            Self::Milliseconds(count) => format!("{count} ms"),
        }
    }
}

/// A date or a time of day before a line, in brackets or not.
fn dated(line: &str) -> Option<(Stamp, &str)> {
    let bare = line.trim_start();
    let (time, rest) = match bare.strip_prefix('[') {
        Some(inner) => inner.split_once(']')?,
        None => {
            let mut ends = bare.match_indices([' ', '\t', ';']).map(|(at, _)| at).take(2).collect::<Vec<_>>();
            ends.reverse();
            let end = ends
                .into_iter()
                .find(|end| bare.get(..*end).is_some_and(|time| clock::parse(time).is_some()))?;
            bare.split_at_checked(end)?
        }
    };
    clock::parse(time)?;
    Some((Stamp::Clock(time.trim().to_owned()), message_of(rest)))
}

/// A line without the level and the name of who says it.
fn message_of(line: &str) -> &str {
    let dashes = |c: char| c.is_whitespace() || matches!(c, '-' | ',' | ';');
    let mut rest = line.trim_start_matches(dashes);
    if let Some(level) = LEVELS.iter().find(|level| rest.starts_with(**level)) {
        rest = rest.get(level.len()..).unwrap_or("").trim_start_matches(|c| dashes(c) || c == ':');
    }
    match rest.split_once(": ") {
        // `ax: 0.1` is a label itself.
        Some((tag, message)) if !tag.contains([' ', '=']) && labelled(rest).is_none() => message.trim(),
        _ => rest.trim(),
    }
}

/// Labels and numbers of a line that holds nothing else: `a:1 b:2`, `a=1, b=2`, `a: 1 b: 2`.
fn labelled(line: &str) -> Option<(Vec<&str>, Vec<&str>)> {
    let (mut names, mut cells) = (Vec::new(), Vec::new());
    let mut rest = line.trim_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ';' | '{' | '}'));
    while !rest.is_empty() {
        let at = rest.find([':', '='])?;
        let name = rest.get(..at)?.trim();
        let after = rest.get(at + 1..)?.trim_start();
        let end = after.find(|c: char| c.is_whitespace() || matches!(c, ',' | ';')).unwrap_or(after.len());
        let cell = after.get(..end)?;
        let is_name = name.starts_with(|c: char| c.is_alphabetic() || c == '_') && name.len() < 40;
        if !is_name || !matches!(value(cell, false), Value::Number(_) | Value::Missing) {
            return None;
        }
        names.push(name);
        cells.push(cell);
        rest =
            after.get(end..)?.trim_start_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ';' | '|'));
    }
    (!names.is_empty()).then_some((names, cells))
}
