//! What a terminal logged from a serial line: `ax:0.12 ay:-0.03`, `t=5, a=1.2`, and the time of day before `
//! -> ` that the terminal puts before every line.

use super::cells::{Separator, Value, value};
use super::clock;
use super::lines::{Lines, on_their_lines};

/// Lines that are looked at, and the share of them that has to be of this kind.
const LOOKED_AT: usize = 60;
const MOST: f64 = 0.8;
/// What terminals put between the time of day and the line.
const ARROW: &str = "->";

/// The log as a table with tabs, every row on its own line; `None` for text that is none.
pub(super) fn as_table(text: &str) -> Option<(String, Separator)> {
    let start: Vec<&str> = Lines::new(text).take(LOOKED_AT).map(|line| line.text).collect();
    let count = |is: &dyn Fn(&str) -> bool| start.iter().filter(|line| is(line)).count() as f64;
    let enough = MOST * start.len() as f64;
    let arrows = count(&|line| stamp(line).is_some()) >= enough;
    let usual = start.iter().rev().find_map(|line| labelled(without_stamp(line)))?.0;
    let labels = count(&|line| values_of(&usual, without_stamp(line)).is_some()) >= enough;
    labels.then(|| rewritten(text, arrows, &usual))
}

/// A log of which only the stamps are unusual: these become a cell of their own.
pub(super) fn without_arrows(text: &str) -> Option<String> {
    let start: Vec<&str> = Lines::new(text).take(LOOKED_AT).map(|line| line.text).collect();
    let found: Vec<&str> = start.iter().filter_map(|line| Some(stamp(line)?.1)).collect();
    if found.is_empty() || (found.len() as f64) < MOST * start.len() as f64 {
        return None;
    }
    let last = found.last()?;
    let separator = ['\t', ';', ','].into_iter().find(|sign| last.contains(*sign)).unwrap_or('\t');
    let row = |line: &str| match stamp(line) {
        Some((time, rest)) => format!("{time}{separator}{rest}"),
        None => line.to_owned(),
    };
    Some(on_their_lines(text, row))
}

/// The numbers of a line that has these labels.
fn values_of<'t>(names: &[&str], line: &'t str) -> Option<Vec<&'t str>> {
    labelled(line).filter(|(found, _)| found == names).map(|(_, cells)| cells)
}

fn rewritten(text: &str, arrows: bool, names: &[&str]) -> (String, Separator) {
    let clock = arrows.then_some("time_of_day");
    let head: Vec<&str> = clock.into_iter().chain(names.iter().copied()).collect();
    let mut is_first = true;
    let row = |line: &str| {
        let (time, rest) = stamp(line).map_or((None, line), |(time, rest)| (Some(time), rest));
        let Some(cells) = values_of(names, rest).filter(|_| time.is_some() == arrows) else {
            return String::new();
        };
        let row = time.into_iter().chain(cells).collect::<Vec<_>>().join("\t");
        let head = if std::mem::take(&mut is_first) { head.join("\t") + "\n" } else { String::new() };
        head + &row
    };
    (on_their_lines(text, row), Separator::Byte(b'\t'))
}

/// The time of day that a terminal put before a line, and the line.
fn stamp(line: &str) -> Option<(&str, &str)> {
    let (time, rest) = line.split_once(ARROW)?;
    let time = time.trim();
    clock::parse(time)?;
    Some((time, rest.trim()))
}

fn without_stamp(line: &str) -> &str {
    stamp(line).map_or(line, |(_, rest)| rest)
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
