//! libFuzzer on one of the targets: `STILLBEAM_FUZZ_TARGET=console stillbeam-fuzz -runs=1000 CORPUS`.

#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use stillbeam_fuzz::Target;

/// Names the target.
const VARIABLE: &str = "STILLBEAM_FUZZ_TARGET";

static TARGET: OnceLock<Target> = OnceLock::new();

fn chosen() -> Target {
    let name = std::env::var(VARIABLE).unwrap_or_default();
    Target::parse(&name).unwrap_or_else(|| {
        let names: Vec<&str> = Target::ALL.into_iter().map(Target::name).collect();
        eprintln!("{VARIABLE}={name}: set it to one of {}", names.join(", "));
        std::process::exit(2)
    })
}

fuzz_target!(|input: &[u8]| TARGET.get_or_init(chosen).run(input));
