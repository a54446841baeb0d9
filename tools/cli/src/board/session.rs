//! Commands and replies, with telemetry sorted out from between them.

use std::collections::VecDeque;
use std::time::Duration;

use stillbeam_firmware::telemetry::Sample;

use super::{BoardError, ByteLink};

/// How long a reply may take. The slowest the console does is erasing a sector of the flash, up to 4 s.
const REPLY_PATIENCE: Duration = Duration::from_secs(10);

/// How long the handshake may take: an emulator looks for a client about once a second.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(8);

/// How long one attempt of the handshake may take.
const ATTEMPT_PATIENCE: Duration = Duration::from_millis(1200);

/// How long a command may be refused as `busy` before that is taken for an answer.
const BUSY_PATIENCE: Duration = Duration::from_secs(10);

/// The editing key that clears the line, so that half a line of noise does not spoil the first command.
const CLEAR_LINE: u8 = 0x15;

/// A reply that ended in `ok`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// The lines before the last, telemetry left out.
    pub lines: Vec<String>,
    /// The last line, beginning with `ok`.
    pub ok_line: String,
}

impl Reply {
    /// The value of `KEY=VALUE` in the last line.
    pub fn field(&self, key: &str) -> Option<&str> {
        self.ok_line.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='))
    }

    /// The rest of the line that begins with `key` and a space, as in `info` and `status`.
    pub fn line(&self, key: &str) -> Option<&str> {
        self.lines.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '))
    }
}

/// A conversation with a board's console: echo off, one command at a time.
pub struct Session {
    link: Box<dyn ByteLink>,
    /// Received, not yet a whole line.
    partial: Vec<u8>,
    samples: VecDeque<Sample>,
}

impl Session {
    /// Starts a conversation: whatever was typed before is cleared, echo and telemetry are switched off, and
    /// everything that comes before the answer is passed over.
    ///
    /// # Errors
    /// [`BoardError::NoConsole`] when nobody answers, [`BoardError::Io`].
    pub fn start(link: Box<dyn ByteLink>) -> Result<Self, BoardError> {
        Self::start_within(link, HANDSHAKE_PATIENCE)
    }

    /// The same with another patience, on the link's clock.
    ///
    /// # Errors
    /// As [`Session::start`].
    pub fn start_within(link: Box<dyn ByteLink>, patience: Duration) -> Result<Self, BoardError> {
        let mut session = Self { link, partial: Vec::new(), samples: VecDeque::new() };
        let began = session.link.clock();
        while session.link.clock().saturating_sub(began) < patience {
            session.send(&[CLEAR_LINE])?;
            session.send(b"echo off\r")?;
            let attempt_ends = session.link.clock() + ATTEMPT_PATIENCE.min(patience);
            if !session.skip_to("ok echo off", attempt_ends)? {
                continue;
            }
            // Earlier attempts may be answered late. Their answers come before this one.
            session.send(b"stream off\r")?;
            let attempt_ends = session.link.clock() + ATTEMPT_PATIENCE;
            if session.skip_to("ok stream off", attempt_ends)? {
                session.samples.clear();
                return Ok(session);
            }
        }
        Err(BoardError::NoConsole { board: session.link.name().to_owned(), waited: patience })
    }

    /// What messages call the board.
    pub fn board(&self) -> &str {
        self.link.name()
    }

    /// Sends one command and waits for the end of its reply.
    ///
    /// # Errors
    /// [`BoardError::Refused`] with the console's own words; [`BoardError::Timeout`], [`BoardError::Protocol`],
    /// [`BoardError::Io`].
    pub fn command(&mut self, command: &str) -> Result<Reply, BoardError> {
        self.send(command.as_bytes())?;
        self.send(b"\r")?;
        let deadline = self.link.clock() + REPLY_PATIENCE;
        let mut lines = Vec::new();
        loop {
            let Some(line) = self.line_before(deadline)? else {
                return Err(self.timeout(format!("the reply to `{command}`"), REPLY_PATIENCE));
            };
            if let Ok(sample) = line.parse() {
                self.samples.push_back(sample);
            } else if line == "ok" || line.starts_with("ok ") {
                let name = command.split(' ').next().unwrap_or_default();
                if line.split(' ').nth(1) != Some(name) {
                    return Err(self.unexpected(command, &line, "`ok` and the command's name"));
                }
                return Ok(Reply { lines, ok_line: line });
            } else if let Some(refusal) = line.strip_prefix("err ") {
                return Err(self.refusal(command, refusal));
            } else {
                lines.push(line);
            }
        }
    }

