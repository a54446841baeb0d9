//! Words that stand in a column of text.

/// So many different words are kept: a column of more is text and no choice between a few.
const MOST: usize = 16;

/// A column of few different words, by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Labels {
    words: Vec<String>,
    /// Which word a row has.
    codes: Vec<u8>,
    too_many: bool,
}

impl Labels {
    /// The word of a row; what was kept of that row and later ones is forgotten.
    pub(super) fn push(&mut self, row: usize, word: &str) {
        self.codes.truncate(row);
        if self.too_many {
            return;
        }
        let known = self.words.iter().position(|known| known == word);
        let code = known.unwrap_or_else(|| {
            self.words.push(word.to_owned());
            self.words.len() - 1
        });
        self.too_many = code >= MOST || word.is_empty();
        match u8::try_from(code) {
            Ok(code) if !self.too_many => self.codes.push(code),
            _ => (self.words, self.codes) = (Vec::new(), Vec::new()),
        }
    }

    /// Words and codes, where every one of so many rows has a word.
    pub(super) fn of(&self, rows: usize) -> Option<(&[String], &[u8])> {
        let codes = self.codes.get(..rows)?;
        (self.words.len() > 1).then_some((&self.words, codes))
    }
}
