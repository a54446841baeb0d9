//! What to type next.

use super::outcome::Tuning;
use super::shaper_names::kind;
use crate::shell_word::shell_word;

/// Commands for a shell.
#[derive(Clone, Debug, PartialEq)]
pub struct NextCommands {
    /// Sends the recommended table to the board.
    pub upload: String,
    /// Designs another shaper of the list, with its name as an example; nothing where there is no other.
    pub another: Option<(String, String)>,
}

impl NextCommands {
    /// For files that were written here.
    pub fn of(tuning: &Tuning, modes: &str, table: &str) -> Self {
        let upload = format!("stillbeam upload {} --port PORT --save", shell_word(table));
        let recommendation = &tuning.recommendation;
        let other = recommendation.shortest_textbook().or(recommendation.next_shorter());
        let another = other.and_then(|other| {
            let kind = kind(other)?;
            let numbers: Vec<String> =
                tuning.modes.modes.iter().map(|mode| mode.number.to_string()).collect();
            let command = format!(
                "stillbeam shape --box {} --use {} --box-floor {} --type {kind} --rate {} --json {}",
                shell_word(modes),
                numbers.join(","),
                tuning.request.floor.argument(),
                tuning.request.rate_hz,
                shell_word(table)
            );
            Some((other.name.clone(), command))
        });
        Self { upload, another }
    }
}
