//! `stillbeam shape`: from modes to a table.

use std::path::PathBuf;

use clap::Args;
use stillbeam_firmware::machine::TIMER_CLOCK_HZ;
use stillbeam_firmware::shaper::{KnownTypes, Mode, ShaperType};
use stillbeam_firmware::units::TickRate;
use stillbeam_shape::{DEFAULT_TYPE, DesignOptions, ShaperDesign, parse_mode, parse_type};

use crate::error::CliError;
use crate::identification::modes_file::ChosenModes;
use crate::outputs::keep_apart;
use crate::report::shape_page::shape_page;
use crate::streams::{Streams, json_on_stdout};

/// Design a shaper: one stage per mode, exactly as the board runs it.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam shape --mode 1.1,0.0074,zvd --mode 6.9,0.0059,zvd --rate 4000 --json table.json
  stillbeam shape --modes-from out/demo/modes.json --use 1,2 --type zvdd --json -")]
pub struct ShapeArgs {
    #[arg(
        long = "mode",
        value_name = "F_HZ,ZETA[,TYPE]",
        allow_hyphen_values = true,
        help = format!("A mode: undamped frequency in Hz, damping ratio, and {KnownTypes}; may be repeated")
    )]
    modes: Vec<String>,
    /// Take the modes from what `identify --json` wrote
    #[arg(long, value_name = "FILE", conflicts_with = "modes")]
    modes_from: Option<PathBuf>,
    /// Which of them, counted from 1; by default all
    #[arg(long = "use", value_name = "N,N...", value_delimiter = ',', requires = "modes_from")]
    chosen: Vec<usize>,
    #[arg(
        long = "type",
        value_name = "TYPE",
        default_value_t = DEFAULT_TYPE.name().to_owned(),
        help = format!("The shaper of modes that name none: {KnownTypes}")
    )]
    kind: String,
    /// Ticks per second; the board runs the nearest rate that divides its timer clock
    #[arg(long, default_value_t = 4000.0, value_name = "HZ", allow_negative_numbers = true)]
    rate: f64,
    /// Judge the worst case with frequencies off by up to this many percent
    #[arg(long = "box", default_value_t = 5.0, value_name = "PERCENT", allow_negative_numbers = true)]
    box_percent: f64,
    /// Write the table as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
    /// Write a report to this file
    #[arg(long, value_name = "FILE.html")]
    report: Option<String>,
}

impl ShapeArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart(self.modes_from.as_deref(), [self.json.as_deref(), self.report.as_deref()])?;
        let kind = parse_type(&self.kind)?;
        let modes = self.modes(kind)?;
        let frequency_box = self.box_percent / 100.0;
        let rate_hz = self.board_rate_hz(streams);
        let design = ShaperDesign::new(&modes, rate_hz, &DesignOptions { frequency_box })?;
        if !json_on_stdout(self.json.as_deref()) {
            self.print(&design, streams)?;
        }
        if let Some(file) = &self.json {
            streams.write_text(file, &design.to_json())?;
        }
        if let Some(file) = &self.report {
            let table = design.table().map_err(|error| CliError::Internal(error.to_string()))?;
            streams.write_text(file, &shape_page(&design, &table, frequency_box))?;
        }
        Ok(())
    }

    /// The rate that the board runs when it is asked for this one, so that its table is the same to the bit. A rate that
    /// no board takes is left for the design to refuse.
    fn board_rate_hz(&self, streams: &mut Streams<'_>) -> f64 {
        let Some(wanted) = TickRate::from_hz(self.rate) else { return self.rate };
        let attainable_hz = wanted.attainable(TIMER_CLOCK_HZ).hz();
        if attainable_hz != self.rate {
            streams.say(&format!(
                "the board's timer runs {attainable_hz} Hz for {} Hz; designed for that",
                self.rate
            ));
        }
        attainable_hz
    }

    fn modes(&self, kind: ShaperType) -> Result<Vec<Mode>, CliError> {
        if let Some(file) = &self.modes_from {
            return ChosenModes::read(file, &self.chosen)?.shaped(kind);
        }
        let modes = self.modes.iter().map(|spec| {
            let complete =
                if spec.matches(',').count() == 1 { format!("{spec},{kind}") } else { spec.clone() };
            parse_mode(&complete).map_err(CliError::from)
        });
        modes.collect()
    }

    fn print(&self, design: &ShaperDesign, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let out = &mut streams.out;
        writeln!(out, "rate      {} Hz", design.rate_hz)?;
        writeln!(out, "duration  {:.4} s", design.duration_s)?;
        writeln!(out, "delay     {:.4} s", design.delay_s)?;
        writeln!(out, "crc32     {}", design.crc32)?;
        let worst = format!("worst ±{} % (%)", self.box_percent);
        writeln!(
            out,
            "\n{:>4}{:>16}{:>15}  {:<5}{:>5}{:>14}{worst:>18}",
            "mode", "frequency (Hz)", "damping ratio", "type", "taps", "nominal (%)"
        )?;
        let residuals = design.residual.nominal.iter().zip(&design.residual.worst_over_box);
        for (number, (stage, (nominal, worst))) in (1..).zip(design.stages.iter().zip(residuals)) {
            writeln!(
                out,
                "{number:>4}{:>16.5}{:>15.6}  {:<5}{:>5}{:>14.6}{:>18.4}",
                stage.frequency_hz,
                stage.damping_ratio,
                stage.shaper.name(),
                stage.taps.len(),
                100.0 * nominal,
                100.0 * worst
            )?;
        }
        Ok(())
    }
}
