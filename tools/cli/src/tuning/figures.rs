//! Numbers for people.

/// A fraction in per cent.
pub(super) fn percent(fraction: f64) -> String {
    format!("{} %", three_digits(100.0 * fraction))
}

/// A duration.
pub(super) fn seconds(duration_s: f64) -> String {
    format!("{} s", three_digits(duration_s))
}

/// Three significant digits, without zeros at the end.
fn three_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_no_idle_zeros() {
        let texts = [0.05, 0.0746, 0.000_012_34, 1.0, 0.0].map(percent);
        assert_eq!(texts, ["5 %", "7.46 %", "0.00123 %", "100 %", "0 %"]);
        assert_eq!(seconds(1.0537), "1.05 s");
        assert_eq!(seconds(123.4), "123 s");
    }
}
