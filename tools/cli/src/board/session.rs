//! Commands and replies, with telemetry sorted out from between them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use stillbeam_firmware::real_time::RealTimeByte;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_firmware::telemetry::Sample;

use super::interrupt::{Asked, Interrupt, Listening, StopLine};
use super::receiver::{Received, Receiver};
use super::{BoardError, ByteLink};

/// How long a reply may take. The slowest the console does is erasing a sector of the flash, up to 4 s.
const REPLY_PATIENCE: Duration = Duration::from_secs(10);

/// How long the handshake may take: an emulator looks for a client about once a second.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(8);

/// How long one attempt of the handshake may take.
const ATTEMPT_PATIENCE: Duration = Duration::from_millis(1200);

/// How long a command may be refused as `busy` before that is taken for an answer, in seconds of the board's
/// own time: an emulated board on a busy computer runs many times slower than the clock on the wall.
const BUSY_PATIENCE_S: f64 = 10.0;

/// How often a command is sent when the line damages it or its reply.
const ATTEMPTS: u32 = 10;

/// How long the line is listened to before a command is sent again, so that no late reply is taken for the
/// next.
const SILENCE: Duration = Duration::from_millis(60);

/// Commands that may be sent again when it is not known whether they were taken: twice does what once does.
const REPEATABLE: [&str; 19] = [
    "help", "info", "status", "get", "set", "apply", "revert", "defaults", "save", "shaper", "stop",
    "stream", "echo", "checksum", "table", "enable", "disable", "position", "settings",
];

/// The editing key that clears the line, so that half a line of noise does not spoil the first command.
const CLEAR_LINE: u8 = 0x15;

/// How soon Ctrl-C is noticed.
const NOTICE: Duration = Duration::from_millis(50);

/// How often the board is told that somebody is there, while its motion runs.
const ALIVE_EVERY: Duration = Duration::from_millis(100);

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

/// What came after a command.
enum Answer {
    /// The end of a reply, `ok` or a refusal.
    Reply(Result<Reply, BoardError>),
    /// The board got the command damaged and did nothing.
    CommandDamaged,
    /// Nothing, or nothing that its checksum vouches for.
    Unknown(BoardError),
}

/// A conversation with a board's console: echo off, one command at a time, each with a checksum if the board
/// knows them.
pub struct Session {
    link: Box<dyn ByteLink>,
    checksums: bool,
    /// Commands that had to be sent again.
    repeated: u64,
    receiver: Receiver,
    /// Frames that the line damaged.
    damaged_frames: u64,
    samples: VecDeque<Sample>,
    /// What the board said of faults, unasked.
    faults: Vec<String>,
    interrupt: Interrupt,
    /// When the board was last told that somebody is there; `None` where it does not ask.
    told_alive: Option<Duration>,
}

