//! `stillbeam live`: a board on a local page.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::board::in_process::InProcessBoard;
use crate::board::paced::PacedBoard;
use crate::board::{BoardTarget, ByteLink};
use crate::error::CliError;
use crate::live::{LiveOptions, serve};
use crate::streams::Streams;

/// Watch and move a board on a page of this computer.
///
/// Prints an address to open in a browser on this computer. The page shows setpoint, command, encoder and
/// inputs while they happen, and has a stop button (or Esc, or the space bar), enable and disable, moves, the
/// shaper with what it would leave, and the recording. Whoever has the address may watch and stop; the first
/// page that asks controls. The drive is off until somebody presses "enable". Ctrl-C ends: what a page has
/// moved is stopped, and a drive that a page has enabled is switched off.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam live
  stillbeam live --port /dev/ttyACM0 --out recordings")]
pub struct LiveArgs {
    /// The serial port, core or qemu
    #[arg(long, value_name = "PATH", default_value = "core")]
    port: String,
    /// The port of this computer to listen on; 0 for any that is free
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    listen: u16,
    /// The folder in which recordings are saved
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

impl LiveArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        if !self.out.is_dir() {
            let folder = self.out.display();
            return Err(CliError::Usage(format!("--out {folder}: there is no such folder; create it first")));
        }
        let target = BoardTarget::parse(&self.port);
        let closing = ends_on_signals()?;
        let link: Box<dyn ByteLink> = match target {
            BoardTarget::Core => Box::new(PacedBoard::new(InProcessBoard::new())),
            _ => target.open(&mut |line| streams.say(line))?,
        };
        let options = LiveOptions {
            port: self.listen,
            folder: absolute(&self.out),
            is_virtual: !matches!(target, BoardTarget::Port(_)),
        };
        let name = target.name().to_owned();
        serve(link, &options, &closing, &mut |address| {
            streams.say(&format!("{name} is live at {address}"));
            streams.say("Open that on this computer; whoever has it may watch and stop. Ctrl-C ends.");
        })
    }
}

/// So that messages name the whole path. Where the system does not know it, the path as it is will do.
fn absolute(folder: &Path) -> PathBuf {
    folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
}

/// A flag that Ctrl-C and a request to end set. The second of either ends at once.
fn ends_on_signals() -> Result<Arc<AtomicBool>, CliError> {
    let closing = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&closing))
            .and_then(|_| flag::register(signal, Arc::clone(&closing)))
            .map_err(|error| CliError::Internal(format!("signals cannot be noted: {error}")))?;
    }
    Ok(closing)
}
