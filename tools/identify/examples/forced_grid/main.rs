//! Random machines under every kind of drive: how many modes come back, how many are missed, how many were
//! never there.
//!
//! ```text
//! cargo run --profile host -p stillbeam-identify --example forced_grid
//! ```
//!
//! `STILLBEAM_SEEDS` sets how many machines every kind of drive gets (10 unless given);
//! `STILLBEAM_ONLY=hammer`, or another kind,
//! makes one kind only; with `STILLBEAM_EACH` every record gets a line on standard error.

mod chance;
mod machine;
mod score;

use std::process::ExitCode;

use machine::DRIVES;
use score::Tally;

fn main() -> ExitCode {
    let seeds = std::env::var("STILLBEAM_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    let only = std::env::var("STILLBEAM_ONLY").ok();
    println!(
        "| drive | records | all right | modes found | missed | ghosts | refused | damping within 10 % | median time |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for drive in DRIVES {
        let name = format!("{drive:?}").to_lowercase();
        if only.as_ref().is_none_or(|only| *only == name) {
            let mut tally = Tally::default();
            (0..seeds).for_each(|seed| tally.take(&machine::case(1000 + seed, drive)));
            println!("| {name} | {} |", tally.cells());
        }
    }
    ExitCode::SUCCESS
}
