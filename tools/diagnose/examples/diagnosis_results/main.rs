//! Results page of the diagnosis, made by one command and continued where it was stopped: `cargo
//! run --profile host -p stillbeam-diagnose --example diagnosis_results -- keep=FILE >
//! docs/results/diagnosis.md`
//!
//! Arguments: parts to run (`null laws composites left-out absorbed`, all if none is named), `seeds=N`,
//! `from=N`, `db=30,45`, `times=3,30`, `only=ID`, `keep=FILE` (finished cases, one a line, which are not run
//! again).

mod cases;
mod page;
mod parts;
mod score;
mod sizes;
#[path = "../../tests/truth/mod.rs"]
mod truth;

use parts::Plan;

fn main() {
    let plan = Plan::from_arguments(std::env::args().skip(1));
    let done = parts::run(&plan);
    print!("{}", page::page(&plan, &done));
}
