//! Prints docs/results/shapers.md: `cargo run --profile host -p stillbeam --example shapers [core|qemu] >
//! docs/results/shapers.md`. With `picture` it prints docs/results/shapers.svg instead.
//!
//! Every table is uploaded to the board of that name (the firmware's core in this process, or the image in
//! the emulator), which moves 50 mm; each streamed setpoint must be the host's, bit by bit. So are whole
//! moves, which it plays.

mod board_check;
mod moves;
mod rows;

use stillbeam::report::shape_charts::pareto_chart;
use stillbeam::shaping::candidates;
use stillbeam_shape::ModeBox;

/// The rate of every table, Hz.
const RATE_HZ: f64 = 4000.0;

/// The two modes of the paper, damping ratios as measured on its testbed and assumed there.
const MODES: [(f64, f64); 2] = [(1.1, 0.0074), (6.9, 0.0033)];

fn boxes(frequency: f64, damping: f64) -> Result<Vec<ModeBox>, Box<dyn std::error::Error>> {
    let around = |(hz, zeta)| ModeBox::around(hz, zeta, frequency, damping);
    Ok(MODES.into_iter().map(around).collect::<Result<_, _>>()?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let board = std::env::args().nth(1).unwrap_or_else(|| "core".to_owned());
    if board == "picture" {
        print!("{}", picture()?);
        return Ok(());
    }
    let page = [
        "# Shapers for the uncertainty that was measured\n".to_owned(),
        format!(
            "Made by `cargo run --profile host -p stillbeam --example shapers {board} > docs/results/shapers.md`, the picture by `... --example shapers picture > docs/results/shapers.svg`.\n\
             Two modes, 1.1 Hz (damping ratio 0.0074) and 6.9 Hz (0.0033), at 4 kHz. Residual: vibration that is left, as a fraction of\n\
             what the unshaped command leaves (docs/derivations/shapers.md). Weights are not negative unless it says so.\n"
        ),
        rows::section(&board)?,
        rows::negative_section()?,
        moves::section(&board)?,
        SOLVERS.to_owned(),
    ];
    print!("{}", page.join("\n"));
    Ok(())
}

/// The least residual against duration and the textbook shapers, for 2 % and ±5 %.
fn picture() -> Result<String, Box<dyn std::error::Error>> {
    let (boxes, tolerance) = (boxes(0.05, 0.05)?, 0.02);
    let mut others = candidates(&boxes, RATE_HZ, tolerance);
    let own = others.pop().ok_or("no shaper")?;
    let chart = pareto_chart(&boxes, RATE_HZ, tolerance, &own, &others).ok_or("the solver gave up")?;
    Ok(chart.to_svg().replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1))
}

const SOLVERS: &str = "\
## The solver

Judged for shapers and moves: pure Rust (a fresh machine has rustup and git), maintenance, licence, multipliers, cones.

| crate | version | licence | builds with | multipliers | cones | |
|---|---|---|---|---|---|---|
| clarabel | 0.11.1 | Apache-2.0 | Rust alone | yes | second order | chosen: magnitudes need no polygon, and the multipliers price taps and prove bounds |
| microlp | 0.7.0 | Apache-2.0 | Rust alone | no | none | a simplex method; without multipliers all 4000 taps would have to be in the programme |
| highs (HiGHS) | 2.4.0 | MIT | CMake and a C++ compiler | yes | none | the strongest for linear programmes; the build asks too much of a fresh machine |
| good_lp | 1.15.3 | MIT | as its solver | some | none | a common front for the others; hides cones |

One duration as a plain linear programme (224 taps 4 ms apart, 34 modes of 16 facets; once, on a shared core): microlp 0.4 s, clarabel 1.3 s, the same
1.94157 %. With cones, and with only the taps and modes that the multipliers ask for, a duration at 0.25 ms takes clarabel some 10 to 50 ms.
";
