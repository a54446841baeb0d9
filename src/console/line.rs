//! Bytes to lines: editing and echo for people, bare lines for programs.

use core::fmt::Write;

use heapless::String;

use crate::real_time::SUBSTITUTE;

/// The longest line, in characters, its checksum included.
pub const MAX_LINE: usize = 160;

/// Collects one line of printable ASCII ended by CR, LF or CRLF.
#[derive(Debug)]
pub struct LineEditor {
    line: String<MAX_LINE>,
    fault: Option<LineFault>,
    previous_was_cr: bool,
    escape: Escape,
    echo: bool,
}

/// Why a line cannot be used. The rest of the line is passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineFault {
    /// More than [`MAX_LINE`] characters.
    TooLong,
    /// Bytes of it were lost or damaged on their way.
    Lost,
    /// A byte that is neither printable ASCII nor an editing key.
    NotPrintable(u8),
}

/// Where in a terminal's escape sequence (an arrow key, say) the input is. Such keys are passed over.
#[derive(Debug, PartialEq, Eq)]
enum Escape {
    None,
    Started,
    Sequence,
}

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7f;
const CTRL_U: u8 = 0x15;
const ESCAPE: u8 = 0x1b;

impl LineEditor {
    /// An empty line, echo on.
    pub fn new() -> Self {
        Self { line: String::new(), fault: None, previous_was_cr: false, escape: Escape::None, echo: true }
    }

    /// Whether typed characters are sent back.
    pub fn echo(&self) -> bool {
        self.echo
    }

    /// Switches echo.
    pub fn set_echo(&mut self, echo: bool) {
        self.echo = echo;
    }

    /// Takes one byte and sends the echo to `out`. Returns the line when the byte ended it. The echo is
    /// best effort: a full `out` loses it.
    pub fn feed(&mut self, byte: u8, out: &mut dyn Write) -> Option<Result<String<MAX_LINE>, LineFault>> {
        let after_cr = core::mem::replace(&mut self.previous_was_cr, byte == b'\r');
        if byte == SUBSTITUTE {
            self.escape = Escape::None;
            self.fault.get_or_insert(LineFault::Lost);
            return None;
        }
        match self.escape {
            Escape::Started if byte == b'[' || byte == b'O' => {
                self.escape = Escape::Sequence;
                return None;
            }
            Escape::Started => {
                self.escape = Escape::None;
                return None;
            }
            Escape::Sequence => {
                if (0x40..=0x7e).contains(&byte) {
                    self.escape = Escape::None;
                }
                return None;
            }
            Escape::None => {}
        }
        match byte {
            b'\n' if after_cr => None,
            b'\r' | b'\n' => {
                self.print(out, "\r\n");
                let line = core::mem::take(&mut self.line);
                Some(self.fault.take().map_or(Ok(line), Err))
            }
            BACKSPACE | DELETE => {
                if self.line.pop().is_some() {
                    self.print(out, "\x08 \x08");
                }
                None
            }
            CTRL_U => {
                self.erase(out);
                None
            }
            ESCAPE => {
                self.escape = Escape::Started;
                None
            }
            b' '..=b'~' => {
                self.insert(char::from(byte), out);
                None
            }
            _ => {
                self.fault.get_or_insert(LineFault::NotPrintable(byte));
                None
            }
        }
    }

    /// Forgets what was typed.
    pub fn erase(&mut self, out: &mut dyn Write) {
        while self.line.pop().is_some() {
            self.print(out, "\x08 \x08");
        }
        self.fault = None;
        self.escape = Escape::None;
    }

    /// Shows again what is being typed, after something else was said.
    pub fn show_again(&self, out: &mut dyn Write) {
        self.print(out, &self.line);
    }

    fn insert(&mut self, character: char, out: &mut dyn Write) {
        if self.line.push(character).is_err() {
            self.fault.get_or_insert(LineFault::TooLong);
        } else if self.echo {
            let _best_effort = out.write_char(character);
        }
    }

    fn print(&self, out: &mut dyn Write, text: &str) {
        if self.echo {
            let _best_effort = out.write_str(text);
        }
    }
}

impl Default for LineEditor {
    fn default() -> Self {
        Self::new()
    }
}
