//! What a data set's labels and codes say about quantity and unit.

/// Specific data types of data set 58, records 8 to 10, with their names here and their SI units.
const QUANTITIES: [(i64, &str, &str); 12] = [
    (1, "response", ""),
    (2, "stress", "Pa"),
    (3, "strain", "strain"),
    (5, "temperature", "K"),
    (6, "heat_flux", "W_m2"),
    (8, "displacement", "m"),
    (9, "reaction_force", "N"),
    (11, "velocity", "m_s"),
    (12, "acceleration", "m_s2"),
    (13, "force", "N"),
    (15, "pressure", "Pa"),
    (18, "frequency", "Hz"),
];

/// Specific data types of time and of frequency.
pub(super) const TIME: i64 = 17;
pub(super) const FREQUENCY: i64 = 18;

/// Name of a quantity; `signal` for codes that name none.
pub(super) fn quantity(data_type: i64) -> &'static str {
    QUANTITIES.iter().find(|entry| entry.0 == data_type).map_or("signal", |entry| entry.1)
}

/// SI unit of a quantity.
pub(super) fn si_unit(data_type: i64) -> Option<&'static str> {
    let unit = QUANTITIES.iter().find(|entry| entry.0 == data_type)?.2;
    (!unit.is_empty()).then_some(unit)
}

/// Specific data type for a column's unit when writing; 0, unknown, where there is none.
pub(super) fn data_type(unit: &str) -> i64 {
    match unit {
        "m" | "mm" | "um" => 8,
        "m_s" | "mm_s" => 11,
        "m_s2" | "mm_s2" | "g" => 12,
        "N" => 13,
        "Pa" => 15,
        _ => 0,
    }
}

/// A column's unit as a label.
pub(super) fn label(unit: &str) -> String {
    match unit {
        "m_s" => "m/s".to_owned(),
        "m_s2" => "m/s^2".to_owned(),
        "mm_s" => "mm/s".to_owned(),
        "mm_s2" => "mm/s^2".to_owned(),
        "rad_s" => "rad/s".to_owned(),
        "rad_s2" => "rad/s^2".to_owned(),
        "deg_s" => "deg/s".to_owned(),
        "deg_s2" => "deg/s^2".to_owned(),
        "N_m" => "N*m".to_owned(),
        other => other.to_owned(),
    }
}

/// Which way a degree of freedom points: `x` to `z`, `rx` to `rz`, `_neg` against the axis; empty for a
/// scalar.
pub(super) fn direction(code: i64) -> String {
    let axis = match code.unsigned_abs() {
        1 => "_x",
        2 => "_y",
        3 => "_z",
        4 => "_rx",
        5 => "_ry",
        6 => "_rz",
        _ => return String::new(),
    };
    format!("{axis}{}", if code < 0 { "_neg" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit_label::of_label;

    #[test]
    fn units_that_are_written_are_read_back() {
        for unit in ["m", "mm", "m_s", "m_s2", "mm_s2", "N", "V", "rad_s2", "N_m", "percent", "g", "deg_s2"] {
            assert_eq!(of_label(&label(unit)).as_deref(), Some(unit));
        }
    }
}
