//! The columns of a recording in SI units, by the names that models have for them.
//!
//! Modes are found in millimetres as well, but a model has metres, and knows a motion of the base by its
//! name.

use stillbeam_plant::{BASE_POSITION, SETPOINT};

use super::file::RecordingsTable;

/// Units of recordings, the SI unit of each, and how many of that it is.
const UNITS: [(&str, &str, f64); 18] = [
    ("mm", "m", 1e-3),
    ("um", "m", 1e-6),
    ("cm", "m", 1e-2),
    ("nm", "m", 1e-9),
    ("mm_s", "m_s", 1e-3),
    ("um_s", "m_s", 1e-6),
    ("cm_s", "m_s", 1e-2),
    ("mm_s2", "m_s2", 1e-3),
    ("cm_s2", "m_s2", 1e-2),
    // Standard gravity.
    ("g", "m_s2", 9.80665),
    ("mg", "m_s2", 9.80665e-3),
    ("kN", "N", 1e3),
    ("mN", "N", 1e-3),
    ("lbf", "N", 4.448_221_615_260_5),
    ("m", "m", 1.0),
    ("m_s", "m_s", 1.0),
    ("m_s2", "m_s2", 1.0),
    ("N", "N", 1.0),
];

/// Gives columns of these names to the entries, in SI units and under the names of models, and renames input
/// and output after them. What is neither motion nor force is left out, for another recording may not have
/// it. Where all are in SI units already, and where the columns were chosen, nothing changes.
pub fn name_in_si(names: &[String], recordings: &mut RecordingsTable) {
    if !recordings.columns.is_empty() {
        return;
    }
    let (input, output) = (recordings.input.clone(), recordings.output.clone());
    let mut renamed: Vec<(&str, String, f64)> = Vec::new();
    for name in names {
        let (new, scale) = in_si(name, input.as_deref() == Some(name.as_str()));
        let is_taken = names.contains(&new) || renamed.iter().any(|(_, other, _)| *other == new);
        let kept = || (name.as_str(), name.clone(), 1.0);
        renamed.push(if is_taken { kept() } else { (name, new, scale) });
    }
    if renamed.iter().all(|(old, new, _)| old == new) {
        return;
    }
    let after = |columns: &str| -> String {
        let each = columns.split(',').map(str::trim).map(|column| {
            renamed.iter().find(|(old, ..)| *old == column).map_or(column, |(_, new, _)| new.as_str())
        });
        each.collect::<Vec<_>>().join(",")
    };
    recordings.input = input.as_deref().map(after);
    recordings.output = recordings.output.as_deref().map(after);
    let is_known = |name: &str| UNITS.iter().any(|(unit, ..)| has_unit(name, unit));
    let is_named = |name: &str| {
        let named = [&input, &output].into_iter().flatten();
        named.flat_map(|columns| columns.split(',')).any(|column| column.trim() == name)
    };
    recordings.columns = renamed
        .iter()
        .filter(|(old, ..)| is_known(old) || is_named(old))
        .map(|(old, new, scale)| match *scale {
            1.0 => format!("{new}={old}"),
            scale => format!("{new}={old}*{scale}"),
        })
        .collect();
}

/// What a column is called in SI units, and how many of them its own unit is.
fn in_si(name: &str, is_input: bool) -> (String, f64) {
    let found = UNITS.iter().find(|(unit, ..)| has_unit(name, unit));
    let Some((unit, si, scale)) = found else { return (name.to_owned(), 1.0) };
    let is_motion = is_input && *si == "m";
    let new = match name.strip_suffix(unit) {
        _ if [SETPOINT, BASE_POSITION].contains(&name) => name.to_owned(),
        _ if is_motion && name.to_lowercase().contains("base") => BASE_POSITION.to_owned(),
        _ if is_motion => SETPOINT.to_owned(),
        Some(stem) => format!("{stem}{si}"),
        None => name.to_owned(),
    };
    (new, *scale)
}

/// Whether a column's name ends in a unit. No unit of the list ends in a mark and another one of it.
fn has_unit(name: &str, unit: &str) -> bool {
    name.strip_suffix(unit).is_some_and(|stem| stem.ends_with('_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str], input: Option<&str>, output: &str) -> RecordingsTable {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let mut table = RecordingsTable {
            input: input.map(str::to_owned),
            output: Some(output.to_owned()),
            ..RecordingsTable::default()
        };
        name_in_si(&names, &mut table);
        table
    }

    #[test]
    fn millimetres_become_metres_and_the_input_gets_the_name_of_models() {
        let names = ["ref_mm", "tip_mm", "acc_g", "t_degC", "out_V", "force_N"];
        let table = named(&names, Some("ref_mm"), "tip_mm,acc_g,out_V");
        assert_eq!(table.input.as_deref(), Some("setpoint_m"));
        assert_eq!(table.output.as_deref(), Some("tip_m,acc_m_s2,out_V"));
        assert_eq!(
            table.columns,
            [
                "setpoint_m=ref_mm*0.001",
                "tip_m=tip_mm*0.001",
                "acc_m_s2=acc_g*9.80665",
                "out_V=out_V",
                "force_N=force_N"
            ]
        );
        assert_eq!(
            named(&["Base_m", "tip_m"], Some("Base_m"), "tip_m").input.as_deref(),
            Some(BASE_POSITION)
        );
        assert_eq!(named(&["v_mm_s", "x_mm_s2"], None, "x_mm_s2").columns[1], "x_m_s2=x_mm_s2*0.001");
    }

    #[test]
    fn what_is_in_si_units_already_stays_as_it_is() {
        for input in [None, Some("setpoint_m"), Some("base_position_m"), Some("force_N")] {
            let names = ["setpoint_m", "base_position_m", "force_N", "tip_deflection_m"];
            let table = named(&names, input, "tip_deflection_m");
            assert_eq!((table.columns.len(), table.input.as_deref()), (0, input));
        }
        // A name that is taken is not given twice.
        let table = named(&["x_m", "x_mm", "ref_mm"], Some("ref_mm"), "x_mm");
        assert_eq!(table.columns, ["x_m=x_m", "x_mm=x_mm", "setpoint_m=ref_mm*0.001"]);
        assert_eq!(table.output.as_deref(), Some("x_mm"));
    }
}
