//! The concealed-physics bench on the tool as it is.

use crate::cargo::cargo;
use crate::failure::Failure;
use crate::run::run;

/// What the test command asks for: one round of every kind. Ratchets: raise them when the tool does better.
/// It answers 18 rightly and gives no wrong name (16 and one in 30 s a case, where time ends the search
/// before it has looked for what would do as well); six may be lost to a slower computer.
///
/// A case has a limit of processor time, so a busy computer changes no mark.
const SUBSET: [&str; 12] = [
    "--cases",
    "20",
    // Twice the slowest case that is answered in 20 s: a slower processor changes no mark either.
    "--limit",
    "40",
    "--out",
    "target/prove-subset",
    "--page",
    "target/prove-subset/page.md",
    "--least-right",
    "12",
    "--most-wrong",
    "1",
];

/// Builds tool and bench, and runs the bench with these options (docs/results/proof.md).
pub fn prove(options: &[&str]) -> Result<(), Failure> {
    bench("stillbeam-prove", options)
}

/// The same of machines of which nothing is left out.
pub fn nulls(options: &[&str]) -> Result<(), Failure> {
    bench("stillbeam-nulls", options)
}

fn bench(program: &str, options: &[&str]) -> Result<(), Failure> {
    let built = ["--profile", "host", "--quiet"];
    // The bench looks for the tool beside itself.
    run(cargo().arg("build").args(built).args([
        "--package",
        "stillbeam",
        "--package",
        "stillbeam-concealed",
    ]))?;
    let chosen = ["--package", "stillbeam-concealed", "--bin", program, "--"];
    run(cargo().arg("run").args(built).args(chosen).args(options))
}

/// Twenty cases, two of them at a time.
pub fn subset() -> Result<(), Failure> {
    prove(&SUBSET)
}
