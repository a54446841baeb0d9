//! The durations that were to be reached, one row each.

use std::error::Error;
use std::fmt::Write;
use std::time::Instant;

use stillbeam_firmware::shaper::ShaperTable;
use stillbeam_shape::{OptimalRequest, ShaperDesign, TableCost};

use super::board_check::Checked;
use super::{RATE_HZ, boxes};

/// Tolerance, fraction of the box, textbook shapers, and the duration that a plain linear programme on a grid
/// of 4 ms has, for boxes of frequency alone.
const ROWS: [(f64, f64, &str, f64); 7] = [
    (0.0, 0.0, "ZV × ZV 0.527 s", 0.495),
    (0.05, 0.05, "ZVD × ZVD 1.054 s (0.57 %)", 0.71),
    (0.02, 0.05, "ZVD × ZVD 1.054 s (0.57 %)", 0.893),
    (0.0057, 0.05, "ZVD × ZVD 1.054 s (0.57 %)", 0.977),
    (0.05, 0.10, "ZVD × ZVD 1.054 s (2.3 %)", 0.868),
    (0.0035, 0.10, "ZVDD × ZVDD 1.581 s", 1.35),
    (0.0004, 0.05, "ZVDD × ZVDD 1.581 s", 1.413),
];

/// Repetitions of which the median time is given.
const TIMED: usize = 5;

fn request(tolerance: f64, frequency: f64, damping: f64) -> Result<OptimalRequest, Box<dyn Error>> {
    let modes = boxes(frequency, damping)?;
    Ok(OptimalRequest { modes, rate_hz: RATE_HZ, tolerance, negative_limit: 0.0, longest_s: None })
}

fn taps(table: &ShaperTable) -> usize {
    table.stages().map(|stage| stage.taps().len()).sum()
}

/// The table of durations, with what proves and verifies each.
pub(super) fn section(board: &str) -> Result<String, Box<dyn Error>> {
    let mut durations = String::from(
        "## Durations\n\n\
         The box is ± that much of frequency (left) or of both frequency and damping ratio (right). \"Known\": a plain linear programme on a\n\
         grid of 4 ms, frequency alone. \"One tick less\": what every shaper that is 0.25 ms shorter leaves of some mode in its box, proven by the\n\
         multipliers of the solution over all ticks. The solver aims at the tolerance less 0.004 % of itself, for rounding; what is more than that proves\n\
         that nothing shorter exists.\n\n\
         | tolerance, box | textbook | known (s) | frequency alone (s) | one tick less | both (s) | one tick less | taps | RAM (bytes) | instructions | time (s) |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut verified = format!(
        "## Verified\n\n\
         Boxes of both. \"Grid\": the largest residual of the integer taps over a grid on the boxes' edges 100 times finer than the first\n\
         constraints'. \"Moved\": the table uploaded to the board (`{board}`), which moves 50 mm; the setpoints it streamed are the host's bit by bit, and drive a\n\
         simulated pair of modes at 45 places of the boxes; the largest residual of either mode.\n\n\
         | tolerance, box | CRC | sum of weights | grid, each mode (%) | moved, each mode (%) | setpoints compared |\n\
         |---|---|---|---|---|---|\n"
    );
    let mut missed = Vec::new();
    for (tolerance, fraction, textbook, known_s) in ROWS {
        let name = format!("{} %, ±{} %", round(100.0 * tolerance), round(100.0 * fraction));
        let alone = request(tolerance, fraction, 0.0)?.solve()?;
        let asked = request(tolerance, fraction, fraction)?;
        let mut times_s = Vec::new();
        let mut both = asked.solve()?;
        for _ in 0..TIMED {
            let started = Instant::now();
            both = asked.solve()?;
            times_s.push(started.elapsed().as_secs_f64());
        }
        times_s.sort_by(f64::total_cmp);
        let cost = TableCost::of(&both.table);
        writeln!(
            durations,
            "| {name} | {textbook} | {known_s} | {:.5} | {:.5} % | {:.5} | {:.5} % | {} | {} | {} | {:.2} |",
            alone.table.duration_s(),
            100.0 * alone.bound_one_tick_less,
            both.table.duration_s(),
            100.0 * both.bound_one_tick_less,
            cost.taps,
            cost.ram_bytes,
            cost.instructions,
            times_s[TIMED / 2]
        )?;
        if alone.table.duration_s() > known_s + 1.0 / RATE_HZ {
            missed.push(format!("{name}: {:.5} s where {known_s} s was known", alone.table.duration_s()));
        }
        let design = ShaperDesign::optimal(&both);
        let checked = Checked::on(board, &design, &both.table, &asked.modes)?;
        let percent = |values: &[f64]| {
            let values: Vec<String> = values.iter().map(|value| format!("{:.5}", 100.0 * value)).collect();
            values.join(" · ")
        };
        let sum: i64 =
            both.table.stages().flat_map(|stage| stage.taps()).map(|tap| i64::from(tap.weight)).sum();
        writeln!(
            verified,
            "| {name} | {} | {sum} | {} | {} | {} |",
            design.crc32,
            percent(&both.worst_over_box),
            percent(&checked.worst),
            checked.compared
        )?;
    }
    let missed = if missed.is_empty() {
        "Every known duration is reached within one tick.\n".to_owned()
    } else {
        format!(
            "Not reached within one tick: {}. The proof beside it holds for every shaper at 4 kHz, so the known figure is rounded (1.352 s is 338 steps\n\
             of 4 ms) or meets the tolerance only between fewer frequencies.\n",
            missed.join("; ")
        )
    };
    Ok(format!(
        "{durations}\n{missed}Times: median of {TIMED} on one core, wall clock; instructions per tick beyond those without a table.\n\n{verified}"
    ))
}

/// Shorter with negative weights.
pub(super) fn negative_section() -> Result<String, Box<dyn Error>> {
    let mut text = String::from(
        "## Negative weights\n\n\
         2 %, ±5 % of both. The limit is what the negative weights may sum to; the setpoint's velocity and acceleration are at most 1 + 2 limit times the\n\
         command's, and the board plans its moves slower by that. Move: 50 mm on the board's own limits (500 mm/s, 5 m/s²).\n\n\
         | limit | duration (s) | taps | magnitudes sum to | move (s) | velocity (mm/s) | acceleration (mm/s²) |\n|---|---|---|---|---|---|---|\n",
    );
    for negative_limit in [0.0, 0.1, 0.2, 0.5, 1.0] {
        let shaper = OptimalRequest { negative_limit, ..request(0.02, 0.05, 0.05)? }.solve()?;
        let tried = stillbeam::shaping::MoveCheck::of(&shaper.table)?;
        writeln!(
            text,
            "| {negative_limit} | {:.5} | {} | {:.4} | {:.4} | {:.1} | {:.0} |",
            shaper.table.duration_s(),
            taps(&shaper.table),
            shaper.table.absolute_gain(),
            tried.duration_s,
            tried.velocity_mm_s,
            tried.acceleration_mm_s2
        )?;
    }
    Ok(text)
}

/// Without the last digits that binary fractions have.
fn round(value: f64) -> f64 {
    (1e6 * value).round() / 1e6
}
