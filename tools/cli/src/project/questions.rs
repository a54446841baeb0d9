//! What a person is asked for a new project, one question a line.

use std::io::{BufRead, Write};

use crate::error::CliError;

/// Someone who answers, and where the questions are put.
pub struct Questions<'q> {
    /// Lines of answers.
    pub answers: &'q mut dyn BufRead,
    /// The questions.
    pub asked: &'q mut dyn Write,
}

impl Questions<'_> {
    /// Asks until the answer can be read. An empty line takes the default; so does the end of the answers.
    ///
    /// # Errors
    /// [`CliError::Output`] where nothing can be asked or answered.
    pub fn ask<T>(
        &mut self,
        question: &str,
        default: &str,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> Result<Option<T>, CliError> {
        loop {
            write!(self.asked, "{question} [{default}]: ")?;
            self.asked.flush()?;
            let mut answer = String::new();
            let is_end = self.answers.read_line(&mut answer)? == 0;
            if answer.trim().is_empty() {
                if is_end {
                    writeln!(self.asked)?;
                }
                return Ok(None);
            }
            match read(answer.trim()) {
                Ok(value) => return Ok(Some(value)),
                Err(problem) => writeln!(self.asked, "{problem}")?,
            }
        }
    }
}

/// A number above 0.
///
/// # Errors
/// What is wrong with any other text.
pub fn above_zero(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is no number above 0")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(mut answers: &[u8]) -> (Option<f64>, String) {
        let mut asked = Vec::new();
        let mut questions = Questions { answers: &mut answers, asked: &mut asked };
        let answer = questions.ask("Largest velocity, mm/s", "500", above_zero).unwrap();
        (answer, String::from_utf8(asked).unwrap())
    }

    #[test]
    fn an_answer_that_is_none_is_asked_for_again() {
        let (answer, asked) = asked(b"fast\n-3\n 120 \n");
        assert_eq!(answer, Some(120.0));
        assert_eq!(asked.matches("Largest velocity, mm/s [500]: ").count(), 3);
        assert!(asked.contains("`fast` is no number above 0"), "{asked}");
    }

    #[test]
    fn an_empty_line_and_the_end_of_the_answers_take_the_default() {
        assert_eq!(asked(b"\n").0, None);
        assert_eq!(asked(b"").0, None);
        // A wrong last word is not taken for an answer.
        assert_eq!(asked(b"fast").0, None);
    }
}
