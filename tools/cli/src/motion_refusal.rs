//! Why a motion is refused, for people at this command's line: in its words, not in settings of a board.

use stillbeam_firmware::motion::MotionError;

/// The sentence for a motion that the firmware's planner refuses.
pub fn refusal(error: &MotionError) -> String {
    match error {
        MotionError::Travel { position_mm, range_mm } => format!(
            "it would go to {} mm, and the travel is from {} to {} mm (the firmware's default); ask for less",
            beyond(*position_mm, range_mm.0, range_mm.1),
            range_mm.0,
            range_mm.1
        ),
        MotionError::Velocity { needed_mm_s, limit_mm_s } => {
            over(*needed_mm_s, *limit_mm_s, "mm/s", "velocity")
        }
        MotionError::Acceleration { needed_mm_s2, limit_mm_s2 } => {
            over(*needed_mm_s2, *limit_mm_s2, "mm/s²", "acceleration")
        }
        MotionError::Jerk { needed_mm_s3, limit_mm_s3 } => over(*needed_mm_s3, *limit_mm_s3, "mm/s³", "jerk"),
        MotionError::Parameter { name, value, range: (low, high) } => {
            let (name, unit) = name_and_unit(name);
            let value = beyond(*value, *low, *high);
            let (low, high) = (rounded(*low, 3), rounded(*high, 3));
            format!("{name} is {value}{unit}; it has to be from {low}{unit} to {high}{unit}")
        }
        MotionError::NoMass => {
            "a force needs the mass that it moves, which only a board knows; give the amplitude in mm or mm/s2"
                .to_owned()
        }
        other => other.to_string(),
    }
}

fn over(needed: f64, limit: f64, unit: &str, what: &str) -> String {
    format!(
        "it needs a {what} of {} {unit}, and the limit is {} {unit} (the firmware's default); ask for a smaller amplitude or a lower highest frequency",
        beyond(needed, 0.0, limit),
        rounded(limit, 4)
    )
}

/// A name such as `AMPLITUDE_MM`, or `amplitude at the lowest frequency, in mm,`, and its unit with a blank.
fn name_and_unit(name: &str) -> (&str, &'static str) {
    if let Some(plain) = name.strip_suffix(", in mm,") {
        return (plain, " mm");
    }
    let units =
        [("_MM_S2", " mm/s²"), ("_MM", " mm"), ("_MM|", " mm"), ("_HZ", " Hz"), ("_S", " s"), ("_N", " N")];
    match units.into_iter().find(|(ending, _)| name.ends_with(ending)) {
        Some((_, unit)) => (name, unit),
        None if name.starts_with("SECONDS") => (name, " s"),
        None => (name, ""),
    }
}

/// A value outside a range to four digits, or to as many as show that it is outside.
fn beyond(value: f64, low: f64, high: f64) -> String {
    let is_outside = |digits: &usize| {
        let shown: f64 = rounded(value, *digits).parse().unwrap_or(value);
        !(low..=high).contains(&shown)
    };
    rounded(value, (4..=17).find(is_outside).unwrap_or(17))
}

/// A value to so many significant digits, without an exponent.
fn rounded(value: f64, digits: usize) -> String {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    text.parse::<f64>().unwrap_or(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_told_with_its_unit_and_as_many_digits_as_it_needs() {
        let told = |name, value, range| refusal(&MotionError::Parameter { name, value, range });
        assert_eq!(
            told("amplitude at the lowest frequency, in mm,", 101.321_183_642_337_77, (0.000_01, 100.0)),
            "amplitude at the lowest frequency is 101.3 mm; it has to be from 0.00001 mm to 100 mm"
        );
        assert_eq!(
            told("TO_HZ", 500.000_001, (0.01, 500.0)),
            "TO_HZ is 500.000001 Hz; it has to be from 0.01 Hz to 500 Hz"
        );
        assert!(told("SECONDS (by the rate)", 749_999.999_999_9, (0.1, 3600.0)).contains("is 750000 s"));
    }

    #[test]
    fn no_setting_of_a_board_is_named() {
        for error in [
            MotionError::Velocity { needed_mm_s: 612.345_678, limit_mm_s: 500.0 },
            MotionError::Acceleration { needed_mm_s2: 61_234.5, limit_mm_s2: 5000.0 },
            MotionError::Jerk { needed_mm_s3: 612_345.0, limit_mm_s3: 5000.0 },
            MotionError::Travel { position_mm: 5000.0, range_mm: (-250.0, 250.0) },
            MotionError::NoMass,
        ] {
            let told = refusal(&error);
            assert!(!told.contains("move.") && !told.contains("base.") && !told.contains("apply"), "{told}");
        }
    }
}
