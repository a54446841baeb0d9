//! Makes docs/results/first_contact.md:
//!
//! ```text
//! cargo run --profile host -p stillbeam-identify --example first_contact > docs/results/first_contact.md
//! ```
//!
//! Every input is made here: nothing is read from a disk.

mod files;
mod kinds;
#[path = "../../tests/synthetic/mod.rs"]
mod synthetic;

use stillbeam_identify::{FreeDecayOptions, IdentifiedModes, identify_free_decay};

fn main() {
    println!("# Recordings as people have them\n");
    println!(
        "Made by `cargo run --profile host -p stillbeam-identify --example first_contact > docs/results/first_contact.md`. \
Every input is made by the example, with seeded noise; none is a file of somebody else's.\n"
    );
    println!("{}", files::section());
    print!("{}", kinds::section());
}

/// Frequencies and damping ratios in a cell of a table.
fn cell(modes: impl Iterator<Item = (f64, f64)>) -> String {
    modes.map(|(hz, zeta)| format!("{hz:.4} / {zeta:.5}")).collect::<Vec<_>>().join("<br>")
}

/// What was found, as a cell.
fn found_cell(found: &IdentifiedModes) -> String {
    cell(found.modes.iter().map(|mode| (mode.frequency_hz.value, mode.damping_ratio.value)))
}

/// Without the cross-checks, which no number here shows.
fn decay_options(output: &str) -> FreeDecayOptions {
    FreeDecayOptions { cross_checks: false, ..FreeDecayOptions::new(output) }
}

/// A decay's modes as a cell, or why there are none.
fn decay_cell(recording: &stillbeam_recording::Recording, output: &str) -> String {
    match identify_free_decay(recording, &decay_options(output)) {
        Ok(found) => found_cell(&found),
        Err(refusal) => format!("refused: {refusal}"),
    }
}
