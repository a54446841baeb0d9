//! What the header of a column says: what it is, and in which unit.

use crate::column_name::{TIME_COLUMN, unit_of};
use crate::unit_label::{enclosed, known, of_label, seconds};

/// The header of one column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heading {
    /// What the file calls it, and what options refer to.
    pub(crate) source: String,
    /// The quantity, as part of a column's name.
    pub(crate) quantity: String,
    /// The unit, as column names end in it; `None` where none is stated.
    pub(crate) unit: Option<String>,
}

/// Headers of a column of time stamps, without their unit, in small letters and without signs.
const TIMES: [&str; 28] = [
    "time",
    "t",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "timestamp",
    "timestamps",
    "times",
    "elapsed",
    "elapsedtime",
    "timeelapsed",
    "zeitstempel",
    "xvalue",
    "datetime",
    "datetimestamp",
    "clock",
    "uptime",
    "uhrzeit",
    "messzeit",
    "epoch",
    "unixtime",
    "timeofday",
    "host_time",
    "datenum",
    "serialdate",
    "zeitpunkt",
    "ts",
];
/// Headers of a column of frequencies.
const FREQUENCIES: [&str; 6] = ["freq", "frequency", "frequenz", "freqs", "frequencies", "frequence"];
/// Headers of a column that counts the samples.
const COUNTERS: [&str; 14] = [
    "sample", "samples", "index", "no", "nr", "n", "count", "counter", "i", "row", "number", "sequence",
    "seq", "idx",
];

impl Heading {
    /// Reads a header; `position` counts from 1, `unit_cell` is what a row of units has for the column.
    pub(crate) fn parse(text: &str, position: usize, unit_cell: Option<&str>) -> Self {
        let text = text.trim();
        let bare = text.trim_start_matches(['#', '%', ';', ' ']);
        let (quantity, unit) = match unit_cell.and_then(of_label) {
            Some(unit) => (split_unit(bare).map_or(bare, |(quantity, _)| quantity), Some(unit)),
            None => match split_unit(bare) {
                Some((quantity, unit)) => (quantity, Some(unit)),
                None => (bare, None),
            },
        };
        let mut quantity = slug(quantity);
        if quantity.is_empty() {
            quantity = format!("column_{position}");
        }
        let source = if text.is_empty() { position.to_string() } else { text.to_owned() };
        Self { source, quantity, unit }
    }

    /// The header of the values of one word, in a table that has all words in one column.
    pub(crate) fn of_word(heading: &Self, word: &str, position: usize) -> Self {
        let of_word = Self::parse(word, position, None);
        // `acc_x [g]` as a word states more than the `value` above it.
        let quantity = match (&of_word.unit, heading.quantity.as_str()) {
            (Some(_), _) | (_, "value" | "Value" | "_value") => of_word.quantity,
            (None, quantity) => format!("{quantity}_{}", slug(word)),
        };
        Self { source: word.to_owned(), quantity, unit: of_word.unit.or_else(|| heading.unit.clone()) }
    }

    /// A header as part of a column's name where nothing of it is a unit.
    pub(crate) fn whole(text: &str) -> String {
        slug(text)
    }

    /// The column's name: quantity and unit.
    pub(crate) fn name(&self) -> Option<String> {
        Some(format!("{}_{}", self.quantity, self.unit.as_ref()?))
    }

    /// Whether it is the time by its name, or by its unit where it stands first.
    pub(crate) fn is_time(&self, position: usize) -> bool {
        let plain =
            |text: &str| text.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
        let (word, whole) = (plain(&self.quantity), plain(&self.source));
        let time_unit = self.unit.as_deref().is_some_and(|unit| seconds(unit).is_some());
        let unit_fits = self.unit.is_none() || time_unit;
        let begins = ["time", "zeit", "elapsed", "timestamp"].iter().any(|start| word.starts_with(start))
            || ["time", "zeit"].iter().any(|end| word.ends_with(end));
        self.source == TIME_COLUMN
            || TIMES.contains(&whole.as_str())
            || unit_fits && (TIMES.contains(&word.as_str()) || position == 0 && begins)
            || position == 0 && time_unit
    }

    /// Whether it is a frequency, and so the axis of a spectrum where it stands first.
    pub(crate) fn is_frequency(&self) -> bool {
        let word: String = self.quantity.chars().filter(|c| *c != '_').collect::<String>().to_lowercase();
        let hertz = self.unit.as_deref().is_some_and(|unit| crate::unit_label::hertz(unit).is_some());
        (FREQUENCIES.contains(&word.as_str()) && (self.unit.is_none() || hertz)) || (word == "f" && hertz)
    }

