//! `cargo xtask bench-firmware`: what the image costs, recorded in docs/results; and the gate that the test
//! command has on these numbers.

mod numbers;
mod page;

use std::path::{Path, PathBuf};

use crate::cargo::{cargo, root};
use crate::failure::Failure;
use crate::run::{required_output, say};
use crate::{firmware, setup, size};
use numbers::{CASCADE_GOAL, CYCLE_GOAL, INTERRUPT_GOAL, Numbers, SizeNumbers};

/// What instructions and size may grow by unnoticed, in per cent.
const LIMIT_PCT: u64 = 5;

/// Builds the image, measures it and writes docs/results/firmware.toml and firmware.md.
pub fn record() -> Result<(), Failure> {
    let compiler = setup::compiler()?;
    setup::emulator()?;
    let image = firmware::build(compiler)?;
    say("counting instructions, about a minute ...");
    let mut numbers = Numbers::parse(&measure(&image, false)?, &image)?;
    let totals = size::totals(&image)?;
    numbers.size = Some(SizeNumbers { text: totals.text, data: totals.data, bss: totals.bss });
    write(&baseline(), &numbers.to_toml()?)?;
    let page = page::page(&numbers);
    write(&baseline().with_extension("md"), &page)?;
    print!("{page}");
    Ok(())
}

/// Compares ticks, sizes and the stack with what was recorded, and with their goals. The text says how they
/// compare.
pub fn gate(image: &Path) -> Result<String, Failure> {
    let path = baseline();
    let text = std::fs::read_to_string(&path)
        .map_err(|error| Failure::File { path: path.clone(), reason: error.to_string() })?;
    let recorded = Numbers::parse(&text, &path)?;
    let mut measured = Numbers::parse(&measure(image, true)?, image)?;
    let totals = size::totals(image)?;
    measured.size = Some(SizeNumbers { text: totals.text, data: totals.data, bss: totals.bss });
    judge(&recorded, &measured)
}

/// `measured` has some of the ticks of `recorded`, and all else but the sections with interrupts masked.
fn judge(recorded: &Numbers, measured: &Numbers) -> Result<String, Failure> {
    let missing =
        |what: String| Failure::File { path: baseline(), reason: format!("no {what} in it or measured") };
    let mut lines = Vec::new();
    let mut compare = |what: String, recorded: u64, now: u64| {
        lines.push(format!("{what}: {now} ({recorded} recorded)"));
        compare(what, recorded, now)
    };
    for now in &measured.tick {
        let what = now.describe();
        let then = recorded.tick.iter().find(|tick| tick.is_same_case(now));
        let then = then.ok_or_else(|| missing(what.clone()))?;
        compare(format!("instructions of a tick, {what}"), then.median.into(), now.median.into())?;
        compare(format!("cycles of a tick by the model, {what}"), then.cycles.into(), now.cycles.into())?;
    }
    let goals = measured.goals().ok_or_else(|| missing("tick with a goal".to_owned()))?;
    within("instructions of the cascade of 2 modes of zvdd", CASCADE_GOAL, goals.cascade)?;
    within("instructions of a tick that moves through 2 modes of zvdd", INTERRUPT_GOAL, goals.interrupt)?;
    let cycles = measured.tick.iter().map(|tick| tick.cycles).max().unwrap_or_default();
    within("cycles of the tick that takes most, by the model", CYCLE_GOAL, cycles)?;
    let sizes = recorded.size.zip(measured.size).ok_or_else(|| missing("size".to_owned()))?;
    let (then, now) = sizes;
    compare("text and constants in bytes".to_owned(), then.text, now.text)?;
    compare("RAM in bytes".to_owned(), then.data + then.bss, now.data + now.bss)?;
    let stacks = recorded.stack.zip(measured.stack).ok_or_else(|| missing("stack".to_owned()))?;
    let (then, now) = stacks;
    compare("deepest stack in bytes".to_owned(), then.bytes.into(), now.bytes.into())?;
    Ok(lines.join("\n"))
}

