//! Bodies joined by springs and dampers: a slider on rails, a gear train, a circuit.

use std::collections::{BTreeMap, HashSet};

use super::beam_on_base::check_input;
use super::invalid::{InvalidParameter, Problem, distinct_columns, finite, positive};
use super::{Input, Quantity, Setup, unit_of};

/// The name that stands for the ground in `between`.
pub const GROUND: &str = "ground";

/// The most bodies that a model may have.
pub const MAX_BODIES: usize = 16;

/// A body: a mass in kilograms, an inertia in kg·m², an inductance in henries.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its name: letters, digits and `_`.
    pub name: String,
    /// Its mass, above 0.
    pub mass: f64,
}

/// A spring or a damper.
#[derive(Debug, Clone, PartialEq)]
pub struct Connection {
    /// What it joins: two bodies, or a body and [`GROUND`].
    pub between: [String; 2],
    /// Stiffness in force per displacement, or damping in force per velocity. A negative stiffness is a
    /// magnetic or gravitational one and is accepted; a negative damping is not.
    pub constant: f64,
}

impl Connection {
    /// Whether it joins these two, in either order.
    fn joins(&self, first: &str, second: &str) -> bool {
        let [a, b] = &self.between;
        (a == first && b == second) || (a == second && b == first)
    }
}

/// What drives a lumped model.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedInput {
    /// The column and its gain.
    pub signal: Input,
    /// The body it acts on.
    pub body: String,
    /// Whether the column is the body's position (`quantity = "position"`) rather than a force on it.
    pub moves_body: bool,
}

/// One output of a lumped model.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedOutput {
    /// Its column.
    pub column: String,
    /// The body it looks at.
    pub body: String,
    /// Position, velocity or acceleration.
    pub quantity: Quantity,
    /// Against another body instead of the ground.
    pub relative_to: Option<String>,
}

/// Bodies, springs and dampers along one line or round one axis: `kind = "lumped"`.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedModel {
    /// The bodies, 1 to [`MAX_BODIES`].
    pub bodies: Vec<Body>,
    /// The springs, at most one per pair.
    pub springs: Vec<Connection>,
    /// The dampers, at most one per pair.
    pub dampers: Vec<Connection>,
    /// What drives it; `None` is a free decay.
    pub input: Option<LumpedInput>,
    /// What a simulation computes, at least one.
    pub outputs: Vec<LumpedOutput>,
    /// Parameters that a refit must not move, by path.
    pub fixed: BTreeMap<String, bool>,
    /// Controller, initial state, sensors, left-out physics.
    pub setup: Setup,
}

impl LumpedModel {
    /// Paths that `[fixed]` may name.
    pub fn parameter_paths(&self) -> Vec<String> {
        let bodies = self.bodies.iter().map(|body| format!("body.{}.mass", body.name));
        let springs = self.springs.iter().map(|spring| format!("spring.{}.stiffness", pair(spring)));
        let dampers = self.dampers.iter().map(damping_path);
        let mut paths: Vec<String> = bodies.chain(springs).chain(dampers).collect();
        if self.input.as_ref().is_some_and(|input| !input.moves_body) {
            paths.push("input.gain".to_owned());
        }
        paths
    }

    /// Unit of the bodies' displacements, from the first position output's column; `m` if there is none.
    pub fn displacement_unit(&self) -> String {
        let position = self.outputs.iter().find(|output| output.quantity == Quantity::Position);
        let unit = position.map(|output| unit_of(&output.column)).filter(|unit| !unit.is_empty());
        unit.unwrap_or_else(|| "m".to_owned())
    }

    /// Unit of forces that goes with [`LumpedModel::displacement_unit`].
    pub fn force_unit(&self) -> String {
        match self.displacement_unit().as_str() {
            "m" => "N".to_owned(),
            "rad" => "N·m".to_owned(),
            // Charge moves a circuit: the force on it is a voltage.
            "C" => "V".to_owned(),
            other => format!("mass·{other}/s²"),
        }
    }

    /// Stiffness of the spring between two bodies, or a body and [`GROUND`]; 0 if there is none.
    pub fn stiffness_between(&self, first: &str, second: &str) -> f64 {
        self.springs.iter().filter(|spring| spring.joins(first, second)).map(|spring| spring.constant).sum()
    }

