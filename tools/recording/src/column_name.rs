//! What names of columns are made of: a quantity, and the unit that they end in.

/// Name of the first column of every recording: seconds.
pub const TIME_COLUMN: &str = "time_s";

/// Units written with more than one `_`-separated part, longest first.
const COMPOUND_UNITS: [&str; 10] =
    ["N_s_m", "rad_s2", "rad_s", "deg_s2", "deg_s", "mm_s2", "mm_s", "m_s2", "m_s", "N_m"];

/// The unit that a column name ends in, if it ends in one.
pub(crate) fn unit_of(name: &str) -> Option<&str> {
    for unit in COMPOUND_UNITS {
        if let Some(quantity) = name.strip_suffix(unit)
            && quantity.len() > 1
            && quantity.ends_with('_')
        {
            return name.get(quantity.len()..);
        }
    }
    let (quantity, unit) = name.rsplit_once('_')?;
    (!quantity.is_empty() && !unit.is_empty()).then_some(unit)
}