fn compare(what: String, recorded: u64, now: u64) -> Result<(), Failure> {
    if now * 100 > recorded * (100 + LIMIT_PCT) {
        return Err(Failure::Regression { what, recorded, now, limit_pct: LIMIT_PCT });
    }
    Ok(())
}

fn within(what: &'static str, goal: u32, now: u32) -> Result<(), Failure> {
    if now > goal { Err(Failure::Goal { what, goal, now }) } else { Ok(()) }
}

fn baseline() -> PathBuf {
    root().join("docs").join("results").join("firmware.toml")
}

/// What host-tests' example counts, as TOML.
fn measure(image: &Path, gate: bool) -> Result<String, Failure> {
    let mut command = cargo();
    command
        .args(["run", "--quiet", "--package", "stillbeam-host-tests", "--example", "tick_cost", "--"])
        .arg(image)
        .args(gate.then_some("--gate"));
    required_output(&mut command)
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .map_err(|error| Failure::File { path: path.to_owned(), reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_five_per_cent_up_fails_and_anything_down_passes() {
        for (recorded, now, well) in [(400, 400, true), (400, 420, true), (400, 421, false), (400, 1, true)] {
            assert_eq!(compare("it".to_owned(), recorded, now).is_ok(), well, "{recorded} {now}");
        }
        let failure = compare("it".to_owned(), 400, 500).expect_err("25 % up").to_string();
        assert!(failure.contains("from 400 to 500") && failure.contains("bench-firmware"), "{failure}");
    }

    /// What was recorded, changed in one place.
    fn changed(change: impl FnOnce(&mut Numbers)) -> Result<String, Failure> {
        let text = std::fs::read_to_string(baseline()).expect("docs/results/firmware.toml");
        let recorded = Numbers::parse(&text, &baseline()).expect("it is read");
        let mut measured = recorded.clone();
        change(&mut measured);
        judge(&recorded, &measured)
    }

    #[test]
    fn the_gate_watches_every_tick_that_was_counted_text_ram_stack_and_the_goals() {
        let said = changed(|_| ()).expect("as recorded");
        assert!(said.contains("RAM in bytes") && said.contains("deepest stack in bytes"), "{said}");
        let failures = [
            changed(|now| now.tick.last_mut().expect("a tick").median *= 2),
            changed(|now| now.tick.last_mut().expect("a tick").cycles *= 2),
            changed(|now| now.size.as_mut().expect("sizes").text *= 2),
            changed(|now| now.size.as_mut().expect("sizes").bss *= 2),
            changed(|now| now.stack.as_mut().expect("a stack").bytes *= 2),
            changed(|now| now.stack = None),
            changed(|now| now.tick.clear()),
        ];
        for (index, outcome) in failures.into_iter().enumerate() {
            assert!(outcome.is_err(), "{index}: {outcome:?}");
        }
        // Whatever was recorded, a tick may take no more than its share.
        let heavier = changed(|now| now.tick.iter_mut().for_each(|tick| tick.cycles = CYCLE_GOAL + 1));
        assert!(heavier.is_err(), "{heavier:?}");
        // Within five per cent of what was recorded, but over the goal.
        let slower = changed(|now| {
            for tick in now.tick.iter_mut().filter(|tick| (tick.modes, tick.streams) == (2, false)) {
                tick.median = tick.median.max(501).min(tick.median + 10);
            }
        });
        assert!(matches!(slower, Err(Failure::Goal { .. })), "{slower:?}");
    }

    #[test]
    fn the_recorded_numbers_are_read_and_make_the_page() {
        let text = std::fs::read_to_string(baseline()).expect("docs/results/firmware.toml");
        let numbers = Numbers::parse(&text, &baseline()).expect("it is read");
        let page =
            std::fs::read_to_string(baseline().with_extension("md")).expect("docs/results/firmware.md");
        assert_eq!(page::page(&numbers), page, "made by `cargo xtask bench-firmware`");
    }
}
