//! The way of a table or of a plan to the board: what `table` and `plan` have in common.

use core::fmt::Write;

use heapless::Vec;

use super::say;
use super::words::{Words, no_more, parse_number};
use crate::console::Console;
use crate::console::error::CommandError;
use crate::console::upload::{MAX_FRAME_BYTES, Upload, UploadError, UploadKind};
use crate::fault::Event;
use crate::units::TickRate;

impl Console<'_> {
    pub(super) fn upload<'l>(
        &mut self,
        kind: UploadKind,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let verb = words.next();
        match verb {
            Some("begin") => return self.begin_upload(kind, words, out),
            Some("frame") => return self.take_frame(kind, words, out),
            Some("commit" | "abort" | "show") => no_more_words(kind, words)?,
            _ => return Err(usage(kind)),
        }
        match (kind, verb) {
            (_, Some("abort")) => {
                self.upload = None;
                say(out, format_args!("ok {} abort", kind.word()));
                Ok(())
            }
            (UploadKind::Table, Some("commit")) => self.commit_table(out),
            (UploadKind::Plan, Some("commit")) => self.commit_plan(),
            (UploadKind::Table, _) => {
                self.show_table(out);
                Ok(())
            }
            (UploadKind::Plan, _) => {
                self.show_plan(out);
                Ok(())
            }
        }
    }

    fn begin_upload<'l>(
        &mut self,
        kind: UploadKind,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let length = decimal(kind, words.next())?;
        let crc32 = hexadecimal(kind, words.next())?;
        let rate_hz = parse_number(words.next(), kind.word(), kind.begin_usage())?;
        no_more_words(kind, words)?;
        let tick_rate = self.table.tick_rate();
        let attainable = TickRate::from_hz(rate_hz).map(|rate| rate.attainable(self.identity.timer_clock_hz));
        let refused = |error| CommandError::Upload { kind, error };
        if attainable != Some(tick_rate) {
            return Err(refused(UploadError::Rate { kind, rate_hz, tick_rate }));
        }
        self.upload = Some(Upload::begin(kind, tick_rate, length, crc32).map_err(refused)?);
        self.arriving.clear();
        say(out, format_args!("ok {} begin bytes={length}", kind.word()));
        Ok(())
    }

    fn take_frame<'l>(
        &mut self,
        kind: UploadKind,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        let number: usize = decimal(kind, words.next())?;
        let announced = decimal(kind, words.next())?;
        let bytes = hexadecimal_bytes(kind, words.next())?;
        let crc32 = hexadecimal(kind, words.next())?;
        no_more_words(kind, words)?;
        let not_begun = CommandError::Upload { kind, error: UploadError::NotBegun { kind } };
        let upload = self.upload.as_mut().filter(|upload| upload.kind() == kind).ok_or(not_begun)?;
        // Frames are few; a number that does not fit is not the next one either.
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        if let Err(error) = upload.take(number, announced, &bytes, crc32, self.arriving) {
            let event = if error == UploadError::FrameDamaged { Event::Crc } else { Event::Frame };
            self.note(event, 0);
            return Err(CommandError::Upload { kind, error });
        }
        let (word, received, length) = (kind.word(), self.arriving.len(), upload.length());
        say(out, format_args!("ok {word} frame={number} received={received} of={length}"));
        Ok(())
    }

    /// Says how much of an upload of this kind has come, where one is under way.
    pub(super) fn show_upload(&self, kind: UploadKind, out: &mut dyn Write) {
        if let Some(upload) = self.upload.as_ref().filter(|upload| upload.kind() == kind) {
            say(out, format_args!("upload {} of {} bytes", self.arriving.len(), upload.length()));
        }
    }
}

/// What `make` makes of the bytes that have come; what cannot be repaired is dropped.
pub(super) fn finish_upload<T>(
    under_way: &mut Option<Upload>,
    kind: UploadKind,
    bytes: &[u8],
    make: impl FnOnce(TickRate, &[u8]) -> Result<T, UploadError>,
) -> Result<T, CommandError<'static>> {
    let refused = |error| CommandError::Upload { kind, error };
    let upload = under_way.as_ref().filter(|upload| upload.kind() == kind);
    let upload = upload.ok_or(refused(UploadError::NotBegun { kind }))?;
    upload.check(bytes).and_then(|()| make(upload.tick_rate(), bytes)).map_err(|error| {
        if !matches!(error, UploadError::Incomplete { .. }) {
            *under_way = None;
        }
        refused(error)
    })
}

fn usage(kind: UploadKind) -> CommandError<'static> {
    CommandError::Usage { command: kind.word(), usage: kind.usage() }
}

fn no_more_words<'l>(kind: UploadKind, words: Words<'l>) -> Result<(), CommandError<'l>> {
    no_more(words, kind.word(), kind.usage())
}

fn decimal(kind: UploadKind, word: Option<&str>) -> Result<usize, CommandError<'static>> {
    word.and_then(|word| word.parse().ok()).ok_or(usage(kind))
}

/// Eight hexadecimal digits, `0x` before them or not.
fn hexadecimal(kind: UploadKind, word: Option<&str>) -> Result<u32, CommandError<'static>> {
    let digits = word.map(|word| word.strip_prefix("0x").unwrap_or(word)).ok_or(usage(kind))?;
    // `from_str_radix` would take a sign.
    if digits.len() != 8 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err(usage(kind));
    }
    u32::from_str_radix(digits, 16).map_err(|_| usage(kind))
}

/// Two hexadecimal digits for every byte.
fn hexadecimal_bytes(
    kind: UploadKind,
    word: Option<&str>,
) -> Result<Vec<u8, MAX_FRAME_BYTES>, CommandError<'static>> {
    let (pairs, rest) = word.ok_or(usage(kind))?.as_bytes().as_chunks::<2>();
    if !rest.is_empty() {
        return Err(usage(kind));
    }
    let mut bytes = Vec::new();
    for [high, low] in pairs {
        let (high, low) = (digit(*high).ok_or(usage(kind))?, digit(*low).ok_or(usage(kind))?);
        bytes.push(high << 4 | low).map_err(|_| usage(kind))?;
    }
    Ok(bytes)
}

fn digit(character: u8) -> Option<u8> {
    // A hexadecimal digit is below 16.
    char::from(character).to_digit(16).map(|digit| digit as u8)
}