    /// Sends a command again while the console is busy: it waits for the machine to come to rest, or for an
    /// earlier table to run out.
    ///
    /// # Errors
    /// As [`Session::command`]; `busy` only after ten seconds of it.
    pub fn command_when_ready(&mut self, command: &str) -> Result<Reply, BoardError> {
        let deadline = self.link.clock() + BUSY_PATIENCE;
        loop {
            match self.command(command) {
                Err(BoardError::Refused { code, .. }) if code == "busy" && self.link.clock() < deadline => {
                    self.link.pause(Duration::from_millis(20));
                }
                answer => return answer,
            }
        }
    }

    /// The next telemetry sample, waiting for it until `deadline` on the link's clock; `None` when none came.
    pub(super) fn next_sample(&mut self, deadline: Duration) -> Result<Option<Sample>, BoardError> {
        if let Some(sample) = self.samples.pop_front() {
            return Ok(Some(sample));
        }
        while let Some(line) = self.line_before(deadline)? {
            if let Ok(sample) = line.parse() {
                return Ok(Some(sample));
            }
        }
        Ok(None)
    }

    /// Forgets telemetry that nobody asked for.
    pub(super) fn forget_samples(&mut self) {
        self.samples.clear();
    }

    /// The link's clock.
    pub(super) fn clock(&self) -> Duration {
        self.link.clock()
    }

    /// Lets time pass on the link's clock.
    pub(super) fn pause(&mut self, duration: Duration) {
        self.link.pause(duration);
    }

    pub(super) fn timeout(&self, what: String, waited: Duration) -> BoardError {
        BoardError::Timeout { board: self.board().to_owned(), what, waited }
    }

    pub(super) fn unexpected(&self, command: &str, found: &str, expected: &'static str) -> BoardError {
        let board = self.board().to_owned();
        BoardError::Protocol { board, command: command.to_owned(), found: found.to_owned(), expected }
    }

    fn refusal(&self, command: &str, refusal: &str) -> BoardError {
        let parsed = refusal.split_once(' ').and_then(|(code, rest)| Some((code, rest.split_once(": ")?)));
        match parsed {
            Some((code, (name, reason))) => BoardError::Refused {
                board: self.board().to_owned(),
                command: command.to_owned(),
                code: code.to_owned(),
                name: name.to_owned(),
                reason: reason.to_owned(),
            },
            None => self.unexpected(command, &format!("err {refusal}"), "`err CODE NAME: reason`"),
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        let sent = self.link.write_all(bytes);
        sent.map_err(|source| BoardError::Io { board: self.board().to_owned(), source })
    }

    /// Reads lines until one ends in `wanted` (an echo may stand before it); whether it came in time.
    fn skip_to(&mut self, wanted: &str, deadline: Duration) -> Result<bool, BoardError> {
        while let Some(line) = self.line_before(deadline)? {
            if line.ends_with(wanted) || line.starts_with(wanted) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The next line that is not empty, without its end; `None` when none came before the deadline. Bytes that are
    /// not text become replacement characters, and no reply has those.
    fn line_before(&mut self, deadline: Duration) -> Result<Option<String>, BoardError> {
        let mut buffer = [0; 4096];
        loop {
            if let Some(end) = self.partial.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.partial.drain(..=end).collect();
                let line = String::from_utf8_lossy(&line).trim_end_matches(['\r', '\n']).to_owned();
                if line.is_empty() {
                    continue;
                }
                return Ok(Some(line));
            }
            let patience = deadline.saturating_sub(self.link.clock());
            if patience.is_zero() {
                return Ok(None);
            }
            let read = self.link.read(&mut buffer, patience);
            let count = read.map_err(|source| BoardError::Io { board: self.board().to_owned(), source })?;
            self.partial.extend(buffer.iter().take(count));
        }
    }
}
