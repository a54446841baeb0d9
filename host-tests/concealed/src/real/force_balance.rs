//! The force of the EMPS axis: a balance of its training record with the laws that were named, judged on its
//! held-out record.

use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::table::Table;

/// Where position and forces are compared, hertz, as the benchmark's own decimation by ten leaves it: Coulomb
/// friction and an offset give 5.80 %, friction that differs by direction 5.17 %, no dry friction 16.8 %.
const BAND_HZ: f64 = 40.0;
const TRAIN: &str = "emps/emps_estimation.csv";
const HELD_OUT: &str = "emps/emps_validation_pulses.csv";
/// Name of the columns that are parts of the force; they are told apart by their order.
const PART: &str = "part";

type Laws = Vec<(String, toml::Table)>;

/// Place of laws that are none of the axis.
const SENSOR: &str = "sensor";

/// The laws of the axis in a model file with their parameters; `None` if it is none.
fn laws(model: &str) -> Option<Laws> {
    let model: toml::Table = model.parse().ok()?;
    let laws = model.get("physics").and_then(|laws| laws.as_array()).into_iter().flatten();
    let law = |law: &toml::Value| {
        let table = law.as_table()?;
        let parameters = table.get("parameters").and_then(|p| p.as_table()).cloned();
        Some((table.get("id")?.as_str()?.to_owned(), parameters.unwrap_or_default()))
    };
    laws.filter(|law| law.get("location").and_then(|place| place.as_str()) != Some(SENSOR)).map(law).collect()
}

/// What the force is made of at one instant: mass, viscous friction, and every law in units of its strengths;
/// `None` for laws that are no function of place and speed alone.
fn parts(laws: &[(String, toml::Table)], [x, v, a]: [f64; 3]) -> Option<Vec<f64>> {
    let mut parts = vec![a, v];
    let sign = if v == 0.0 { 0.0 } else { v.signum() };
    for (id, parameters) in laws {
        match id.as_str() {
            "coulomb_friction" => parts.push(sign),
            "asymmetric_friction" => parts.extend([sign, f64::from(u8::from(v > 0.0)), sign * v]),
            "stribeck_friction" => {
                let slow = v / number(parameters, "velocity")?;
                parts.extend([sign, sign * (-slow * slow).exp()]);
            }
            "quadratic_drag" => parts.push(v * v.abs()),
            "bilinear_damping" => parts.push(v.max(0.0)),
            "constant_force" => parts.push(1.0),
            "cable_spring" => parts.extend([x, 1.0]),
            "cubic_stiffness" => parts.push(x * x * x),
            "quadratic_stiffness" => parts.push(x * x),
            "viscous_friction" => {}
            _ => return None,
        }
    }
    Some(parts)
}

fn number(table: &toml::Table, key: &str) -> Option<f64> {
    let value = table.get(key)?;
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// Root mean square of recorded minus balanced force over that of the recorded, in per cent, on the record
/// with pulses; below 40 Hz.
pub(super) fn force_error_percent(data: &Path, model: &str) -> Option<f64> {
    force_error(&laws(model)?, Table::read(&data.join(TRAIN)).ok()?, Table::read(&data.join(HELD_OUT)).ok()?)
}

fn force_error(laws: &[(String, toml::Table)], train: Table, held_out: Table) -> Option<f64> {
    let (known, force) = balance(laws, train)?;
    // Strengths that the record does not show (twice the same part) stay at zero.
    let strengths = known.svd(true, true).solve(&force, 1e-9).ok()?;
    let (asked, recorded) = balance(laws, held_out)?;
    Some(100.0 * (&recorded - asked * strengths).norm() / recorded.norm())
}

/// One column per part of the force, and the recorded force.
fn balance(laws: &[(String, toml::Table)], table: Table) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let table = table.band(0.0, BAND_HZ, 1);
    let (time_s, position) = (table.column("time_s"), table.column("position_m"));
    let step_s = time_s.get(1)? - time_s.first()?;
    let motion = |three: &[f64]| -> [f64; 3] {
        let [before, now, after] = [three[0], three[1], three[2]];
        [now, (after - before) / (2.0 * step_s), (after - 2.0 * now + before) / (step_s * step_s)]
    };
    let rows: Vec<Vec<f64>> =
        position.windows(3).map(|three| parts(laws, motion(three))).collect::<Option<_>>()?;
    let middle = |column: &[f64]| column.get(1..column.len().saturating_sub(1)).map(<[f64]>::to_vec);
    // What the filter took from the force it takes from its parts, too: dry friction jumps.
    let mut columns = vec![("time_s", middle(time_s)?), ("recorded", middle(table.column("motor_force_N"))?)];
    for part in 0..rows.first()?.len() {
        columns.push((PART, rows.iter().map(|row| row[part]).collect()));
    }
    let mut filtered = Table::of(columns).band(0.0, BAND_HZ, 1).into_columns().into_iter().skip(1);
    let force = DVector::from_vec(filtered.next()?);
    let parts: Vec<DVector<f64>> = filtered.map(DVector::from_vec).collect();
    Some((DMatrix::from_columns(&parts), force))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = "schema = 1\nkind = \"lumped\"\n[[physics]]\nid = \"coulomb_friction\"\nlocation = \"slider\"\n[physics.parameters]\nforce = 20.0\n";

    /// A sine of the position and the force that it takes.
    fn record(omega: f64, offset: f64) -> Table {
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) * 1e-3).collect();
        let size = 0.1;
        let position = time_s.iter().map(|t| size * (omega * t).sin()).collect();
        let force = |t: &f64| {
            let v = size * omega * (omega * t).cos();
            -90.0 * size * omega * omega * (omega * t).sin() + 200.0 * v + 20.0 * v.signum() + offset
        };
        let force = time_s.iter().map(force).collect();
        Table::of(vec![("time_s", time_s), ("position_m", position), ("motor_force_N", force)])
    }

    #[test]
    fn the_right_laws_balance_a_record_that_they_were_not_fitted_to() {
        let right = laws(MODEL).unwrap();
        assert!(force_error(&right, record(3.0, 0.0), record(4.0, 0.0)).unwrap() < 0.5);
        assert!(force_error(&[], record(3.0, 0.0), record(4.0, 0.0)).unwrap() > 5.0);
        assert!(force_error(&right, record(3.0, 5.0), record(4.0, 5.0)).unwrap() > 3.0);
        let offset = [right, vec![("constant_force".to_owned(), toml::Table::new())]].concat();
        assert!(force_error(&offset, record(3.0, 5.0), record(4.0, 5.0)).unwrap() < 0.5);
    }

    #[test]
    fn laws_that_remember_are_not_judged() {
        let remembers = laws(&MODEL.replace("coulomb_friction", "hysteresis")).unwrap();
        assert_eq!(force_error(&remembers, record(3.0, 0.0), record(4.0, 0.0)), None);
    }
}
