//! Units as people and programs write them, and as column names end in them.

/// Words and abbreviations that are not spelled as column names have it; compared without regard to case.
const WORDS: [(&str, &str); 59] = [
    ("sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("sekunden", "s"),
    ("msec", "ms"),
    ("millis", "ms"),
    ("millisecond", "ms"),
    ("milliseconds", "ms"),
    ("usec", "us"),
    ("micros", "us"),
    ("microsecond", "us"),
    ("microseconds", "us"),
    ("nsec", "ns"),
    ("nanos", "ns"),
    ("nanosecond", "ns"),
    ("nanoseconds", "ns"),
    ("msecs", "ms"),
    ("millisec", "ms"),
    ("usecs", "us"),
    ("microsec", "us"),
    ("nsecs", "ns"),
    ("nanosec", "ns"),
    ("nanosecs", "ns"),
    ("minute", "min"),
    ("minutes", "min"),
    ("mins", "min"),
    ("hour", "h"),
    ("hours", "h"),
    ("hr", "h"),
    ("sec2", "s2"),
    ("newton", "N"),
    ("newtons", "N"),
    ("volt", "V"),
    ("volts", "V"),
    ("millivolt", "mV"),
    ("millivolts", "mV"),
    ("amp", "A"),
    ("amps", "A"),
    ("ampere", "A"),
    ("amperes", "A"),
    ("hertz", "Hz"),
    ("hz", "Hz"),
    ("khz", "kHz"),
    ("meter", "m"),
    ("meters", "m"),
    ("metre", "m"),
    ("metres", "m"),
    ("micron", "um"),
    ("microns", "um"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("g's", "g"),
    ("gn", "g"),
    ("gee", "g"),
    ("pascal", "Pa"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("radians", "rad"),
];

/// Units that count as such when nothing but the end of a header says so.
const KNOWN: [&str; 62] = [
    "s", "ms", "us", "ns", "min", "h", "m", "mm", "um", "nm", "cm", "km", "in", "ft", "mil", "m_s", "mm_s",
    "um_s", "cm_s", "in_s", "ft_s", "km_h", "m_s2", "mm_s2", "cm_s2", "in_s2", "ft_s2", "g", "mg", "rad",
    "mrad", "deg", "rad_s", "deg_s", "rad_s2", "deg_s2", "rpm", "Hz", "kHz", "N", "kN", "mN", "lbf", "N_m",
    "mN_m", "Nmm", "Pa", "kPa", "MPa", "bar", "V", "mV", "uV", "A", "mA", "W", "K", "degC", "C", "percent",
    "dB", "counts",
];

/// A unit label as the end of a column's name, no character of it dropped: `m/s²` gives `m_s2`, `µm` gives
/// `um`.
///
/// `None` for an empty label, for `NONE` and the like, and for one with characters that column names cannot
/// carry.
pub(crate) fn of_label(label: &str) -> Option<String> {
    let label = label.trim();
    let label = enclosed(label).unwrap_or(label).trim();
    let nothing = ["none", "unknown", "n/a", "na", "-", "--", "no unit", "unitless"];
    if label.is_empty() || nothing.iter().any(|word| label.eq_ignore_ascii_case(word)) {
        return None;
    }
    let whole = [
        ("%", "percent"),
        ("g's", "g"),
        ("°", "deg"),
        ("Nm", "N_m"),
        ("N.m", "N_m"),
        ("fullscale", "fullscale"),
    ];
    if let Some((_, unit)) = whole.iter().find(|(known, _)| label == *known) {
        return Some((*unit).to_owned());
    }
    let mut plain = String::new();
    for character in label.replace("**", "^").chars() {
        match character {
            '^' => {}
            '²' => plain.push('2'),
            '³' => plain.push('3'),
            // A negative exponent divides: s-2 and s⁻² stand for /s2.
            '⁻' => plain.push('-'),
            '¹' => plain.push('1'),
            '/' | '*' | '·' | '⋅' | '×' | ' ' | '_' | '.' => plain.push('_'),
            'µ' | 'μ' => plain.push('u'),
            '°' => plain.push_str("deg"),
            '\u{3a9}' | '\u{2126}' => plain.push_str("ohm"),
            '%' => plain.push_str("percent"),
            '-' | '\'' => plain.push(character),
            '(' | ')' => {}
            other if other.is_ascii_alphanumeric() => plain.push(other),
            _ => return None,
        }
    }
    let parts: Vec<String> = plain.split('_').filter(|part| !part.is_empty()).map(part).collect();
    let unit = parts.join("_").replace("_s_s", "_s2").replace(['-', '\''], "_");
    let unit = unit.trim_matches('_');
    (unit.bytes().any(|byte| byte.is_ascii_alphabetic())).then(|| unit.to_owned())
}

/// One factor of a unit: its exponent's sign is the place that `/` gives it, and words are abbreviated.
fn part(text: &str) -> String {
    let text = match text.split_once('-') {
        Some((unit, "1")) => unit.to_owned(),
        Some((unit, exponent)) if exponent.bytes().all(|byte| byte.is_ascii_digit()) => {
            format!("{unit}{exponent}")
        }
        _ => text.to_owned(),
    };
    let word = WORDS.iter().find(|(known, _)| text.eq_ignore_ascii_case(known));
    word.map_or(text, |(_, unit)| (*unit).to_owned())
}

/// The unit of a label if it is one that is known; for text that may be something else as well.
pub(crate) fn known(label: &str) -> Option<String> {
    of_label(label).and_then(|unit| {
        let exact = KNOWN.contains(&unit.as_str()).then(|| unit.clone());
        // Some programs write everything in capitals.
        exact.or_else(|| (label.trim() == "M/S^2" || label.trim() == "M/S2").then(|| "m_s2".to_owned()))
    })
}

/// What stands in a pair of brackets.
pub(crate) fn enclosed(text: &str) -> Option<&str> {
    [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')]
        .iter()
        .find_map(|(open, close)| text.strip_prefix(*open)?.strip_suffix(*close))
}

/// How many seconds one unit of time is.
pub(crate) fn seconds(unit: &str) -> Option<f64> {
    Some(match unit {
        "s" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        "ns" => 1e-9,
        "ps" => 1e-12,
        "min" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        _ => return None,
    })
}

/// How many hertz one unit of frequency is.
pub(crate) fn hertz(unit: &str) -> Option<f64> {
    Some(match unit {
        "Hz" | "1_s" | "S_s" | "Sa_s" | "samples_s" | "Samples_s" => 1.0,
        "kHz" | "kS_s" | "kSa_s" => 1e3,
        "MHz" | "MS_s" | "MSa_s" => 1e6,
        "mHz" => 1e-3,
        "rad_s" => std::f64::consts::TAU.recip(),
        "rpm" | "cpm" | "RPM" | "CPM" => 1.0 / 60.0,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_become_units_of_column_names() {
        let grid = [
            ("m/s^2", "m_s2"),
            ("m/s2", "m_s2"),
            ("m/s²", "m_s2"),
            ("m/s/s", "m_s2"),
            ("m s^-2", "m_s2"),
            ("m s⁻²", "m_s2"),
            ("m·s-1", "m_s"),
            ("[mm/s^2]", "mm_s2"),
            ("m/sec**2", "m_s2"),
            ("mm/s^2", "mm_s2"),
            ("g", "g"),
            ("µm", "um"),
            ("μm", "um"),
            ("N*m", "N_m"),
            ("Nm", "N_m"),
            ("(N·m)", "N_m"),
            ("°/s", "deg_s"),
            ("°C", "degC"),
            ("%", "percent"),
            ("kΩ", "kohm"),
            ("  V ", "V"),
            ("Volts", "V"),
            ("usec", "us"),
        ];
        for (text, unit) in grid {
            assert_eq!(of_label(text).as_deref(), Some(unit), "{text}");
        }
        for text in ["", "  ", "NONE", "none", "^", "?", "?m", "\u{fffd}m", "n/a", "-", "12"] {
            assert_eq!(of_label(text), None, "{text}");
        }
    }

    #[test]
    fn times_and_frequencies_have_a_scale() {
        assert_eq!(of_label("msec").as_deref().and_then(seconds), Some(1e-3));
        assert_eq!(of_label("Minutes").as_deref().and_then(seconds), Some(60.0));
        assert_eq!(of_label("rad/s").as_deref().and_then(hertz), Some(std::f64::consts::TAU.recip()));
        assert_eq!((seconds("mm"), hertz("s")), (None, None));
    }
}
