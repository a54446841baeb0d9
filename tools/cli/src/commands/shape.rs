//! `stillbeam shape`: from modes to a table.

use std::path::PathBuf;

use clap::Args;
use stillbeam_shape::{DEFAULT_TYPE, KnownStageTypes, OptimalRequest, ShaperDesign, StageType};

use crate::error::CliError;
use crate::outputs::keep_apart;
use crate::report::shape_page::{Purpose, shape_page};
use crate::shaping::{Candidate, MachineLimits, ModeSelection, Task, board_rate_hz, candidates};
use crate::streams::{Streams, json_on_stdout};

/// Design a shaper, exactly as the board runs it: one stage per mode, or the shortest for all modes at once.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam shape --mode 1.1,0.0074,zvd --mode 6.9,0.0059,zvd --rate 4000 --json table.json
  stillbeam shape --modes-from out/demo/modes.json --use 1,2 --type zvdd --json -
  stillbeam shape --optimal --tolerance 0.02 --box modes.json --json table.json
  stillbeam shape --optimal --mode 1.1,0.0074 --mode 6.9,0.0033 --box 5% --report shaper.html")]
pub struct ShapeArgs {
    #[command(flatten)]
    modes: ModeSelection,
    #[arg(
        long = "type",
        value_name = "TYPE",
        default_value_t = DEFAULT_TYPE.name().to_owned(),
        help = format!("The shaper of modes that name none: {KnownStageTypes}")
    )]
    kind: String,
    /// Solve for the shortest shaper that holds the tolerance for every mode anywhere in its box
    #[arg(long)]
    optimal: bool,
    /// With --optimal: the most vibration that any mode may keep, as a fraction of the unshaped command's
    #[arg(
        long,
        value_name = "FRACTION",
        default_value_t = 0.02,
        requires = "optimal",
        allow_negative_numbers = true
    )]
    tolerance: f64,
    /// With --optimal: let negative weights sum to up to this; the setpoint may become faster than the
    /// command by 1 + 2 of it, so the machine's limits are checked
    #[arg(long, value_name = "LIMIT", requires = "optimal", allow_negative_numbers = true)]
    allow_negative: Option<f64>,
    /// What the machine can do, in mm/s and mm/s²; by default the limits that the board's settings come with
    #[arg(long, value_name = "VELOCITY,ACCELERATION", requires = "allow_negative")]
    machine_limits: Option<String>,
    /// What the commands ask for at most; without it the board is taken to plan its moves, which it then
    /// slows itself
    #[arg(long, value_name = "VELOCITY,ACCELERATION", requires = "allow_negative")]
    command_limits: Option<String>,
    /// With --optimal: the longest shaper, in seconds; by default what fits into the board's memory
    #[arg(long, value_name = "SECONDS", requires = "optimal", allow_negative_numbers = true)]
    longest: Option<f64>,
    /// Ticks per second; the board runs the nearest rate that divides its timer clock
    #[arg(long, default_value_t = 4000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate: f64,
    /// Write the table as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
}

