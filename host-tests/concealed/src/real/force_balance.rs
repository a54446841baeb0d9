//! The force that a model of the EMPS axis asks for on its held-out record, beside the force that was recorded.

use std::path::Path;

use super::table::Table;

/// Where position and forces are compared, hertz: the quantised position gives no acceleration above.
const BAND_HZ: f64 = 100.0;

/// What acts on one body that slides.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    mass: f64,
    viscous: f64,
    laws: Vec<(String, toml::Table)>,
}

impl Axis {
    /// From a model file; `None` for other structures, and for laws that are no function of speed and place alone.
    fn read(model: &str) -> Option<Self> {
        let model: toml::Table = model.parse().ok()?;
        let first = |kind: &str| model.get(kind)?.as_array()?.first()?.as_table();
        let laws = model.get("physics").and_then(|laws| laws.as_array()).into_iter().flatten();
        let law = |law: &toml::Value| {
            let table = law.as_table()?;
            let parameters = table.get("parameters").and_then(|p| p.as_table()).cloned();
            Some((table.get("id")?.as_str()?.to_owned(), parameters.unwrap_or_default()))
        };
        Some(Self {
            mass: number(first("body")?, "mass")?,
            viscous: first("damper").and_then(|damper| number(damper, "damping")).unwrap_or(0.0),
            laws: laws.map(law).collect::<Option<_>>()?,
        })
    }

    /// Force of the motor for a motion.
    fn force(&self, position: f64, velocity: f64, acceleration: f64) -> Option<f64> {
        let mut force = self.mass * acceleration + self.viscous * velocity;
        for (id, parameters) in &self.laws {
            let of = |name: &str| number(parameters, name).unwrap_or(0.0);
            let sign = if velocity == 0.0 { 0.0 } else { velocity.signum() };
            force += match id.as_str() {
                "coulomb_friction" => of("force") * sign,
                "stribeck_friction" => {
                    let slow = (-(velocity / of("velocity")).powi(2)).exp();
                    (of("force") + (of("static_force") - of("force")) * slow) * sign
                }
                "asymmetric_friction" if velocity > 0.0 => {
                    of("force_forward") + of("viscous_forward") * velocity
                }
                "asymmetric_friction" => of("force_backward") * sign + of("viscous_backward") * velocity,
                "viscous_friction" => of("damping") * velocity,
                "quadratic_drag" => of("drag") * velocity * velocity.abs(),
                "constant_force" => -of("force"),
                "cable_spring" => of("stiffness") * (position - of("rest_position")),
                _ => return None,
            };
        }
        Some(force)
    }
}

fn number(table: &toml::Table, key: &str) -> Option<f64> {
    let value = table.get(key)?;
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// Root mean square of recorded minus asked force over that of the recorded, in per cent, on the record with pulses; both below 100 Hz.
pub(super) fn force_error_percent(data: &Path, model: &str) -> Option<f64> {
    let axis = Axis::read(model)?;
    let table = Table::read(&data.join("emps/emps_validation_pulses.csv")).ok()?;
    force_error(&axis, table)
}

fn force_error(axis: &Axis, table: Table) -> Option<f64> {
    let table = table.band(0.0, BAND_HZ, 1);
    let (time_s, position) = (table.column("time_s"), table.column("position_m"));
    let recorded = table.column("motor_force_N");
    let step_s = time_s.get(1)? - time_s.first()?;
    let mut asked = Vec::new();
    for three in position.windows(3) {
        let velocity = (three[2] - three[0]) / (2.0 * step_s);
        let acceleration = (three[2] - 2.0 * three[1] + three[0]) / (step_s * step_s);
        asked.push(axis.force(three[1], velocity, acceleration)?);
    }
    // What the filter took from the force it takes from the force that is asked for, too: dry friction jumps.
    let middle = time_s.get(1..time_s.len().checked_sub(1)?)?.to_vec();
    let recorded = recorded.get(1..recorded.len().checked_sub(1)?)?.to_vec();
    let both =
        Table::of(vec![("time_s", middle), ("asked", asked), ("recorded", recorded)]).band(0.0, BAND_HZ, 1);
    let (asked, recorded) = (both.column("asked"), both.column("recorded"));
    let missed: f64 = asked.iter().zip(recorded).map(|(a, r)| (a - r).powi(2)).sum();
    Some(100.0 * (missed / recorded.iter().map(|r| r * r).sum::<f64>()).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = "schema = 1\nkind = \"lumped\"\n[[body]]\nname = \"slider\"\nmass = 90\n[[damper]]\nbetween = [\"slider\", \"ground\"]\ndamping = 200.0\n\
                         [[physics]]\nid = \"coulomb_friction\"\nlocation = \"slider\"\n[physics.parameters]\nforce = 20.0\n";

    /// A sinus of the position and the force that the model asks for, plus something.
    fn record(more: f64) -> Table {
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) * 1e-3).collect();
        let (size, omega) = (0.1, 3.0);
        let position = time_s.iter().map(|t| size * (omega * t).sin()).collect();
        let force = |t: &f64| {
            let v = size * omega * (omega * t).cos();
            -90.0 * size * omega * omega * (omega * t).sin() + 200.0 * v + 20.0 * v.signum() + more
        };
        let force = time_s.iter().map(force).collect();
        Table::of(vec![("time_s", time_s), ("position_m", position), ("motor_force_N", force)])
    }

    #[test]
    fn the_right_model_asks_for_the_force_that_was_recorded() {
        let axis = Axis::read(MODEL).unwrap();
        assert!(force_error(&axis, record(0.0)).unwrap() < 0.5);
        let without = Axis { laws: Vec::new(), ..axis.clone() };
        assert!(force_error(&without, record(0.0)).unwrap() > 20.0);
        let mut offset = axis;
        let force: toml::Table = "force = -5.0".parse().unwrap();
        offset.laws.push(("constant_force".to_owned(), force));
        assert!(force_error(&offset, record(5.0)).unwrap() < 0.5);
    }

    #[test]
    fn laws_that_remember_are_not_judged() {
        let axis = Axis::read(&MODEL.replace("coulomb_friction", "hysteresis")).unwrap();
        assert_eq!(force_error(&axis, record(0.0)), None);
    }
}
