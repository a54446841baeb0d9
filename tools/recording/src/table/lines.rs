//! The lines of a text, with their numbers.

/// A line, without its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line<'t> {
    pub(crate) text: &'t str,
    /// From 1.
    pub(crate) number: u32,
}

/// Goes through the lines that are not blank. Lines end in LF or CR LF or, in a text without any LF, in CR.
#[derive(Debug, Clone)]
pub(crate) struct Lines<'t> {
    rest: &'t str,
    number: u32,
    end: u8,
    /// Lines at the beginning that are not the file's own.
    before: u32,
}

impl<'t> Lines<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        let start = text.as_bytes().get(..65_536).unwrap_or(text.as_bytes());
        Self { rest: text, number: 0, end: if start.contains(&b'\n') { b'\n' } else { b'\r' }, before: 0 }
    }

    /// The same where so many lines at the beginning are not the file's own: its lines keep their numbers.
    pub(crate) fn after_own(self, before: u32) -> Self {
        Self { before, ..self }
    }

    /// Leaves out so many lines.
    pub(crate) fn skip_lines(mut self, count: u32) -> Self {
        while self.number < count && self.any().is_some() {}
        self
    }

    /// The text that is left.
    pub(crate) fn rest(&self) -> &'t str {
        self.rest
    }

    fn any(&mut self) -> Option<Line<'t>> {
        if self.rest.is_empty() {
            return None;
        }
        let length = memchr::memchr(self.end, self.rest.as_bytes()).unwrap_or(self.rest.len());
        let text = self.rest.get(..length).unwrap_or(self.rest);
        self.rest = self.rest.get(length + 1..).unwrap_or("");
        self.number = self.number.saturating_add(1);
        Some(Line { text: text.trim_end_matches('\r'), number: self.number.saturating_sub(self.before) })
    }
}

impl<'t> Iterator for Lines<'t> {
    type Item = Line<'t>;

    fn next(&mut self) -> Option<Line<'t>> {
        loop {
            let line = self.any()?;
            if !line.text.trim_ascii().is_empty() {
                return Some(line);
            }
        }
    }
}

/// A text with every line made anew. Blank lines stay, so that messages name the right ones.
pub(super) fn on_their_lines(text: &str, mut row: impl FnMut(&str) -> String) -> String {
    let mut made = String::with_capacity(text.len());
    let mut number = 1;
    for line in Lines::new(text) {
        while number < line.number {
            made.push('\n');
            number += 1;
        }
        made.push_str(&row(line.text));
    }
    made.push('\n');
    made
}

/// The text of a comment without its sign; `None` for a line that is none. A `;` only begins one where it
/// separates nothing.
pub(super) fn comment(text: &str, semicolon_separates: bool) -> Option<&str> {
    let text = text.trim_ascii_start();
    match text.as_bytes().first()? {
        b'#' | b'%' | b'!' => Some(text.trim_start_matches(['#', '%', '!', ' ', '\t'])),
        b'/' if text.starts_with("//") => Some(text.trim_start_matches(['/', ' '])),
        b';' if !semicolon_separates => Some(text.trim_start_matches([';', ' '])),
        _ => None,
    }
}
