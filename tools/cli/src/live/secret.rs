//! Random words: the token that is in the address, and the names of pages.

use std::fmt::Write;

use subtle::ConstantTimeEq;

use super::LiveError;

/// Random bytes of a word: 128 bits.
const BYTES: usize = 16;

/// 32 hexadecimal digits that nobody can guess.
#[derive(Clone)]
pub struct Secret(String);

impl Secret {
    /// A new one.
    ///
    /// # Errors
    /// [`LiveError::Random`].
    pub fn new() -> Result<Self, LiveError> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).map_err(|error| LiveError::Random { reason: error.to_string() })?;
        let mut digits = String::with_capacity(2 * BYTES);
        for byte in bytes {
            // Writing into a string does not fail.
            let _written = write!(digits, "{byte:02x}");
        }
        Ok(Self(digits))
    }

    /// Whether this is the word. How long it takes says nothing of how much of it is right.
    pub fn is(&self, claimed: &str) -> bool {
        self.0.as_bytes().ct_eq(claimed.as_bytes()).into()
    }

    /// The digits, for an address.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

/// A secret is in no log.
impl std::fmt::Debug for Secret {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secret(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_itself_alone_and_is_not_printed() {
        let (word, other) = (Secret::new().unwrap(), Secret::new().unwrap());
        assert!(word.is(word.reveal()) && word.reveal().len() == 32);
        for wrong in [other.reveal(), "", &word.reveal()[1..], &format!("{}0", word.reveal())] {
            assert!(!word.is(wrong), "{wrong}");
        }
        assert!(!format!("{word:?}").contains(word.reveal()));
    }
}