    /// Whether it counts the samples by its name.
    pub(crate) fn is_counter(&self) -> bool {
        let plain = |text: &str| text.chars().filter(|c| *c != '_').collect::<String>().to_lowercase();
        let (word, last) = (plain(&self.quantity), plain(self.quantity.rsplit('_').next().unwrap_or("")));
        self.unit.is_none()
            && (self.source == "#"
                || COUNTERS.contains(&word.as_str())
                || COUNTERS.contains(&last.as_str())
                || self.source.parse::<usize>().is_ok())
    }

    /// Whether options mean it by this.
    pub(crate) fn is_called(&self, source: &str) -> bool {
        self.source == source
            || self.source.trim_start_matches(['#', '%', ' ']) == source
            || self.quantity == source
            || self.name().as_deref() == Some(source)
    }
}

/// Takes back units that are letters of an enumeration: of `Channel A` and `Channel B` neither is in amperes.
pub(crate) fn without_letters(headings: &mut [Heading]) {
    let letters: Vec<Option<(String, char)>> =
        headings.iter().map(|heading| letter(&heading.source)).collect();
    for (heading, own) in headings.iter_mut().zip(&letters) {
        let Some((stem, letter)) = own else { continue };
        let mut siblings =
            letters.iter().flatten().filter(|(other, _)| other == stem).map(|(_, letter)| letter);
        let is_enumeration = siblings.any(|other| other != letter && known(&other.to_string()).is_none());
        let stated = heading.unit.as_ref().is_some_and(|unit| *unit != letter.to_string());
        if is_enumeration {
            heading.quantity = slug(&heading.source);
            heading.unit = heading.unit.take().filter(|_| stated);
        }
    }
}

/// What stands before a capital letter at the end of a header, and that letter.
fn letter(source: &str) -> Option<(String, char)> {
    let last = source.chars().next_back().filter(char::is_ascii_uppercase)?;
    let stem = source.strip_suffix(last)?;
    stem.ends_with([' ', '_']).then(|| (stem.to_owned(), last))
}

/// Splits a header into quantity and unit, in the ways in which people write it.
fn split_unit(text: &str) -> Option<(&str, String)> {
    let bracketed = [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')].iter().find_map(|(open, close)| {
        let inner = text.strip_suffix(*close)?;
        let at = inner.rfind(*open)?;
        Some((text.get(..at)?, text.get(at..)?))
    });
    if let Some((quantity, unit)) = bracketed {
        let inner = enclosed(unit).unwrap_or("");
        let surely =
            unit.starts_with(['[', '{']) || inner.contains(['/', '^', '*', '·', '²', 'µ', 'μ', '°', '%']);
        let unit = if surely { of_label(inner) } else { known(inner) };
        // Gauss is nothing that accelerates.
        let accelerates = inner == "G" && quantity.to_lowercase().contains("acc");
        return Some((quantity.trim(), unit.or_else(|| accelerates.then(|| "g".to_owned()))?));
    }
    for (sign, blanks) in [(" in ", true), (" / ", true), (", ", true), (":", false), ("/", false)] {
        if let Some((quantity, unit)) = text.split_once(sign)
            && let Some(found) = known(unit.trim())
            && !quantity.trim().is_empty()
            && (blanks
                || quantity.trim().chars().count() > 2
                || sign == "/" && is_symbol(text, quantity.trim()))
        {
            return Some((quantity.trim(), found));
        }
    }
    if let Some(unit) = text.strip_prefix("in ").and_then(known) {
        return Some((if seconds(&unit).is_some() { "time" } else { "" }, unit));
    }
    // `millis` is a unit; a single letter is rather a name, except for seconds.
    let whole = known(text).filter(|unit| text.chars().count() > 1 || unit == "s");
    if let Some(unit) = whole.filter(|unit| !text.contains('_') && (seconds(unit).is_none() || text != "t")) {
        let quantity = if seconds(&unit).is_some() { "time" } else { "" };
        return Some((quantity, unit));
    }
    for (at, _) in text.match_indices([' ', '_']) {
        if let (Some(quantity), Some(unit)) = (text.get(..at), text.get(at + 1..))
            && !quantity.trim_matches(['_', ' ']).is_empty()
            && let Some(found) = known(unit.trim())
        {
            return Some((quantity.trim(), found));
        }
    }
    // Whatever stands behind the last `_` is a unit by the convention of recordings.
    let unit =
        unit_of(text).filter(|unit| unit.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_'))?;
    let quantity = text.strip_suffix(unit)?.strip_suffix('_')?;
    Some((quantity, unit.to_owned()))
}