impl Session {
    /// Starts a conversation: whatever was typed before is cleared, echo and telemetry are switched off, and
    /// everything that comes before the answer is passed over. Ctrl-C stops the machine and ends the
    /// conversation with [`BoardError::Interrupted`].
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
        Self::shake_hands(link, patience, Interrupt::CtrlC(Listening::start()))
    }

    /// The same for a program with an own meaning of Ctrl-C: whoever sets `asked` stops the machine.
    ///
    /// # Errors
    /// As [`Session::start`].
    pub fn start_stopped_by(link: Box<dyn ByteLink>, asked: Arc<AtomicBool>) -> Result<Self, BoardError> {
        Self::shake_hands(link, HANDSHAKE_PATIENCE, Interrupt::Flag(asked))
    }

    /// The same for a program that goes on after a stop: whoever pulls `stops` stops the machine, whatever
    /// this conversation waits for.
    ///
    /// # Errors
    /// As [`Session::start`].
    pub fn start_with_stop_line(link: Box<dyn ByteLink>, stops: StopLine) -> Result<Self, BoardError> {
        let served = stops.pulls();
        Self::shake_hands(link, HANDSHAKE_PATIENCE, Interrupt::Line(stops, served))
    }

    fn shake_hands(
        link: Box<dyn ByteLink>,
        patience: Duration,
        interrupt: Interrupt,
    ) -> Result<Self, BoardError> {
        let mut session = Self {
            link,
            checksums: false,
            repeated: 0,
            receiver: Receiver::default(),
            damaged_frames: 0,
            samples: VecDeque::new(),
            faults: Vec::new(),
            interrupt,
            told_alive: None,
        };
        let began = session.link.clock();
        while session.link.clock().saturating_sub(began) < patience {
            session.send(&[CLEAR_LINE])?;
            // Whoever was here before may have left checksums on.
            session.send(b"checksum off\r")?;
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
                session.ask_for_checksums()?;
                return Ok(session);
            }
        }
        Err(BoardError::NoConsole { board: session.link.name().to_owned(), waited: patience })
    }

    /// What messages call the board.
    pub fn board(&self) -> &str {
        self.link.name()
    }

    /// Switches checksums on where the firmware has them.
    fn ask_for_checksums(&mut self) -> Result<(), BoardError> {
        self.checksums = true;
        match self.command("checksum on") {
            Err(BoardError::Refused { code, .. }) if code == "unknown-command" => self.checksums = false,
            answer => {
                answer?;
            }
        }
        Ok(())
    }

    /// How many commands had to be sent again because the line damaged them or their replies.
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Sends one command and waits for the end of its reply. What the line damages is sent again, a motion
    /// only when it is certain that the board did not take it.
    ///
    /// # Errors
    /// [`BoardError::Refused`] with the console's own words; [`BoardError::Timeout`],
    /// [`BoardError::Damaged`], [`BoardError::Protocol`], [`BoardError::Io`].
    pub fn command(&mut self, command: &str) -> Result<Reply, BoardError> {
        let name = command.split(' ').next().unwrap_or_default();
        let repeatable = REPEATABLE.contains(&name) && !command.ends_with(" commit");
        for _ in 1..ATTEMPTS {
            match self.exchange(command)? {
                Answer::Reply(reply) => return reply,
                Answer::CommandDamaged => {}
                Answer::Unknown(_) if repeatable && self.checksums => {}
                Answer::Unknown(error) => return Err(error),
            }
            self.repeated += 1;
            self.wait_for_silence()?;
        }
        match self.exchange(command)? {
            Answer::Reply(reply) => reply,
            Answer::CommandDamaged => Err(self.damaged(command)),
            Answer::Unknown(error) => Err(error),
        }
    }

    /// Sends a command and reads to the end of the reply.
    fn exchange(&mut self, command: &str) -> Result<Answer, BoardError> {
        let line = match self.checksums {
            true => format!("{command} *{:08x}\r", crc32(command.as_bytes())),
            false => format!("{command}\r"),
        };
        self.send(line.as_bytes())?;
        let deadline = self.link.clock() + REPLY_PATIENCE;
        let mut lines: Vec<String> = Vec::new();
        loop {
            let Some(line) = self.line_before(deadline)? else {
                let what = format!("the reply to `{command}`");
                return Ok(Answer::Unknown(self.timeout(what, REPLY_PATIENCE)));
            };
            if let Ok(sample) = line.parse() {
                self.samples.push_back(sample);
                continue;
            }
            let is_last = line == "ok" || line.starts_with("ok ") || line.starts_with("err ");
            lines.push(line);
            if !is_last {
                continue;
            }
            let good = !self.checksums || take_checksum(&mut lines);
            let line = lines.pop().unwrap_or_default();
            // Before it requires checksums a board refuses damaged lines without one, and one that has none
            // says so.
            let plain = ["err crc line: ", "err syntax line: ", "err unknown-command checksum: "];
            if !good && !plain.iter().any(|start| line.starts_with(start)) {
                return Ok(Answer::Unknown(self.damaged(command)));
            }
            return Ok(self.sort_answer(command, lines, line));
        }
    }

    fn sort_answer(&self, command: &str, lines: Vec<String>, last: String) -> Answer {
        match last.strip_prefix("err ") {
            Some(refusal) if refusal.starts_with("crc line: ") => Answer::CommandDamaged,
            // Too long or not text: what was sent is neither.
            Some(refusal) if self.checksums && refusal.starts_with("syntax line: ") => Answer::CommandDamaged,
            Some(refusal) => Answer::Reply(Err(self.refusal(command, refusal))),
            None if last.split(' ').nth(1) == command.split(' ').next() => {
                Answer::Reply(Ok(Reply { lines, ok_line: last }))
            }
            None => Answer::Reply(Err(self.unexpected(command, &last, "`ok` and the command's name"))),
        }
    }

    /// Passes over whatever still comes.
    fn wait_for_silence(&mut self) -> Result<(), BoardError> {
        while let Some(line) = self.line_before(self.link.clock() + SILENCE)? {
            if let Ok(sample) = line.parse() {
                self.samples.push_back(sample);
            }
        }
        self.receiver.clear();
        Ok(())
    }

    /// Sends a command again while the console is busy: it waits for the machine to come to rest, or for an
    /// earlier table to run out.
    ///
    /// # Errors
    /// As [`Session::command`]; `busy` only after ten seconds of it by the board's ticks.
    pub fn command_when_ready(&mut self, command: &str) -> Result<Reply, BoardError> {
        let mut first_refused = None;
        loop {
            let answer = self.command(command);
            match &answer {
                Err(BoardError::Refused { code, .. }) if code == "busy" => {}
                _ => return answer,
            }
            let tick = self.tick()?;
            let (since, patience) = match first_refused {
                Some(begun) => begun,
                None => *first_refused.insert((tick, (BUSY_PATIENCE_S * self.tick_hz()?) as u32)),
            };
            if tick.wrapping_sub(since) > patience {
                return answer;
            }
            self.link.pause(Duration::from_millis(20));
        }
    }

    /// The board's tick, from its `status`.
    fn tick(&mut self) -> Result<u32, BoardError> {
        let status = self.command("status")?;
        let text = status.line("tick").unwrap_or_default();
        text.parse().map_err(|_| self.unexpected("status", text, "a line `tick NUMBER`"))
    }

    /// The next telemetry sample, waiting for it until `deadline` on the link's clock; `None` when none came.
    pub(super) fn next_sample(&mut self, deadline: Duration) -> Result<Option<Sample>, BoardError> {
        loop {
            if let Some(sample) = self.samples.pop_front() {
                return Ok(Some(sample));
            }
            match self.received_before(deadline)? {
                None => return Ok(None),
                Some(Received::Line(line)) => self.samples.extend(line.parse::<Sample>().ok()),
                Some(other) => self.keep(other),
            }
        }
    }

    /// The telemetry that has come, waiting for some at most `patience` on the link's clock.
    ///
    /// # Errors
    /// [`BoardError::Io`].
    pub fn samples_within(&mut self, patience: Duration) -> Result<Vec<Sample>, BoardError> {
        let first = self.next_sample(self.link.clock() + patience)?;
        Ok(first.into_iter().chain(self.samples.drain(..)).collect())
    }

    /// What the board said of faults since the last time this was asked: `NAME tick=N
    /// drive=enabled|disabled`.
    pub fn take_faults(&mut self) -> Vec<String> {
        std::mem::take(&mut self.faults)
    }

    /// How many frames came damaged since the last time this was asked.
    pub(crate) fn take_damaged_frames(&mut self) -> u64 {
        std::mem::take(&mut self.damaged_frames)
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

    fn damaged(&self, command: &str) -> BoardError {
        BoardError::Damaged {
            board: self.board().to_owned(),
            command: command.to_owned(),
            attempts: ATTEMPTS,
        }
    }

    pub(super) fn timeout(&self, what: String, waited: Duration) -> BoardError {
        BoardError::Timeout { board: self.board().to_owned(), what, waited }
    }

    pub(crate) fn unexpected(&self, command: &str, found: &str, expected: &'static str) -> BoardError {
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

    /// The next line; `None` when none came before the deadline.
    fn line_before(&mut self, deadline: Duration) -> Result<Option<String>, BoardError> {
        while let Some(received) = self.received_before(deadline)? {
            match received {
                Received::Line(line) => return Ok(Some(line)),
                other => self.keep(other),
            }
        }
        Ok(None)
    }

    /// The next thing that is whole; `None` when none came before the deadline.
    fn received_before(&mut self, deadline: Duration) -> Result<Option<Received>, BoardError> {
        let mut buffer = [0; 4096];
        loop {
            if let Some(received) = self.receiver.take() {
                return Ok(Some(received));
            }
            let patience = deadline.saturating_sub(self.link.clock());
            if patience.is_zero() {
                return Ok(None);
            }
            self.look_after_motion()?;
            let read = self.link.read(&mut buffer, patience.min(NOTICE));
            let count = read.map_err(|source| BoardError::Io { board: self.board().to_owned(), source })?;
            self.receiver.push(buffer.get(..count).unwrap_or_default());
        }
    }

    /// Stops the machine where a person asks for it, and tells the board that somebody is there.
    fn look_after_motion(&mut self) -> Result<(), BoardError> {
        let asked = self.interrupt.take();
        if asked != Asked::Nothing {
            self.send(&[RealTimeByte::STOP])?;
        }
        if asked == Asked::StopAndEnd {
            return Err(BoardError::Interrupted { board: self.board().to_owned() });
        }
        let now = self.link.clock();
        if self.told_alive.is_some_and(|before| now.saturating_sub(before) >= ALIVE_EVERY) {
            self.told_alive = Some(now);
            self.send(&[RealTimeByte::ALIVE])?;
        }
        Ok(())
    }

    /// From now on tells the board again and again that somebody is there, if it stops without that
    /// (`link.timeout_ms`).
    ///
    /// # Errors
    /// As [`Session::command`], but for firmware that does not know the setting.
    pub(crate) fn keep_alive(&mut self) -> Result<(), BoardError> {
        let asks = match self.command("get link.timeout_ms") {
            Ok(reply) => !reply.lines.iter().any(|line| line.starts_with("link.timeout_ms = 0 ")),
            Err(BoardError::Refused { .. }) => false,
            Err(error) => return Err(error),
        };
        self.told_alive = asks.then(|| self.link.clock());
        Ok(())
    }

    fn keep(&mut self, received: Received) {
        match received {
            Received::Samples(samples) => self.samples.extend(samples),
            Received::Fault(fault) => self.faults.push(fault),
            Received::Damaged => self.damaged_frames += 1,
            Received::Line(_) => {}
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if self.checksums {
            // A person may come next. A line that has failed is beyond help.
            let _best_effort = self.send(b"checksum off\r");
        }
    }
}

/// Takes the checksum off the last line of a reply; whether it is that of the reply.
fn take_checksum(lines: &mut [String]) -> bool {
    let joined = lines.join("\r\n");
    let Some((text, digits)) = joined.rsplit_once(" *") else { return false };
    let good = digits == format!("{:08x}", crc32(text.as_bytes()));
    if let Some(last) = lines.last_mut() {
        last.truncate(last.len().saturating_sub(digits.len() + 2));
    }
    good
}
