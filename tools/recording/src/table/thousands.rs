//! Whole numbers whose thousands a comma groups (`19,966`), in tables that write decimals with a point.
//!
//! One such number alone may have three decimals behind a decimal comma. Beside it stand numbers with a point
//! that can only be the decimal one, and where every comma stands before three digits it groups.

/// Lines that are looked at.
const LOOKED_AT: usize = 500;
/// Grouped numbers that there are at least.
const LEAST: usize = 3;

/// What a word says about the comma.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Says {
    /// It has a decimal point.
    Point,
    /// Its commas may group thousands.
    Groups,
    /// Its comma does something else.
    Other,
    Nothing,
}

/// The text without the commas that group thousands; `None` where none does, or none surely.
pub(super) fn ungrouped(text: &str) -> Option<String> {
    let (mut points, mut groups) = (0, 0);
    for line in text.lines().take(LOOKED_AT) {
        for word in words(line) {
            match says(word) {
                Says::Point => points += 1,
                Says::Groups => groups += 1,
                Says::Other => return None,
                Says::Nothing => {}
            }
        }
    }
    if points == 0 || groups < LEAST {
        return None;
    }
    let mut plain = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let mut rest = line;
        for word in words(line).filter(|word| says(word) == Says::Groups) {
            if let Some((before, after)) = rest.split_once(word) {
                plain.push_str(before);
                plain.extend(word.chars().filter(|character| *character != ','));
                rest = after;
            }
        }
        plain.push_str(rest);
    }
    Some(plain)
}

/// What may be numbers. Beside quotes a comma separates, within them it does not.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let has_quotes = line.contains('"');
    line.split('"').enumerate().flat_map(move |(place, part)| {
        let separates = has_quotes && place % 2 == 0;
        let ends = move |character: char| {
            !(character.is_ascii_alphanumeric() || "+-.,_".contains(character))
                || (separates && character == ',')
        };
        part.split(ends).map(|word| word.trim_matches(',')).filter(|word| !word.is_empty())
    })
}

fn says(word: &str) -> Says {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let number = word.trim_start_matches(['-', '+']);
    if !number.starts_with(|first: char| first.is_ascii_digit()) {
        return Says::Nothing;
    }
    if number.contains(',') {
        let whole = number.split_once('.').map_or(number, |(whole, _)| whole);
        let mut parts = whole.split(',');
        let first =
            parts.next().is_some_and(|first| digits(first) && first.len() <= 3 && !first.starts_with('0'));
        let grouped = first && parts.all(|part| digits(part) && part.len() == 3);
        return if grouped { Says::Groups } else { Says::Other };
    }
    // A point before three digits may group thousands itself.
    match number.split_once('.') {
        Some((whole, decimals)) if digits(whole) && digits(decimals) => {
            let may_group = decimals.len() == 3 && !whole.starts_with('0');
            if may_group { Says::Nothing } else { Says::Point }
        }
        _ => Says::Nothing,
    }
}
