//! `stillbeam plan`: the shortest move that leaves the modes still.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use stillbeam_firmware::settings::Settings;
use stillbeam_firmware::shaper::ShaperType;
use stillbeam_recording::Recording;
use stillbeam_shape::{MoveBounds, MoveRequest, PlanEntry, StageType};

use super::upload::send_plan;
use crate::error::CliError;
use crate::length::Length;
use crate::outputs::keep_apart;
use crate::report::plan_page::plan_page;
use crate::shaping::{ComparedMove, ModeSelection, board_rate_hz, compare_moves};
use crate::streams::{Streams, json_on_stdout};

/// Plan the shortest move within limits that leaves every mode within a tolerance, wherever in its box it is.
///
/// The whole command is solved for, not a move and a shaper one after the other. It is written tick by tick
/// as a recording (`time_s, setpoint_m`), which `stillbeam simulate --input` takes, and sent to the board as
/// pieces of constant jerk, which it plays to the same nanometres: `play` in the console, or `stillbeam
/// record play`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam plan --distance 50mm --limits 500,5000,1e6 --mode 1.1,0.0074 --mode 6.9,0.0033 --box 5% --out move.csv
  stillbeam plan --distance 50mm --limits 500,5000,1e6 --box modes.json --upload /dev/ttyACM0
  stillbeam plan --distance 50mm --box modes.json --reversing --report move.html")]
pub struct PlanArgs {
    /// From rest to rest: 50mm, 5cm, 0.05m; a bare number is in mm
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true)]
    distance: Length,
    /// Largest velocity, acceleration and jerk in mm/s, mm/s² and mm/s³; by default those that the board's
    /// settings come with
    #[arg(long, value_name = "V,A,J")]
    limits: Option<String>,
    /// Let the command go backwards and past its end on the way
    #[arg(long)]
    reversing: bool,
    /// The most vibration that any mode may keep, as a fraction of what a step of the same distance leaves
    #[arg(long, value_name = "FRACTION", default_value_t = 0.02, allow_negative_numbers = true)]
    tolerance: f64,
    #[command(flatten)]
    modes: ModeSelection,
    /// Ticks per second; the board runs the nearest rate that divides its timer clock
    #[arg(long, default_value_t = 4000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate: f64,
    /// Write the setpoints to this file
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Send the plan to the board at this serial port (or core, or qemu), for `play`
    #[arg(long, value_name = "PORT")]
    upload: Option<String>,
    /// Write the plan and the comparison as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
}

#[derive(Serialize)]
struct Numbers<'n> {
    schema_version: u32,
    rate_hz: f64,
    tolerance: f64,
    plan: PlanEntry,
    moves: Vec<MoveNumbers<'n>>,
}

#[derive(Serialize)]
struct MoveNumbers<'n> {
    name: &'n str,
    duration_s: f64,
    worst_over_box: &'n [f64],
}

impl PlanArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let out = self.out.as_ref().map(|path| path.display().to_string());
        let files = self.modes.files();
        keep_apart(
            files.iter().map(PathBuf::as_path),
            [out.as_deref(), self.json.as_deref(), self.report.as_deref()],
        )?;
        let task = self.modes.task(StageType::Textbook(ShaperType::Zvd))?;
        task.remarks.iter().for_each(|remark| streams.say(remark));
        let request = MoveRequest {
            distance_m: self.distance.metres(),
            bounds: self.bounds()?,
            reversing: self.reversing,
            modes: task.boxes.clone(),
            tolerance: self.tolerance,
            rate_hz: board_rate_hz(self.rate, streams),
        };
        let (planned, moves) = compare_moves(&request)?;
        let numbers = Numbers {
            schema_version: 1,
            rate_hz: planned.rate_hz,
            tolerance: self.tolerance,
            plan: planned.plan.entry(),
            moves: moves.iter().map(MoveNumbers::of).collect(),
        };
        if json_on_stdout(self.json.as_deref()) {
            streams.write_json("-", &numbers)?;
        } else {
            print(&moves, &task.described, streams)?;
        }
        if let Some(file) = self.json.as_deref().filter(|file| *file != "-") {
            streams.write_json(file, &numbers)?;
        }
        if let Some(path) = &self.out {
            let time_s = (0..planned.positions_nm.len()).map(|tick| tick as f64 / planned.rate_hz).collect();
            let recording = Recording::new("planned move", time_s)
                .with_column("setpoint_m", planned.positions_m().collect());
            stillbeam_recording::write_csv(path, &recording)?;
            streams.say(&format!("wrote {}", path.display()));
        }
        if let Some(port) = &self.upload {
            send_plan(&planned.plan, port, streams)?;
        }
        if let Some(file) = &self.report {
            streams.write_text(file, &plan_page(&request, &moves, &task.described))?;
        }
        Ok(())
    }

    fn bounds(&self) -> Result<MoveBounds, CliError> {
        let Some(text) = &self.limits else {
            let limits = Settings::default().limits();
            return Ok(MoveBounds {
                velocity_m_s: 1e-3 * limits.velocity_mm_s,
                acceleration_m_s2: 1e-3 * limits.acceleration_mm_s2,
                jerk_m_s3: 1e-3 * limits.jerk_mm_s3,
            });
        };
        let numbers: Vec<Option<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
        match numbers.as_slice() {
            [Some(velocity), Some(acceleration), Some(jerk)] => Ok(MoveBounds {
                velocity_m_s: 1e-3 * velocity,
                acceleration_m_s2: 1e-3 * acceleration,
                jerk_m_s3: 1e-3 * jerk,
            }),
            _ => Err(CliError::Usage(format!(
                "--limits {text}: write VELOCITY,ACCELERATION,JERK in mm/s, mm/s² and mm/s³, such as 500,5000,1e6"
            ))),
        }
    }
}

impl<'n> MoveNumbers<'n> {
    fn of(compared: &'n ComparedMove) -> Self {
        Self {
            name: compared.name,
            duration_s: compared.duration_s,
            worst_over_box: &compared.worst_over_box,
        }
    }
}

fn print(moves: &[ComparedMove], described: &str, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "boxes     {described}")?;
    writeln!(out, "\n{:<46}{:>14}  worst of each mode (%)", "move", "duration (s)")?;
    for compared in moves {
        let worst: Vec<String> =
            compared.worst_over_box.iter().map(|worst| format!("{:.4}", 100.0 * worst)).collect();
        writeln!(out, "{:<46}{:>14.5}  {}", compared.name, compared.duration_s, worst.join("  "))?;
    }
    Ok(())
}
