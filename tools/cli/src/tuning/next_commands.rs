//! What to type next.

use super::outcome::Tuning;
use super::shaper_names::kind;

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

/// A path as a word of a shell's line.
fn shell_word(path: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/\\._-+:".contains(c);
    if !path.is_empty() && path.chars().all(is_plain) {
        return path.to_owned();
    }
    format!("'{}'", path.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_with_blanks_stays_one_word() {
        assert_eq!(shell_word("out/tune/table.json"), "out/tune/table.json");
        assert_eq!(shell_word("my machine's/table.json"), "'my machine'\\''s/table.json'");
    }
}
