//! `stillbeam upload`: a table of `stillbeam shape --json`, or a plan of `stillbeam plan --json`, on the
//! board.

use std::path::PathBuf;

use clap::Args;
use stillbeam_shape::{BoardPlan, BoardTable};

use crate::board::BoardTarget;
use crate::error::CliError;
use crate::streams::Streams;

/// Send a shaper table to a board and let it run, or a plan that it can play.
///
/// FILE.json of a table is what `stillbeam shape --json` writes: the stages of a cascade, or one flat stage
/// with up to 64 taps. It is taken at rest or in the middle of a move, without a jump, and replaces the
/// shaper of the modes until `set shaper.source designed`. The board keeps it across a reset with --save.
/// FILE.json of a plan is what `stillbeam plan --json` writes: the board plays it at `play` and forgets it at
/// a reset.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam shape --mode 1.1,0.0074,zvd --rate 4000 --json table.json
  stillbeam upload table.json --port /dev/ttyACM0 --save
  stillbeam plan --distance 50 --box modes.json --json plan.json && stillbeam upload plan.json --port /dev/ttyACM0")]
pub struct UploadArgs {
    /// The table or the plan
    #[arg(value_name = "FILE.json")]
    table: PathBuf,
    /// The serial port, core or qemu
    #[arg(long, visible_alias = "board", value_name = "PATH")]
    port: String,
    /// Store the table, with all settings that run, in the board's flash
    #[arg(long)]
    save: bool,
}

impl UploadArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        if let Some(plan) = BoardPlan::read(&self.table)? {
            if self.save {
                return Err(CliError::Usage(
                    "--save stores tables; a plan is for one session, leave --save out".to_owned(),
                ));
            }
            return send_plan(&plan, &self.port, streams);
        }
        let table = BoardTable::read(&self.table)?;
        let mut session = BoardTarget::parse(&self.port).connect(&mut |line| streams.say(line))?;
        let crc32 = session.upload_table(&table)?;
        if self.save {
            session.command_when_ready("save")?;
        }
        let info = session.command("info")?;
        if info.line("shaper") == Some("off") {
            streams.say("the shaper is off; `shaper on` lets the table run");
        }
        let repeated = session.repeated();
        if repeated > 0 {
            streams.say(&format!("the line damaged {repeated} command(s) or replies, which were sent again"));
        }
        let taps: usize = table.table.stages().map(|stage| stage.taps().len()).sum();
        writeln!(
            streams.out,
            "crc32={crc32} stages={} taps={taps} duration_s={:.6} delay_s={:.6}",
            table.table.stages().len(),
            table.table.duration_s(),
            table.table.delay_s()
        )?;
        Ok(())
    }
}

/// Sends a plan to the board at `port` and says what it has then.
pub(super) fn send_plan(plan: &BoardPlan, port: &str, streams: &mut Streams<'_>) -> Result<(), CliError> {
    let mut session = BoardTarget::parse(port).connect(&mut |line| streams.say(line))?;
    let crc32 = session.upload_plan(plan)?;
    let shown = session.command("plan show")?;
    let line = |key| shown.line(key).unwrap_or_default().to_owned();
    streams.say(&format!(
        "on the board: plan {crc32}, {} pieces, {} ms, {} nm; `play` plays it from where the machine is, `play back` the way back",
        line("plan_pieces"),
        line("plan_duration_ms"),
        line("plan_distance_nm")
    ));
    Ok(())
}
