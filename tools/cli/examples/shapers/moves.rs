//! Whole moves beside shaped ones.

use std::error::Error;
use std::fmt::Write;
use std::time::Instant;

use stillbeam::shaping::compare_moves;
use stillbeam_shape::{MoveBounds, MoveRequest};

use super::board_check::{Checked, played};
use super::{RATE_HZ, boxes};

/// Distance in m, velocity, acceleration, jerk in m/s, m/s², m/s³.
const MOVES: [(f64, [f64; 3]); 3] =
    [(0.05, [0.5, 5.0, 1000.0]), (0.005, [0.05, 0.5, 10.0]), (0.2, [0.5, 5.0, 100.0])];

/// The comparison.
pub(super) fn section(board: &str) -> Result<String, Box<dyn Error>> {
    let mut text = String::from(
        "## Whole moves\n\n\
         2 % of what a step of the distance leaves, ±5 % of both frequency and damping ratio. Duration in s, and in brackets the worst residual of each mode in %. The S-curves are the\n\
         firmware's in its integers. \"Quickest\" leaves vibration out of account: the bound of every move, to the 0.1 % that the pieces cost. The whole move obeys the same limits of velocity, acceleration and\n\
         jerk; \"going back\" may reverse and pass its end within them. Commands have 160 pieces of constant jerk, which are uploaded to the board and played by it at `play`.\n\n\
         | distance, limits | quickest | S-curve | S-curve, ZVD × ZVD | S-curve, shortest shaper | whole move | going back | time (s) |\n|---|---|---|---|---|---|---|---|\n",
    );
    let mut by_board = String::new();
    for (distance_m, [velocity_m_s, acceleration_m_s2, jerk_m_s3]) in MOVES {
        let request = MoveRequest {
            distance_m,
            bounds: MoveBounds { velocity_m_s, acceleration_m_s2, jerk_m_s3 },
            reversing: true,
            modes: boxes(0.05, 0.05)?,
            tolerance: 0.02,
            rate_hz: RATE_HZ,
        };
        let started = Instant::now();
        let onwards = MoveRequest { reversing: false, ..request.clone() }.solve()?;
        let time_s = started.elapsed().as_secs_f64();
        let (reversing, moves) = compare_moves(&request)?;
        for (way, planned) in [("whole move", &onwards), ("going back", &reversing)] {
            let Checked { worst, compared } = played(board, planned, request.bounds, &request.modes)?;
            let worst: Vec<String> = worst.iter().map(|worst| format!("{:.2}", 100.0 * worst)).collect();
            writeln!(
                by_board,
                "| {} mm, {way} | {:.4} | {} | {} | {compared} | {} |",
                1e3 * distance_m,
                planned.duration_s(),
                planned.plan.pieces.len(),
                planned.plan.bytes().len(),
                worst.join(", ")
            )?;
        }
        write!(
            text,
            "| {} mm, {} mm/s, {} m/s², {} m/s³ |",
            1e3 * distance_m,
            1e3 * velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3
        )?;
        for compared in &moves {
            let worst: Vec<String> =
                compared.worst_over_box.iter().map(|worst| format!("{:.2}", 100.0 * worst)).collect();
            write!(text, " {:.4} ({}) |", compared.duration_s, worst.join(", "))?;
        }
        writeln!(text, " {time_s:.2} |")?;
    }
    write!(
        text,
        "\nTime: one solution of the whole move, wall clock, one core.\n\n\
         Played by the board (`{board}`): every streamed setpoint, one in four ticks, is the host's bit by bit, and modes at 45 places of each box, simulated, keep at most (%):\n\n\
         | move | duration (s) | pieces | bytes | setpoints compared | left of the modes |\n|---|---|---|---|---|---|\n{by_board}"
    )?;
    Ok(text)
}
