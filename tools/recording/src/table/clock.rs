//! Dates and times of day as loggers write them.

/// Seconds of a day.
const DAY_S: i64 = 86_400;

/// A point in time: whole seconds and a fraction of one, so that a date does not cost digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Instant {
    pub(super) whole_s: i64,
    pub(super) fraction_s: f64,
}

impl Instant {
    /// Seconds after another one.
    pub(super) fn since(self, origin: Self) -> f64 {
        (self.whole_s - origin.whole_s) as f64 + (self.fraction_s - origin.fraction_s)
    }

    /// The same some seconds later.
    pub(super) fn plus(self, seconds: i64) -> Self {
        Self { whole_s: self.whole_s.saturating_add(seconds), ..self }
    }
}

/// What a cell says about the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Reading {
    /// A date and a time of day.
    DateTime(Instant),
    /// A time of day.
    TimeOfDay(Instant),
    /// A date alone, in days.
    Date(i64),
}

/// Reads `2025-03-02T09:15:07.5`, `02.03.2025 09:15:07,5`, `09:15:07.5`, `15:07.5`, `3/2/2025 9:15:07 PM` and
/// the like.
pub(super) fn parse(cell: &str) -> Option<Reading> {
    let cell = cell.trim_matches(['[', ']']).trim();
    if !cell.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let (head, tail) = match cell.find(['T', 't', ' ']) {
        Some(at) => (cell.get(..at)?, cell.get(at + 1..)?.trim()),
        None => (cell, ""),
    };
    match date(head) {
        Some(days) if tail.is_empty() => Some(Reading::Date(days)),
        Some(days) => Some(Reading::DateTime(time_of_day(tail)?.plus(days.checked_mul(DAY_S)?))),
        None => Some(Reading::TimeOfDay(time_of_day(cell)?)),
    }
}

/// Seconds after the first of dates and times of day; `None` where any is neither.
pub(crate) fn seconds_after<'t>(mut cells: impl Iterator<Item = &'t str>) -> Option<Vec<f64>> {
    let instant = |cell: &str| match parse(cell) {
        Some(Reading::DateTime(at) | Reading::TimeOfDay(at)) => Some(at),
        _ => None,
    };
    let origin = instant(cells.next()?)?;
    std::iter::once(Some(0.0)).chain(cells.map(|cell| Some(instant(cell)?.since(origin)))).collect()
}

/// The year that two digits mean.
fn with_century(digits: i64) -> i64 {
    if digits < 70 { 2000 + digits } else { 1900 + digits }
}

/// Days since 1970 of a date; of two small numbers before the year the first is the day, except in
/// `3/2/2025` and `03/02/25`.
fn date(text: &str) -> Option<i64> {
    let sign = text.chars().find(|c| matches!(c, '-' | '/' | '.'))?;
    let parts: Vec<&str> = text.split(sign).collect();
    let [a, b, c] = parts.as_slice() else { return None };
    let number =
        |part: &str| part.parse::<i64>().ok().filter(|_| part.bytes().all(|byte| byte.is_ascii_digit()));
    let (first, second, third) = (number(a)?, number(b)?, number(c)?);
    let (year, month, day) = match (a.len(), c.len()) {
        (4, _) => (first, second, third),
        (1..=2, 4) if sign == '/' && (second > 12 || first <= 12) => (third, first, second),
        (1..=2, 4) => (third, second, first),
        // Loggers leave the century out.
        (1..=2, 2) if sign == '/' && (second > 12 || first <= 12) => (with_century(third), first, second),
        (1..=2, 2) if sign == '/' => (with_century(third), second, first),
        _ => return None,
    };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1900..=2200).contains(&year) {
        return None;
    }
    // Days of the civil calendar, the year beginning in March.
    let years = if month <= 2 { year - 1 } else { year };
    let era = years.div_euclid(400);
    let of_era = years - 400 * era;
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(146_097 * era + 365 * of_era + of_era / 4 - of_era / 100 + of_year - 719_468)
}

