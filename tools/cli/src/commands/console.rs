//! `stillbeam console`: a terminal on a board.

use std::io::BufRead;
use std::sync::mpsc::{self, TryRecvError};
use std::time::{Duration, Instant};

use clap::Args;

use crate::board::serial::SerialBoard;
use crate::board::{BoardError, BoardTarget, ByteLink};
use crate::error::CliError;
use crate::streams::Streams;

/// How long to listen after the last line was sent.
const LAST_WORDS: Duration = Duration::from_millis(500);

/// A word of this program, not of the board: wait until nothing moves.
const WAIT: &str = "wait";

/// How long that may take. The longest sweep takes an hour.
const LONGEST_WAIT: Duration = Duration::from_secs(2 * 3600);

/// Talk to a board's console, line by line.
///
/// Lines from standard input go to the port, everything from the port to standard output; ctrl-d ends. With
/// --command nothing is read from standard input, and a refused command ends with exit status 2; the command
/// `wait` waits until nothing moves.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam console --port /dev/ttyACM0
  stillbeam console --port /dev/ttyACM0 --command 'set mode1.frequency_hz 1.1' --command apply
  stillbeam console --port core --command 'set emergency.input waived' --command apply \\
    --command 'position set 0' --command enable --command 'move 50' --command wait --command status")]
pub struct ConsoleArgs {
    /// The serial port; with --command also core or qemu
    #[arg(long, value_name = "PATH")]
    port: String,
    /// Send this and print the reply; may be repeated
    #[arg(long = "command", value_name = "LINE")]
    commands: Vec<String>,
}

impl ConsoleArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        if self.commands.is_empty() { self.talk(streams) } else { self.send(streams) }
    }

    fn send(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        for command in &self.commands {
            if command.trim().is_empty() || command.contains(char::is_control) {
                return Err(CliError::Usage(format!(
                    "--command {command:?}: give one line of text; repeat --command for more"
                )));
            }
        }
        let mut session = BoardTarget::parse(&self.port).connect(&mut |line| streams.say(line))?;
        for command in &self.commands {
            if command.trim() == WAIT {
                session.wait_for_rest(LONGEST_WAIT)?;
                continue;
            }
            let reply = session.command(command.trim())?;
            for line in reply.lines.iter().chain([&reply.ok_line]) {
                writeln!(streams.out, "{line}")?;
            }
        }
        Ok(())
    }

    fn talk(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        if self.port == "core" || self.port == "qemu" {
            return Err(CliError::Usage(format!(
                "--port {} needs --command; for a person there is a port: `cargo xtask emulate` prints one",
                self.port
            )));
        }
        let mut port = SerialBoard::open(&self.port)?;
        streams.say(&format!("{} is open; `help` lists the commands, ctrl-d ends", self.port));
        let (send, lines) = mpsc::channel();
        // Standard input cannot be waited for together with the port; the thread ends with the process.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        });
        let failed = |source| BoardError::Io { board: self.port.clone(), source };
        // The terminal has echoed what was typed; the board need not.
        port.write_all(b"\x15checksum off\recho off\r").map_err(failed)?;
        let mut buffer = [0; 4096];
        let mut ends_at: Option<Instant> = None;
        while ends_at.is_none_or(|end| Instant::now() < end) {
            match lines.try_recv() {
                Ok(line) => {
                    port.write_all(line.as_bytes()).and_then(|()| port.write_all(b"\r")).map_err(failed)?;
                }
                Err(TryRecvError::Disconnected) if ends_at.is_none() => {
                    ends_at = Some(Instant::now() + LAST_WORDS);
                }
                Err(_) => {}
            }
            let count = port.read(&mut buffer, Duration::from_millis(20)).map_err(failed)?;
            if let Some(received) = buffer.get(..count).filter(|received| !received.is_empty()) {
                streams.out.write_all(received)?;
                streams.out.flush()?;
            }
        }
        port.write_all(b"\x15echo on\r").map_err(failed)?;
        Ok(())
    }
}
