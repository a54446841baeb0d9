//! What the demo asks of the board besides motions: settings, tables, limits.

use std::time::Duration;

use stillbeam_firmware::shaper::{MAX_MODES, Mode};
use stillbeam_shape::Crc32;

use crate::board::{BoardError, Session};
use crate::error::CliError;

/// How long a move of the demo may take, on the link's clock.
const MOVE_PATIENCE: Duration = Duration::from_secs(60);

/// The live value of a numeric setting.
///
/// # Errors
/// [`CliError::Board`].
pub fn setting(session: &mut Session, name: &str) -> Result<f64, CliError> {
    let command = format!("get {name}");
    let reply = session.command(&command)?;
    let value = reply.lines.iter().find_map(|line| line.strip_prefix(name)?.strip_prefix(" = "));
    let number = value.and_then(|value| value.split(' ').next()?.parse().ok());
    number.ok_or_else(|| {
        let board = session.board().to_owned();
        let found = reply.lines.first().cloned().unwrap_or_default();
        CliError::Board(BoardError::Protocol { board, command, found, expected: "`NAME = NUMBER`" })
    })
}

/// Sets and applies shapers for `modes` and no others, and returns the CRC that the board reports.
///
/// # Errors
/// [`CliError::Board`], a refusal included.
pub fn apply_shapers(session: &mut Session, modes: &[Mode]) -> Result<Crc32, CliError> {
    for number in 1..=MAX_MODES {
        match modes.get(number - 1) {
            Some(mode) => {
                session.command(&format!("set mode{number}.frequency_hz {}", mode.frequency_hz()))?;
                session.command(&format!("set mode{number}.damping_ratio {}", mode.damping_ratio()))?;
                session.command(&format!("set mode{number}.type {}", mode.shaper()))?;
            }
            None => {
                session.command(&format!("set mode{number}.type off"))?;
            }
        }
    }
    let reply = session.command_when_ready("apply")?;
    reply.field("crc32").and_then(Crc32::parse).ok_or_else(|| {
        let (board, found) = (session.board().to_owned(), reply.ok_line.clone());
        let (command, expected) = ("apply".to_owned(), "`crc32=0x...`");
        CliError::Board(BoardError::Protocol { board, command, found, expected })
    })
}

/// Brings the board to rest at position zero.
///
/// # Errors
/// [`CliError::Board`].
pub fn go_to_zero(session: &mut Session) -> Result<(), CliError> {
    if session.wait_for_rest(MOVE_PATIENCE)? != 0 {
        session.command_when_ready("move 0")?;
        session.wait_for_rest(MOVE_PATIENCE)?;
    }
    Ok(())
}

/// Ticks per streamed sample that make about `rate_hz`.
pub fn decimation(tick_hz: f64, rate_hz: f64) -> u32 {
    // Tick rates are at most 20 kHz, so the quotient is small.
    (tick_hz / rate_hz).round().max(1.0) as u32
}