fn time_of_day(text: &str) -> Option<Instant> {
    let upper = text.to_ascii_uppercase();
    let (text, shift) = match (upper.strip_suffix("PM"), upper.strip_suffix("AM")) {
        (Some(rest), _) => (rest.trim(), Some(12)),
        (_, Some(rest)) => (rest.trim(), Some(0)),
        _ => (upper.as_str(), None),
    };
    let (text, offset_s) = zone(text)?;
    let parts: Vec<&str> = text.split(':').collect();
    let small = |part: &str| part.parse::<i64>().ok().filter(|n| part.len() <= 2 && (0..=60).contains(n));
    let (hours, minutes, seconds) = match parts.as_slice() {
        [h, m, s] => (small(h)?, small(m)?, (*s).to_owned()),
        [m, s] if s.contains(['.', ',']) => (0, small(m)?, (*s).to_owned()),
        [h, m] => (small(h)?, small(m)?, "0".to_owned()),
        // Milliseconds after a third colon.
        [h, m, s, ms] if ms.len() == 3 => (small(h)?, small(m)?, format!("{s}.{ms}")),
        _ => return None,
    };
    let (whole, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds.as_str(), "0"));
    let fraction_s = format!("0.{fraction}").parse::<f64>().ok()?;
    let hours = match shift {
        Some(shift) => hours % 12 + shift,
        None => hours,
    };
    let whole_s = 3600 * hours + 60 * minutes + small(whole)? - offset_s;
    (0.0..1.0).contains(&fraction_s).then_some(Instant { whole_s, fraction_s })
}

/// Cuts off a zone: `Z`, `+01:00`, `-0500`; its seconds ahead of universal time.
fn zone(text: &str) -> Option<(&str, i64)> {
    if let Some(rest) = text.strip_suffix('Z').or_else(|| text.strip_suffix(" UTC")) {
        return Some((rest, 0));
    }
    let Some(at) = text.rfind(['+', '-']).filter(|at| *at >= 4) else { return Some((text, 0)) };
    let digits: String = text.get(at + 1..)?.chars().filter(|c| *c != ':').collect();
    let hours = digits.get(..2)?.parse::<i64>().ok()?;
    let minutes: i64 =
        digits.get(2..).filter(|rest| !rest.is_empty()).map_or(Some(0), |rest| rest.parse().ok())?;
    let ahead: i64 = 3600 * hours + 60 * i64::from(u8::try_from(minutes).ok()?);
    Some((text.get(..at)?.trim(), if text.get(at..)?.starts_with('-') { -ahead } else { ahead }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(text: &str) -> f64 {
        match parse(text) {
            Some(Reading::DateTime(at) | Reading::TimeOfDay(at)) => at.whole_s as f64 + at.fraction_s,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn dates_and_times_of_day_are_seconds() {
        let morning = 1_740_906_907.5;
        for text in [
            "2025-03-02T09:15:07.5",
            "2025-03-02 09:15:07.500",
            "2025/03/02 09:15:07,5",
            "02.03.2025 09:15:07.5",
            "3/2/2025 9:15:07.5 AM",
            "03/02/25 09:15:07.5 AM",
            "2025-03-02T09:15:07.5Z",
            "2025-03-02T10:15:07.5+01:00",
            "2025-03-02T04:15:07.5-0500",
            "2025-03-02 09:15:07:500",
        ] {
            assert_eq!(seconds(text), morning, "{text}");
        }
        assert_eq!(seconds("09:15:07.25"), 33_307.25);
        assert_eq!(seconds("15:07.25"), 907.25);
        assert_eq!(seconds("12:00:00 AM"), 0.0);
        assert_eq!(parse("2025-03-02"), Some(Reading::Date(20_149)));
        for text in ["", "1.5", "1,5", "oops", "1:2:3:4", "99:99:99", "2025-13-02", "1-2", "12:", "7-3+1"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
