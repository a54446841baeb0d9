//! `stillbeam apply`: identified modes onto a board's console.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use stillbeam_firmware::shaper::{KnownTypes, Mode, ShaperTable, ShaperType};
use stillbeam_firmware::units::TickRate;
use stillbeam_identify::UncertaintyBox;
use stillbeam_shape::{Crc32, ModeBox, parse_type, worst_over_box};

use crate::board::BoardTarget;
use crate::demo::board_setup::apply_shapers;
use crate::error::CliError;
use crate::identification::modes_file::ChosenModes;
use crate::outputs::keep_apart;
use crate::shaping::{BoxFloor, Tolerance, measured_box};
use crate::streams::{Streams, json_on_stdout};

/// Set identified modes on a board, over its console, and let it design and run their shaper.
///
/// MODES.json is what `stillbeam identify --json` wrote. Every mode gets the shortest of zv, zvd, zvdd and
/// zvddd that keeps its vibration below --tolerance anywhere in its uncertainty box (what was measured, and
/// no less than --box-floor), or the --type that is named. The board designs the taps itself; its CRC is
/// checked against the host's. A shaper for all modes at once is `shape --optimal` and `upload`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam apply modes.json --port /dev/ttyACM0 --use 1,2 --save
  stillbeam apply modes.json --port core --type zvdd --json -")]
pub struct ApplyArgs {
    /// The modes
    #[arg(value_name = "MODES.json")]
    modes: PathBuf,
    /// The serial port, core or qemu
    #[arg(long, visible_alias = "board", value_name = "PATH")]
    port: String,
    /// Which of the file's modes, counted from 1; by default all
    #[arg(long = "use", value_name = "N,N...", value_delimiter = ',')]
    chosen: Vec<usize>,
    #[arg(long = "type", value_name = "TYPE", help = format!("The shaper of every mode: {KnownTypes}; by default as robust as its box asks for"))]
    kind: Option<String>,
    #[command(flatten)]
    floor: BoxFloor,
    #[command(flatten)]
    tolerance: Tolerance,
    /// Store the settings in the board's flash
    #[arg(long)]
    save: bool,
    /// Write what was set as JSON to this file, or to standard output for -
    #[arg(long, value_name = "FILE")]
    json: Option<String>,
}

/// What was set.
#[derive(Debug, Serialize)]
struct Applied {
    schema_version: u32,
    rate_hz: f64,
    crc32: Crc32,
    modes: Vec<AppliedMode>,
}

/// One mode as set, and what its shaper leaves of it over its box.
#[derive(Debug, Serialize)]
struct AppliedMode {
    frequency_hz: f64,
    damping_ratio: f64,
    #[serde(rename = "type")]
    kind: &'static str,
    uncertainty_box: UncertaintyBox,
    worst_over_box: f64,
}

/// The types that are tried, shortest first.
const LADDER: [ShaperType; 4] = [ShaperType::Zv, ShaperType::Zvd, ShaperType::Zvdd, ShaperType::Zvddd];

impl ApplyArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        keep_apart([self.modes.as_path()], [self.json.as_deref()])?;
        let tolerance = self.tolerance.fraction()?;
        let kind = self.kind.as_deref().map(parse_type).transpose()?;
        let chosen = ChosenModes::read(&self.modes, &self.chosen)?;
        chosen.remarks().iter().for_each(|remark| streams.say(remark));
        let floor = self.floor.spread()?;
        let boxes: Vec<ModeBox> =
            chosen.filed.iter().map(|mode| measured_box(mode, floor)).collect::<Result<_, _>>()?;
        let mut session = BoardTarget::parse(&self.port).connect(&mut |line| streams.say(line))?;
        let rate_hz = session.tick_hz()?;
        let modes: Vec<Mode> = (0..boxes.len())
            .map(|index| self.mode(&chosen, index, &boxes[index], kind, rate_hz))
            .collect::<Result<_, _>>()?;
        let table = table(&modes, rate_hz)?;
        session.command("set shaper.source designed")?;
        let crc32 = apply_shapers(&mut session, &modes)?;
        if crc32 != Crc32(table.crc32()) {
            return Err(CliError::Internal(format!(
                "the board designed a table with CRC {crc32}, the host one with {}",
                Crc32(table.crc32())
            )));
        }
        if self.save {
            session.command_when_ready("save")?;
        }
        let applied = Applied {
            schema_version: 1,
            rate_hz,
            crc32,
            modes: modes
                .iter()
                .zip(&boxes)
                .map(|(mode, area)| AppliedMode {
                    frequency_hz: mode.frequency_hz(),
                    damping_ratio: mode.damping_ratio(),
                    kind: mode.shaper().name(),
                    uncertainty_box: UncertaintyBox {
                        frequency_hz: area.frequency_hz(),
                        damping_ratio: area.damping_ratio(),
                    },
                    worst_over_box: worst_over_box(&table, area),
                })
                .collect(),
        };
        for mode in applied.modes.iter().filter(|mode| mode.worst_over_box > tolerance) {
            streams.say(&format!(
                "the mode at {:.4} Hz may keep {:.1} % of its vibration somewhere in its box; `stillbeam shape --optimal --box {}` designs for the box",
                mode.frequency_hz,
                100.0 * mode.worst_over_box,
                self.modes.display()
            ));
        }
        if !json_on_stdout(self.json.as_deref()) {
            print(&applied, streams)?;
        }
        self.json.as_ref().map_or(Ok(()), |file| streams.write_json(file, &applied))
    }

    /// The mode with the type that was asked for, or the shortest that is robust enough, or the most robust.
    fn mode(
        &self,
        chosen: &ChosenModes,
        index: usize,
        area: &ModeBox,
        asked: Option<ShaperType>,
        rate_hz: f64,
    ) -> Result<Mode, CliError> {
        let alone = ChosenModes { filed: vec![chosen.filed[index].clone()] };
        let typed = |kind| -> Result<Mode, CliError> { Ok(alone.shaped(kind)?[0]) };
        if let Some(kind) = asked {
            return typed(kind);
        }
        let mut last = typed(LADDER[0])?;
        for kind in LADDER {
            last = typed(kind)?;
            // The other modes' stages take away more, never less.
            if worst_over_box(&table(&[last], rate_hz)?, area) <= self.tolerance.fraction()? {
                break;
            }
        }
        Ok(last)
    }
}

fn table(modes: &[Mode], rate_hz: f64) -> Result<ShaperTable, CliError> {
    let rate = TickRate::from_hz(rate_hz)
        .ok_or_else(|| CliError::Internal(format!("the board ticks at {rate_hz} Hz")))?;
    ShaperTable::design(modes, rate).map_err(|error| CliError::Usage(error.to_string()))
}

fn print(applied: &Applied, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let out = &mut streams.out;
    writeln!(
        out,
        "{:>4}{:>16}{:>15}  {:<6}{:>26}{:>18}",
        "mode", "frequency (Hz)", "damping ratio", "type", "box (Hz)", "worst over it (%)"
    )?;
    for (number, mode) in (1..).zip(&applied.modes) {
        let [low, high] = mode.uncertainty_box.frequency_hz;
        writeln!(
            out,
            "{number:>4}{:>16.5}{:>15.6}  {:<6}{:>26}{:>18.4}",
            mode.frequency_hz,
            mode.damping_ratio,
            mode.kind,
            format!("{low:.5} to {high:.5}"),
            100.0 * mode.worst_over_box
        )?;
    }
    writeln!(out, "crc32={} rate_hz={}", applied.crc32, applied.rate_hz)?;
    Ok(())
}
