//! A table, sent to the board in frames and compared with what the board says it runs.

use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_shape::{BoardTable, Crc32};

use super::{BoardError, Reply, Session};

/// How often a table is sent from the beginning when the board reports it damaged although every frame was taken.
const ATTEMPTS: u32 = 3;

/// How often a frame is sent when it arrives damaged.
const FRAME_ATTEMPTS: u32 = 5;

impl Session {
    /// Sends a table, lets it run, and returns the CRC-32 that the board computes of what it runs, which is that of
    /// `table`. Damaged frames are sent again.
    ///
    /// # Errors
    /// [`BoardError::Refused`] in the board's own words: another tick rate, too little memory, a motion in which no table
    /// can be taken. [`BoardError::Table`] when the board has another table in the end. As [`Session::command`].
    pub fn upload_table(&mut self, table: &BoardTable) -> Result<Crc32, BoardError> {
        let mut attempt = 1;
        loop {
            let sent = self.send_table(table).and_then(|()| self.verify(table));
            match sent {
                Err(BoardError::Refused { code, .. })
                    if ["crc", "frame"].contains(&code.as_str()) && attempt < ATTEMPTS => {}
                Err(BoardError::Table { .. }) if attempt < ATTEMPTS => {}
                Err(error) => {
                    // Half a table is of no use to whoever comes next; the error is the one worth reporting.
                    let _best_effort = self.command("table abort");
                    return Err(error);
                }
                Ok(()) => return Ok(table.crc32()),
            }
            attempt += 1;
        }
    }

    fn verify(&mut self, table: &BoardTable) -> Result<(), BoardError> {
        let (sent, info) = (table.crc32(), self.command("info")?);
        let runs = info.line("shaper") == Some("on");
        for (key, counts) in [("table_crc32", true), ("shaper_crc32", runs)] {
            let found = info.line(key).and_then(Crc32::parse);
            if counts && found != Some(sent) {
                let (board, found) = (self.board().to_owned(), found.map(|crc| crc.to_string()));
                let found = found.unwrap_or_else(|| "none".to_owned());
                return Err(BoardError::Table { board, sent: sent.to_string(), found });
            }
        }
        Ok(())
    }

    fn send_table(&mut self, table: &BoardTable) -> Result<(), BoardError> {
        let bytes = table.bytes();
        self.command(&format!("table begin {} {} {}", bytes.len(), table.crc32(), table.rate_hz))?;
        for (number, frame) in bytes.chunks(MAX_FRAME_BYTES).enumerate() {
            let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
            self.send_frame(&format!("table frame {number} {} {hex} {:08x}", frame.len(), crc32(frame)))?;
        }
        match self.command_when_ready("table commit") {
            // The reply may have been damaged after the table was taken; `info` will tell.
            Ok(_) | Err(BoardError::Damaged { .. } | BoardError::Timeout { .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn send_frame(&mut self, line: &str) -> Result<Reply, BoardError> {
        for _ in 1..FRAME_ATTEMPTS {
            match self.command(line) {
                Err(BoardError::Refused { code, .. }) if code == "crc" => {}
                answer => return answer,
            }
        }
        self.command(line)
    }
}
