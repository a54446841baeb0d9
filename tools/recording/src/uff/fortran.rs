//! Numbers as Fortran's formatted input and output writes them.

/// A real number: exponents may be written with `D`, or without a letter when they have three digits.
pub(super) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        // "inf" and "nan" parse, but no format statement writes them as a measurement.
        return value.is_finite().then_some(value);
    }
    let plain: String = text.replace(['D', 'd'], "E");
    if let Ok(value) = plain.parse::<f64>() {
        return value.is_finite().then_some(value);
    }
    let sign = plain.rfind(['+', '-']).filter(|at| *at > 0)?;
    let (mantissa, exponent) = plain.split_at_checked(sign)?;
    let digits = exponent.get(1..)?;
    let bare = mantissa.ends_with(|c: char| c.is_ascii_digit() || c == '.')
        && digits.len() == 3
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    let value = format!("{mantissa}E{exponent}").parse::<f64>().ok()?;
    (bare && value.is_finite()).then_some(value)
}

/// An integer; blank is 0, as Fortran reads it.
pub(super) fn integer(text: &str) -> Option<i64> {
    let text = text.trim();
    if text.is_empty() { Some(0) } else { text.parse().ok() }
}

/// Columns `from..from + width` of a line, as far as it goes; 0-based, counted in characters.
pub(super) fn field(line: &str, from: usize, width: usize) -> &str {
    let mut starts = line.char_indices().map(|(at, _)| at).chain([line.len()]).skip(from);
    let start = starts.next().unwrap_or(line.len());
    let end = if width == 0 { start } else { starts.nth(width - 1).unwrap_or(line.len()) };
    line.get(start..end).unwrap_or("")
}

/// The numbers of a data line: separated by blanks or, where they abut, in columns of the widths, repeated.
pub(super) fn reals(line: &str, widths: &[usize]) -> Option<Vec<f64>> {
    let separated: Option<Vec<f64>> = line.split_ascii_whitespace().map(real).collect();
    separated.or_else(|| {
        let line = line.trim_end();
        let mut values = Vec::new();
        let mut at = 0;
        for width in widths.iter().cycle() {
            if at >= line.len() {
                break;
            }
            values.push(real(field(line, at, *width))?);
            at += width.max(&1);
        }
        Some(values)
    })
}

/// `E13.5`-like: a sign or blank, one digit, `digits` decimals, a two-digit exponent.
pub(super) fn exponential(value: f64, width: usize, digits: usize) -> String {
    let text = format!("{value:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((text.as_str(), "0"));
    let (sign, size) = match exponent.strip_prefix('-') {
        Some(size) => ('-', size),
        None => ('+', exponent),
    };
    format!("{:>width$}", format!("{mantissa}E{sign}{size:0>2}"))
}

/// As many digits as fit a field, a blank before them: intervals of the header would lose the time otherwise.
pub(super) fn densest(value: f64, width: usize) -> String {
    let forms = (0..17).rev().flat_map(|digits| [format!("{value:.digits$}"), format!("{value:.digits$e}")]);
    let fitting = forms.filter(|text| text.len() < width && text.contains('.'));
    let error = |text: &String| text.parse::<f64>().map_or(f64::INFINITY, |read| (read - value).abs());
    let best = fitting.min_by(|a, b| error(a).total_cmp(&error(b)));
    let best = best.unwrap_or_else(|| exponential(value, width, 5).trim().to_owned());
    format!("{best:>width$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortrans_ways_to_write_a_number_are_read() {
        let grid = [
            (" 1.50000e+00", 1.5),
            ("-1.5D+01", -15.0),
            ("1.5d-3", 0.0015),
            ("1.50000+100", 1.5e100),
            ("-2.-100", -2e-100),
            ("7", 7.0),
        ];
        for (text, value) in grid {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["", "x", "1+2", "nan", "inf", "1e999", "--1", "1.0+1000"] {
            assert_eq!(real(text), None, "{text}");
        }
    }

    #[test]
    fn abutting_fields_are_told_apart_by_their_columns() {
        assert_eq!(reals(" 1.0  -2.5", &[13]), Some(vec![1.0, -2.5]));
        assert_eq!(reals("-1.00000e+000-2.50000e+000", &[13]), Some(vec![-1.0, -2.5]));
        assert_eq!(reals("-1.00000e+000-2.500000000000e+00", &[13, 20]), Some(vec![-1.0, -2.5]));
        assert_eq!(reals("-1.00000e+000-2.50000x+000", &[13]), None);
        assert_eq!(reals("", &[13]), Some(vec![]));
    }

    #[test]
    fn numbers_are_written_in_their_columns() {
        assert_eq!(exponential(-1.5, 13, 5), " -1.50000E+00");
        assert_eq!(exponential(6.05469e-104, 13, 5), " 6.05469E-104");
        for value in [1.0 / 1651.6129, 0.01, 1.0 / 3.0, 2e-6, 1.0 / 44100.0, 12.5, 1e-9] {
            let text = densest(value, 13);
            assert_eq!(text.len(), 13);
            assert!(text.starts_with(' '));
            let read = real(&text).unwrap();
            assert!((read / value - 1.0).abs() < 1e-7, "{text} for {value}");
        }
    }
}
