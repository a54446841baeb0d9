//! Lengths on the command line: a number with its unit, or in millimetres.

use std::str::FromStr;

use crate::error::CliError;

/// A length that a person wrote: `50`, `50mm`, `5cm`, `0.05m`, `50um`. A bare number is in millimetres, as on
/// the board's console.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Length {
    metres: f64,
    /// Whether the unit was left out.
    bare: bool,
}

/// Units and their metres, longest first where one ends in another.
const UNITS: [(&str, f64); 7] =
    [("mm", 1e-3), ("cm", 1e-2), ("µm", 1e-6), ("μm", 1e-6), ("um", 1e-6), ("nm", 1e-9), ("m", 1.0)];

/// A bare length below this many millimetres may have been meant in metres.
const MEANT_IN_METRES_MM: f64 = 1.0;

impl Length {
    /// In metres.
    pub fn metres(self) -> f64 {
        self.metres
    }

    /// In millimetres.
    pub fn millimetres(self) -> f64 {
        1e3 * self.metres
    }

    /// A remark where the unit was left out of a number that would rather be metres.
    pub fn doubt(self) -> Option<String> {
        let length_mm = self.millimetres();
        let doubtful = self.bare && length_mm != 0.0 && length_mm.abs() < MEANT_IN_METRES_MM;
        doubtful.then(|| format!("{length_mm} is read as {length_mm} mm; write {length_mm}m for metres"))
    }
}

impl FromStr for Length {
    type Err = CliError;

    fn from_str(text: &str) -> Result<Self, CliError> {
        let trimmed = text.trim();
        let unit = UNITS.iter().find_map(|(unit, metres)| Some((trimmed.strip_suffix(unit)?, *metres)));
        let (number, factor) = unit.unwrap_or((trimmed, 1e-3));
        match number.trim_end().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Self { metres: number * factor, bare: unit.is_none() }),
            _ => Err(CliError::Usage(format!(
                "`{text}` is no length; write a number with its unit, such as 50mm, 5cm or 0.05m (a bare number is in mm)"
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_read_with_its_unit_and_a_bare_number_is_millimetres() {
        for (text, metres) in [
            ("50", 0.05),
            ("-50mm", -0.05),
            ("50 mm", 0.05),
            ("5cm", 0.05),
            ("0.05m", 0.05),
            ("120um", 120e-6),
            ("120µm", 120e-6),
            ("3e2nm", 300e-9),
            ("0", 0.0),
        ] {
            let length: Length = text.parse().expect(text);
            assert!((length.metres() - metres).abs() <= 1e-15 * metres.abs(), "{text}: {length:?}");
            assert_eq!(length.doubt(), None, "{text}");
        }
        for text in ["", "mm", "5 inch", "5 m m", "nan", "inf m", "5mm2", "1,5"] {
            let refused = text.parse::<Length>().expect_err(text).to_string();
            assert!(refused.contains("such as 50mm"), "{refused}");
        }
    }

    #[test]
    fn a_bare_number_that_would_rather_be_metres_is_remarked_on() {
        let remark = "0.05".parse::<Length>().ok().and_then(Length::doubt).unwrap();
        assert_eq!(remark, "0.05 is read as 0.05 mm; write 0.05m for metres");
    }
}
