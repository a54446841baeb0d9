//! Makes docs/results/identification.md:
//!
//! ```text
//! cargo run --profile host -p stillbeam-identify --example identification_results > docs/results/identification.md
//! ```
//!
//! With `STILLBEAM_SEEDS` fewer noise realisations than 300 are made, for a quick look. With
//! `STILLBEAM_ONLY=speed` or `STILLBEAM_ONLY=free-base` only that section is made: times change from run to
//! run, and are worth something only while the machine has nothing else to do.

#[path = "../../tests/synthetic/mod.rs"]
mod synthetic;

mod free_base;
mod paper_sweeps;
mod real;
mod simulated;
mod speed;

use std::process::ExitCode;

use stillbeam_identify::IdentifyError;

fn main() -> ExitCode {
    match page() {
        Ok(page) => {
            println!("{page}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn page() -> Result<String, IdentifyError> {
    let seeds = std::env::var("STILLBEAM_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(300);
    match std::env::var("STILLBEAM_ONLY").as_deref() {
        Ok("speed") => return speed::times(),
        Ok("free-base") => return free_base::against_the_bound(seeds.min(FREE_BASE_SEEDS)),
        _ => {}
    }
    let parts = [
        HEAD.to_owned(),
        simulated::accuracy()?,
        simulated::coverage(seeds)?,
        free_base::against_the_bound(seeds.min(FREE_BASE_SEEDS))?,
        paper_sweeps::spread()?,
        real::cantilever()?,
        real::belts()?,
        real::circuit()?,
        speed::times()?,
    ];
    Ok(parts.join("\n"))
}

/// Noise realisations of the base with friction: their rms scatters by an eighth.
const FREE_BASE_SEEDS: u64 = 32;

const HEAD: &str = "# What identification finds

Made by `cargo run --profile host -p stillbeam-identify --example identification_results > docs/results/identification.md`.
Simulated records are integrated by Runge-Kutta steps of the modal equations, independent of the code under test; noise is
white and seeded. Sections on real recordings are made only where the folder of recordings is present (`../shared/data`, or
`STILLBEAM_DATA`); the recordings are not part of this repository.
";
