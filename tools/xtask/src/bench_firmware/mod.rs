//! `cargo xtask bench-firmware`: what the image costs, recorded in docs/results; and the gate that the test command
//! has on these numbers.

mod numbers;
mod page;

use std::path::{Path, PathBuf};

use crate::cargo::{cargo, root};
use crate::failure::Failure;
use crate::run::{required_output, say};
use crate::{firmware, setup, size};
use numbers::{Numbers, SizeNumbers, TickNumbers};

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

/// Compares the tick that costs most, and the size, with what was recorded. The text says how they compare.
pub fn gate(image: &Path) -> Result<String, Failure> {
    let path = baseline();
    let text = std::fs::read_to_string(&path)
        .map_err(|error| Failure::File { path: path.clone(), reason: error.to_string() })?;
    let recorded = Numbers::parse(&text, &path)?;
    let measured = Numbers::parse(&measure(image, true)?, image)?;
    let missing = |what: &str| Failure::File { path: path.clone(), reason: format!("no {what} in it") };
    let now = measured.tick.first().ok_or_else(|| missing("measured tick"))?;
    let then =
        recorded.tick.iter().find(|tick| tick.is_same_case(now)).ok_or_else(|| missing("such tick"))?;
    let size_then = recorded.size.ok_or_else(|| missing("size"))?;
    let size_now = size::totals(image)?;
    compare("the tick's instructions", then.median.into(), now.median.into())?;
    compare("the image's text (bytes)", size_then.text, size_now.text)?;
    let TickNumbers { modes, shaper, .. } = now;
    Ok(format!(
        "tick with {modes} modes of {shaper}: {} instructions ({} recorded); text {} bytes ({} recorded)",
        now.median, then.median, size_now.text, size_then.text
    ))
}

fn compare(what: &'static str, recorded: u64, now: u64) -> Result<(), Failure> {
    if now * 100 > recorded * (100 + LIMIT_PCT) {
        return Err(Failure::Regression { what, recorded, now, limit_pct: LIMIT_PCT });
    }
    Ok(())
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
            assert_eq!(compare("it", recorded, now).is_ok(), well, "{recorded} {now}");
        }
        let failure = compare("the tick's instructions", 400, 500).expect_err("25 % up").to_string();
        assert!(failure.contains("from 400 to 500") && failure.contains("bench-firmware"), "{failure}");
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