impl ShapeArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let kind: StageType = self.kind.parse()?;
        if kind == StageType::Optimal {
            return Err(CliError::Usage(
                "--type optimal: say --optimal; it is one shaper for all modes".to_owned(),
            ));
        }
        let inputs = self.modes.files();
        let inputs = inputs.iter().map(PathBuf::as_path);
        keep_apart(inputs, [self.json.as_deref(), self.report.as_deref()])?;
        let task = self.modes.task(kind)?;
        task.remarks.iter().for_each(|remark| streams.say(remark));
        let rate_hz = board_rate_hz(self.rate, streams);
        let design = if self.optimal {
            self.solve(&task, rate_hz, streams)?
        } else {
            ShaperDesign::cascade(&task.plans, rate_hz, &task.boxes)?
        };
        if !json_on_stdout(self.json.as_deref()) {
            print(&design, &task, streams)?;
        }
        if let Some(file) = &self.json {
            streams.write_text(file, &design.to_json())?;
        }
        if let Some(file) = &self.report {
            let others = candidates(&task.boxes, design.rate_hz, self.tolerance);
            let own = Candidate::new("this one", design);
            let own = own.map_err(|error| CliError::Internal(error.to_string()))?;
            let purpose = Purpose {
                boxes: &task.boxes,
                described: &task.described,
                tolerance: self.tolerance,
                reasons: &[],
            };
            streams.write_text(file, &shape_page(&own, others, &purpose))?;
        }
        Ok(())
    }

    fn solve(&self, task: &Task, rate_hz: f64, streams: &mut Streams<'_>) -> Result<ShaperDesign, CliError> {
        let parsed = |text: &Option<String>| text.as_deref().map(str::parse::<MachineLimits>).transpose();
        let machine = parsed(&self.machine_limits)?.unwrap_or_default();
        let command = parsed(&self.command_limits)?;
        let request = OptimalRequest {
            modes: task.boxes.clone(),
            rate_hz,
            tolerance: self.tolerance,
            negative_limit: self.allow_negative.unwrap_or(0.0),
            longest_s: self.longest,
        };
        let shaper = request.solve()?;
        if self.allow_negative.is_some_and(|limit| limit > 0.0) {
            let gain = shaper.table.absolute_gain();
            let checked = machine.check(&shaper.table, command.as_ref())?;
            streams.say(&match checked {
                Some(tried) => format!(
                    "magnitudes of the weights sum to {gain:.4}, so the board plans its moves that much slower; its 50 mm move \
                     takes {:.3} s, reaches {:.1} mm/s and {:.0} mm/s²",
                    tried.duration_s, tried.velocity_mm_s, tried.acceleration_mm_s2
                ),
                None => format!("magnitudes of the weights sum to {gain:.4}: within the machine's limits"),
            });
        }
        Ok(ShaperDesign::optimal(&shaper))
    }
}

fn print(design: &ShaperDesign, task: &Task, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(out, "rate      {} Hz", design.rate_hz)?;
    writeln!(out, "duration  {:.5} s", design.duration_s)?;
    writeln!(out, "delay     {:.5} s", design.delay_s)?;
    writeln!(out, "crc32     {}", design.crc32)?;
    writeln!(out, "boxes     {}", task.described)?;
    if let Some(optimal) = &design.optimal {
        let taps: usize = design.stages.iter().map(|stage| stage.taps.len()).sum();
        writeln!(out, "optimal   one stage of {taps} taps for {} % in every box", 100.0 * optimal.tolerance)?;
        writeln!(
            out,
            "proof     one tick less leaves at least {:.5} %",
            100.0 * optimal.bound_one_tick_less
        )?;
    }
    writeln!(
        out,
        "\n{:>4}{:>16}{:>15}  {:<9}{:>5}{:>14}{:>16}",
        "mode", "frequency (Hz)", "damping ratio", "type", "taps", "nominal (%)", "worst (%)"
    )?;
    let residuals = design.residual.nominal.iter().zip(&design.residual.worst_over_box);
    for (index, (area, (nominal, worst))) in task.boxes.iter().zip(residuals).enumerate() {
        // A flat stage is for all modes: its taps are counted above.
        let own = design.stages.get(index).filter(|stage| stage.frequency_hz.is_some());
        let kind = own.map_or_else(|| "all".to_owned(), |stage| stage.shaper.to_string());
        let taps = own.map_or_else(String::new, |stage| stage.taps.len().to_string());
        writeln!(
            out,
            "{:>4}{:>16.5}{:>15.6}  {kind:<9}{taps:>5}{:>14.6}{:>16.4}",
            index + 1,
            area.nominal_hz(),
            area.nominal_damping_ratio(),
            100.0 * nominal,
            100.0 * worst
        )?;
    }
    Ok(())
}