/// Whether what stands before the slash of a header is the symbol of a quantity (`F/N`, `t/ms`), and not a
/// unit (`m/s`, `V/g`); `s` is a way as well.
fn is_symbol(text: &str, quantity: &str) -> bool {
    known(text).is_none() && (known(quantity).is_none() || quantity == "s")
}

/// Text as part of a column's name.
fn slug(text: &str) -> String {
    let mut slug = String::new();
    for character in text.trim().chars() {
        // Names that are plain stay as they are, with all their `_`.
        if character.is_alphanumeric() || character == '_' {
            slug.push(character);
        } else if !slug.ends_with('_') && !slug.is_empty() {
            slug.push('_');
        }
    }
    let end = slug.trim_end_matches('_').len();
    slug.truncate(end);
    slug
}

/// Whether every cell of a row is a unit, in brackets or known, or empty.
pub(crate) fn are_units(cells: &[&str]) -> bool {
    let is_unit = |cell: &str| known(cell).is_some() || enclosed(cell).is_some_and(|inner| inner.len() < 16);
    let nothing = |cell: &str| cell.is_empty() || matches!(cell, "-" | "--" | "[]" | "()" | "none" | "None");
    cells.iter().any(|cell| is_unit(cell)) && cells.iter().all(|cell| nothing(cell) || is_unit(cell))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_however_they_are_written() {
        let grid = [
            ("ref [mm]", "ref", Some("mm")),
            ("moment (N*m)", "moment", Some("N_m")),
            ("accel m/s^2", "accel", Some("m_s2")),
            ("x_mm", "x", Some("mm")),
            ("acc_m_s2", "acc", Some("m_s2")),
            ("tip_deflection_m", "tip_deflection", Some("m")),
            ("speed_m_s", "speed", Some("m_s")),
            ("a / m/s²", "a", Some("m_s2")),
            ("Weg in µm", "Weg", Some("um")),
            ("F/N", "F", Some("N")),
            ("t/ms", "t", Some("ms")),
            ("a/g", "a", Some("g")),
            ("s/mm", "s", Some("mm")),
            ("m/s", "column_3", Some("m_s")),
            ("V/g", "V_g", None),
            ("C1 in V", "C1", Some("V")),
            ("accelerometerX(G)", "accelerometerX", Some("g")),
            ("field(G)", "field_G", None),
            ("Force, N", "Force", Some("N")),
            ("Kraft:kN", "Kraft", Some("kN")),
            ("Acc. X (g)", "Acc_X", Some("g")),
            ("gyro [°/s]", "gyro", Some("deg_s")),
            ("Volt", "column_3", Some("V")),
            ("accel_x", "accel", Some("x")),
            ("acc_m/s^2", "acc", Some("m_s2")),
            ("ax", "ax", None),
            ("X", "X", None),
            ("acc (x)", "acc_x", None),
            ("", "column_3", None),
        ];
        for (text, quantity, unit) in grid {
            let found = Heading::parse(text, 3, None);
            assert_eq!((found.quantity.as_str(), found.unit.as_deref()), (quantity, unit), "{text}");
        }
        let found = Heading::parse("Channel 1", 2, Some("[mm/s²]"));
        assert_eq!(found.name().as_deref(), Some("Channel_1_mm_s2"));
    }

    #[test]
    fn times_frequencies_and_counters_are_told_by_their_names() {
        for text in [
            "time_s",
            "Time (ms)",
            "t",
            "#time",
            "Zeit [s]",
            "millis",
            "micros",
            "Time Stamp",
            "timestamp_ns",
            "X_Value",
            "seconds",
            "Second",
            "Date/Time",
            "t [us]",
            "s",
            "time since start",
            "Relative Time",
            "in s",
            "Messzeit",
            "t/ms",
        ] {
            assert!(Heading::parse(text, 1, None).is_time(0), "{text}");
        }
        for text in ["acc_m_s2", "x", "Count", "temperature_degC", "force (N)", "tip"] {
            assert!(!Heading::parse(text, 1, None).is_time(0), "{text}");
        }
        for text in ["freq", "Frequency [Hz]", "frequency_hz", "f [kHz]"] {
            assert!(Heading::parse(text, 1, None).is_frequency(), "{text}");
        }
        for text in ["Sample", "#", "index", "No."] {
            assert!(Heading::parse(text, 1, None).is_counter(), "{text}");
        }
    }
}
