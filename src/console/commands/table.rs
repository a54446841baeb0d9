//! `table`: a shaper that was designed elsewhere, in frames.

use core::fmt::Write;

use heapless::Vec;

use super::say;
use super::words::{Words, no_more, on_off, parse_number};
use crate::console::Console;
use crate::console::error::CommandError;
use crate::console::upload::{MAX_FRAME_BYTES, Upload, UploadError};
use crate::fault::Event;
use crate::units::TickRate;

/// How it is used.
const USAGE: CommandError<'static> = CommandError::Usage {
    command: "table",
    usage: "table begin BYTES CRC32 RATE_HZ | frame NUMBER BYTES HEX CRC32 | commit | abort | show",
};

impl Console<'_> {
    pub(super) fn table<'l>(
        &mut self,
        mut words: Words<'l>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'l>> {
        match words.next() {
            Some("begin") => self.begin_table(words, out),
            Some("frame") => self.take_frame(words, out),
            Some("commit") => no_more_words(words).and_then(|()| self.commit_table(out)),
            Some("abort") => no_more_words(words).map(|()| self.abort_table(out)),
            Some("show") => no_more_words(words).map(|()| self.show_table(out)),
            _ => Err(USAGE),
        }
    }

    fn begin_table<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let length = decimal(words.next())?;
        let crc32 = hexadecimal(words.next())?;
        let rate_hz = parse_number(words.next(), "table", "table begin BYTES CRC32 RATE_HZ")?;
        no_more_words(words)?;
        let tick_rate = self.table.tick_rate();
        let attainable = TickRate::from_hz(rate_hz).map(|rate| rate.attainable(self.identity.timer_clock_hz));
        if attainable != Some(tick_rate) {
            return Err(CommandError::Upload(UploadError::Rate { rate_hz, tick_rate }));
        }
        self.upload = Some(Upload::begin(tick_rate, length, crc32).map_err(CommandError::Upload)?);
        say(out, format_args!("ok table begin bytes={length}"));
        Ok(())
    }

    fn take_frame<'l>(&mut self, mut words: Words<'l>, out: &mut dyn Write) -> Result<(), CommandError<'l>> {
        let number: usize = decimal(words.next())?;
        let announced = decimal(words.next())?;
        let bytes = hexadecimal_bytes(words.next())?;
        let crc32 = hexadecimal(words.next())?;
        no_more_words(words)?;
        let upload = self.upload.as_mut().ok_or(CommandError::Upload(UploadError::NotBegun))?;
        // Frames are few; a number that does not fit is not the next one either.
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        if let Err(error) = upload.take(number, announced, &bytes, crc32) {
            let event = if error == UploadError::FrameDamaged { Event::Crc } else { Event::Frame };
            self.note(event, 0);
            return Err(CommandError::Upload(error));
        }
        let (received, length) = (upload.received(), upload.length());
        say(out, format_args!("ok table frame={number} received={received} of={length}"));
        Ok(())
    }

    /// Uses the table as `apply` would use one of the settings. A refusal leaves what runs and what was uploaded
    /// before as they were.
    fn commit_table(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        let upload = self.upload.as_ref().ok_or(CommandError::Upload(UploadError::NotBegun))?;
        let table = match upload.finish() {
            Ok(table) => table,
            Err(error) => {
                if !matches!(error, UploadError::Incomplete { .. }) {
                    self.upload = None;
                }
                return Err(CommandError::Upload(error));
            }
        };
        let crc32 = table.crc32();
        let mut settings = self.live.clone();
        settings.use_uploaded_table();
        let before = self.uploaded.replace(table);
        if let Err(refusal) = self.run(&settings, self.shaper_on, "table") {
            self.uploaded = before;
            return Err(refusal);
        }
        self.upload = None;
        self.live = settings;
        self.staged.use_uploaded_table();
        let shown = self.uploaded.as_ref().map(|table| table.table());
        let (stages, taps) = shown.map_or((0, 0), |table| {
            (table.stages().len(), table.stages().map(|stage| stage.taps().len()).sum::<usize>())
        });
        say(
            out,
            format_args!(
                "ok table committed crc32=0x{crc32:08x} stages={stages} taps={taps} shaper={}",
                on_off(self.shaper_on)
            ),
        );
        Ok(())
    }

    fn abort_table(&mut self, out: &mut dyn Write) {
        self.upload = None;
        say(out, format_args!("ok table abort"));
    }

    fn show_table(&self, out: &mut dyn Write) {
        if let Some(upload) = &self.upload {
            say(out, format_args!("upload {} of {} bytes", upload.received(), upload.length()));
        }
        match &self.uploaded {
            None => say(out, format_args!("table none")),
            Some(uploaded) => {
                let table = uploaded.table();
                say(out, format_args!("table 0x{:08x}", uploaded.crc32()));
                say(out, format_args!("table_rate_hz {}", uploaded.tick_rate().hz()));
                say(out, format_args!("table_duration_ms {:.3}", table.duration_s() * 1e3));
                say(out, format_args!("table_delay_ms {:.3}", table.delay_s() * 1e3));
                for (stage, number) in table.stages().zip(1..) {
                    say(out, format_args!("stage {number}"));
                    for tap in stage.taps() {
                        say(out, format_args!("tap {} {}", tap.delay_ticks, tap.weight));
                    }
                }
            }
        }
        say(out, format_args!("ok table show"));
    }
}

fn no_more_words<'l>(words: Words<'l>) -> Result<(), CommandError<'l>> {
    let CommandError::Usage { command, usage } = USAGE else { return Err(USAGE) };
    no_more(words, command, usage)
}

fn decimal(word: Option<&str>) -> Result<usize, CommandError<'static>> {
    word.and_then(|word| word.parse().ok()).ok_or(USAGE)
}

/// Eight hexadecimal digits, `0x` before them or not.
fn hexadecimal(word: Option<&str>) -> Result<u32, CommandError<'static>> {
    let digits = word.map(|word| word.strip_prefix("0x").unwrap_or(word)).ok_or(USAGE)?;
    // `from_str_radix` would take a sign.
    if digits.len() != 8 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err(USAGE);
    }
    u32::from_str_radix(digits, 16).map_err(|_| USAGE)
}

/// Two hexadecimal digits for every byte.
fn hexadecimal_bytes(word: Option<&str>) -> Result<Vec<u8, MAX_FRAME_BYTES>, CommandError<'static>> {
    let (pairs, rest) = word.ok_or(USAGE)?.as_bytes().as_chunks::<2>();
    if !rest.is_empty() {
        return Err(USAGE);
    }
    let mut bytes = Vec::new();
    for [high, low] in pairs {
        let (high, low) = (digit(*high).ok_or(USAGE)?, digit(*low).ok_or(USAGE)?);
        bytes.push(high << 4 | low).map_err(|_| USAGE)?;
    }
    Ok(bytes)
}

fn digit(character: u8) -> Option<u8> {
    // A hexadecimal digit is below 16.
    char::from(character).to_digit(16).map(|digit| digit as u8)
}
