//! Words of a line that a person may copy into a shell.

/// A text as one word of a shell's line.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/\\._-+:,=%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_with_blanks_stays_one_word() {
        assert_eq!(shell_word("out/tune/table.json"), "out/tune/table.json");
        assert_eq!(shell_word("500,5000"), "500,5000");
        assert_eq!(shell_word("tip_m=y*0.001"), "'tip_m=y*0.001'");
        assert_eq!(shell_word("my machine's/table.json"), "'my machine'\\''s/table.json'");
    }
}
