//! Numbers as a person reads them.

/// `3.12 ± 0.10 N`: as many digits as the error's first two allow.
pub(crate) fn with_error(value: f64, stderr: f64, unit: &str) -> String {
    if !(stderr.is_finite() && stderr > 0.0 && value.is_finite()) {
        return format!("{value:.4e} {unit}").trim_end().to_owned();
    }
    let digits = 1 - stderr.log10().floor() as i32;
    let plain = value.abs() < 1e5 && (0..=8).contains(&digits);
    let text = if plain {
        let digits = usize::try_from(digits).unwrap_or(0);
        format!("{value:.digits$} ± {stderr:.digits$} {unit}")
    } else {
        let significant = (value.abs() / stderr).max(1.0).log10().floor().clamp(0.0, 8.0) as usize + 1;
        format!("({value:.significant$e} ± {stderr:.1e}) {unit}")
    };
    text.trim_end().to_owned()
}

/// Sizes of one column with three digits each, in millimetres where the column's name says metres, in the
/// column's own unit otherwise; and that unit.
pub(crate) fn sizes<const N: usize>(values: [f64; N], column: &str) -> ([String; N], String) {
    let metres = column.ends_with("_m");
    let factor = if metres { 1e3 } else { 1.0 };
    let unit = if metres {
        "mm".to_owned()
    } else {
        column.split_once('_').map_or_else(String::new, |_| format!("(in the unit of {column})"))
    };
    (values.map(|value| three_digits(factor * value)), unit)
}

/// Three significant digits, in plain figures where they are short.
fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    match usize::try_from(2 - magnitude) {
        Ok(digits) if digits <= 7 => format!("{value:.digits$}"),
        Err(_) if magnitude < 6 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_set_the_digits() {
        assert_eq!(with_error(3.1234, 0.0987, "N"), "3.123 ± 0.099 N");
        assert_eq!(with_error(0.059_997_6, 6.4e-6, "N"), "0.0599976 ± 0.0000064 N");
        assert_eq!(with_error(2e9, 3e7, "Pa"), "(2.00e9 ± 3.0e7) Pa");
    }

    #[test]
    fn metres_are_read_as_millimetres() {
        let (texts, unit) = sizes([0.011_69, 0.001_228, 5.03e-5], "tip_deflection_m");
        assert_eq!(texts, ["11.7", "1.23", "0.0503"]);
        assert_eq!(unit, "mm");
    }
}