    /// Path of the damping of the damper between two bodies, or a body and [`GROUND`], if there is one.
    pub fn damper_between(&self, first: &str, second: &str) -> Option<String> {
        let damper = self.dampers.iter().find(|damper| damper.joins(first, second))?;
        Some(damping_path(damper))
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first [`InvalidParameter`] found.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        self.check_bodies()?;
        check_connections("spring", &self.springs, &self.bodies, finite)?;
        check_connections("damper", &self.dampers, &self.bodies, |key, value| {
            super::invalid::not_negative(key, value)
        })?;
        if self.outputs.is_empty() {
            return Err(InvalidParameter::new("output", Problem::Missing));
        }
        if let Some(input) = &self.input {
            check_input(&input.signal, &[])?;
            self.known("input.body", &input.body)?;
            if input.moves_body && input.signal.gain != 1.0 {
                let gain = input.signal.gain;
                return Err(InvalidParameter::new("input.gain", Problem::GainOnMotion { gain }));
            }
            if input.moves_body && self.bodies.len() < 2 {
                return Err(InvalidParameter::new("input.quantity", Problem::NothingFree));
            }
        }
        for (number, output) in (1..).zip(&self.outputs) {
            self.known(&format!("output.{number}.body"), &output.body)?;
            if let Some(other) = &output.relative_to {
                self.known(&format!("output.{number}.relative_to"), other)?;
            }
            let moved = |body: &String| self.moved_body() == Some(body.as_str());
            let looks_at_moved = moved(&output.body) || output.relative_to.as_ref().is_some_and(moved);
            if output.quantity == Quantity::Acceleration && self.moved_body().is_some() && looks_at_moved {
                let key = format!("output.{number}.quantity");
                return Err(InvalidParameter::new(key, Problem::AccelerationFromMotion));
            }
        }
        let input = self.input.iter().map(|input| ("input.column".to_owned(), input.signal.column.as_str()));
        let outputs = (1..).zip(&self.outputs);
        let outputs =
            outputs.map(|(number, output)| (format!("output.{number}.column"), output.column.as_str()));
        distinct_columns(input.chain(outputs))?;
        let columns: Vec<String> = self.outputs.iter().map(|output| output.column.clone()).collect();
        self.setup.check(self.input.as_ref().map(|input| &input.signal), &columns)?;
        Ok(())
    }

    /// The body that the input moves.
    pub(crate) fn moved_body(&self) -> Option<&str> {
        self.input.as_ref().filter(|input| input.moves_body).map(|input| input.body.as_str())
    }

    fn check_bodies(&self) -> Result<(), InvalidParameter> {
        if self.bodies.is_empty() {
            return Err(InvalidParameter::new("body", Problem::Missing));
        }
        if self.bodies.len() > MAX_BODIES {
            let (found, most) = (self.bodies.len(), MAX_BODIES);
            return Err(InvalidParameter::new("body", Problem::BodyCount { found, most }));
        }
        let mut seen = HashSet::from([GROUND]);
        for (number, body) in (1..).zip(&self.bodies) {
            let key = |parameter: &str| format!("body.{number}.{parameter}");
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
            if body.name.is_empty() || !body.name.chars().all(plain) || !seen.insert(&body.name) {
                let found = body.name.clone();
                return Err(InvalidParameter::new(key("name"), Problem::BodyName { found }));
            }
            positive(key("mass"), body.mass)?;
        }
        Ok(())
    }

    fn known(&self, key: &str, name: &str) -> Result<(), InvalidParameter> {
        if self.bodies.iter().any(|body| body.name == name) {
            return Ok(());
        }
        Err(unknown_body(key, name, &self.bodies, false))
    }
}

fn unknown_body(key: &str, found: &str, bodies: &[Body], ground: bool) -> InvalidParameter {
    let ground = ground.then(|| GROUND.to_owned());
    let allowed = bodies.iter().map(|body| body.name.clone()).chain(ground).collect();
    InvalidParameter::new(key, Problem::UnknownBody { found: found.to_owned(), allowed })
}

/// Path of a damper's damping.
fn damping_path(damper: &Connection) -> String {
    format!("damper.{}.damping", pair(damper))
}

/// `slider-ground`: how a path names a connection.
pub(crate) fn pair(connection: &Connection) -> String {
    connection.between.join("-")
}

fn check_connections(
    table: &str,
    connections: &[Connection],
    bodies: &[Body],
    check: impl Fn(String, f64) -> Result<(), InvalidParameter>,
) -> Result<(), InvalidParameter> {
    let mut seen = HashSet::new();
    for (number, connection) in (1..).zip(connections) {
        let key = |name: &str| format!("{table}.{number}.{name}");
        let [a, b] = &connection.between;
        for name in [a, b] {
            if name != GROUND && !bodies.iter().any(|body| body.name == *name) {
                return Err(unknown_body(&key("between"), name, bodies, true));
            }
        }
        let sorted = if a < b { (a, b) } else { (b, a) };
        if a == b || !seen.insert(sorted) {
            return Err(InvalidParameter::new(key("between"), Problem::BadPair { found: pair(connection) }));
        }
        check(key(if table == "spring" { "stiffness" } else { "damping" }), connection.constant)?;
    }
    Ok(())
}
