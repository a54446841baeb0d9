//! A table or a plan, sent to the board in frames and compared with what the board says it has.

use stillbeam_firmware::console::upload::{MAX_FRAME_BYTES, UploadKind};
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_shape::{BoardPlan, BoardTable, Crc32};

use super::{BoardError, Reply, Session};

/// How often something is sent from the beginning when the board reports it damaged although every frame was
/// taken.
const ATTEMPTS: u32 = 3;

/// How often a frame is sent when it arrives damaged.
const FRAME_ATTEMPTS: u32 = 5;

/// What is sent.
struct Outgoing {
    kind: UploadKind,
    bytes: Vec<u8>,
    crc32: Crc32,
    rate_hz: f64,
}

impl Session {
    /// Sends a table, lets it run, and returns the CRC-32 that the board computes of what it runs, which is
    /// that of `table`. Damaged frames are sent again.
    ///
    /// # Errors
    /// [`BoardError::Refused`] in the board's own words: another tick rate, too little memory, a motion in
    /// which no table can be taken. [`BoardError::Table`] when the board has another table in the end. As
    /// [`Session::command`].
    pub fn upload_table(&mut self, table: &BoardTable) -> Result<Crc32, BoardError> {
        let (bytes, crc32) = (table.bytes(), table.crc32());
        self.upload(&Outgoing { kind: UploadKind::Table, bytes, crc32, rate_hz: table.rate_hz })
    }

    /// Sends a plan, for `play`, and returns the CRC-32 that the board computes of it.
    ///
    /// # Errors
    /// As [`Session::upload_table`].
    pub fn upload_plan(&mut self, plan: &BoardPlan) -> Result<Crc32, BoardError> {
        let (bytes, crc32) = (plan.bytes(), plan.crc32());
        self.upload(&Outgoing { kind: UploadKind::Plan, bytes, crc32, rate_hz: plan.rate_hz })
    }

    fn upload(&mut self, outgoing: &Outgoing) -> Result<Crc32, BoardError> {
        let mut attempt = 1;
        loop {
            match self.send_frames(outgoing).and_then(|()| self.verify(outgoing)) {
                Err(BoardError::Refused { code, .. })
                    if ["crc", "frame"].contains(&code.as_str()) && attempt < ATTEMPTS => {}
                Err(BoardError::Table { .. }) if attempt < ATTEMPTS => {}
                Err(error) => {
                    // Half of it is of no use to whoever comes next; the error is the one worth reporting.
                    let _best_effort = self.command(&format!("{} abort", outgoing.kind.word()));
                    return Err(error);
                }
                Ok(()) => return Ok(outgoing.crc32),
            }
            attempt += 1;
        }
    }

    fn verify(&mut self, outgoing: &Outgoing) -> Result<(), BoardError> {
        let (sent, info) = (outgoing.crc32, self.command("info")?);
        let runs = info.line("shaper") == Some("on");
        let keys: &[(&str, bool)] = match outgoing.kind {
            UploadKind::Table => &[("table_crc32", true), ("shaper_crc32", runs)],
            UploadKind::Plan => &[("plan_crc32", true)],
        };
        for (key, counts) in keys {
            let found = info.line(key).and_then(Crc32::parse);
            if *counts && found != Some(sent) {
                let (board, found) = (self.board().to_owned(), found.map(|crc| crc.to_string()));
                let found = found.unwrap_or_else(|| "none".to_owned());
                return Err(BoardError::Table { board, sent: sent.to_string(), found });
            }
        }
        Ok(())
    }

    fn send_frames(&mut self, outgoing: &Outgoing) -> Result<(), BoardError> {
        let Outgoing { kind, bytes, crc32: whole, rate_hz } = outgoing;
        let word = kind.word();
        self.command(&format!("{word} begin {} {whole} {rate_hz}", bytes.len()))?;
        for (number, frame) in bytes.chunks(MAX_FRAME_BYTES).enumerate() {
            let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
            self.send_frame(&format!("{word} frame {number} {} {hex} {:08x}", frame.len(), crc32(frame)))?;
        }
        match self.command_when_ready(&format!("{word} commit")) {
            // The reply may have been damaged after it was taken; `info` will tell.
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
