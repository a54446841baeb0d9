//! One linear state space for every kind of model, with the places at which left-out physics can act.
//!
//! ```text
//! x' = A x + b u + c u' + Σ_j E_j f_j        u: input, u': its slope, f_j: force at injection point j
//! output = row · x + value u + slope u' + Σ_j feedthrough_j f_j
//! ```
//!
//! # Both cases that a beam on a moving base has
//! * **Base free under force** (`force_N`): base and beam are one structure. Its modes are *coupled*, a force
//!   on the base shakes the beam and the beam's reaction shakes the base. [`InjectionPoint`] `base` is the
//!   base against the ground.
//! * **Base prescribed** (`base_position_m`, or `setpoint_m` through an ideal or stiff servo): the beam
//!   vibrates in its *clamped* modes and cannot push the base. There is a point `base` only behind a servo,
//!   where a force `f` disturbs the servo by `f` over the mass of base and beam; an ideally driven base feels
//!   no force.
//!
//! | point | displacement | force acts |
//! |---|---|---|
//! | `base` | base against ground, m | on the base, N (modal model: N per kilogram moved, m/s²) |
//! | `beam` | tip relative to base `w(l, t)`, m | on the tip, its reaction on the base, N |
//! | `tip` | tip against ground, m | on the tip alone, N |
//! | `driving_point` | output of a modal model that reads the point where the input's force acts | as the input times its gain, in its unit |
//! | `rigid` | free motion of a modal model | `r'' = ... + f` |
//! | `mode r` | modal coordinate `q_r` | `q_r'' + ... = ... + f`, in the unit of `q_r` per s² |
//! | `slider` (a body) | body against ground | on the body |
//! | `slider-load` (two bodies) | first minus second | on the first, its reaction on the second |

mod base_motion;
mod beam;
mod discrete;
mod driving_point;
mod forced;
mod guided;
mod in_loop;
mod lumped;
mod modes;
mod recent;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Schur};

pub(crate) use base_motion::{BaseMotion, drive_for};
pub use discrete::Discrete;
pub use forced::{ForceSeries, Trace};

use crate::catalogue;
use crate::error::PlantError;
use crate::linear::{LinearSystem, dot};
use crate::model::Model;

/// A linear function of state and input: `state · x + value u + slope u'`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Coefficients of the state.
    pub state: Vec<f64>,
    /// Coefficient of the input.
    pub value: f64,
    /// Coefficient of the input's slope.
    pub slope: f64,
}

impl Row {
    pub(crate) fn zero(order: usize) -> Self {
        Self { state: vec![0.0; order], value: 0.0, slope: 0.0 }
    }

    /// Its value at a state, an input `u` and the input's slope.
    pub fn read(&self, state: &[f64], u: f64, slope: f64) -> f64 {
        dot(&self.state, state) + self.value * u + self.slope * slope
    }

    /// Adds `factor` times another row.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        for (entry, added) in self.state.iter_mut().zip(&other.state) {
            *entry += factor * added;
        }
        self.value += factor * other.value;
        self.slope += factor * other.slope;
    }
}

/// One output of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Its column.
    pub column: String,
    /// How it reads state and input.
    pub row: Row,
    /// What a unit force at each injection point adds at once: zero but for accelerations.
    pub feedthrough: Vec<f64>,
}

impl Output {
    pub(crate) fn new(column: &str, row: Row) -> Self {
        Self { column: column.to_owned(), row, feedthrough: Vec::new() }
    }

    /// The time derivative of a velocity: `velocity · x'`, which feels the forces at once.
    pub(crate) fn acceleration(
        column: &str,
        velocity: &[f64],
        system: &LinearSystem,
        points: &[InjectionPoint],
    ) -> Self {
        let state = system.a.column_iter().map(|rates| dot(velocity, rates.as_slice())).collect();
        let row = Row { state, value: dot(velocity, &system.value), slope: dot(velocity, &system.slope) };
        let feedthrough = points.iter().map(|point| dot(velocity, &point.force)).collect();
        Self { column: column.to_owned(), row, feedthrough }
    }
}

/// A place at which a force can act: see the table in the module's head.
#[derive(Debug, Clone, PartialEq)]
pub struct InjectionPoint {
    /// `base`, `beam`, `tip`, `mode 1`, `rigid`, `driving_point`, a body's name, or two bodies' names joined
    /// by a hyphen.
    pub name: String,
    /// Displacement that a law at this place sees.
    pub displacement: Row,
    /// Its time derivative.
    pub velocity: Row,
    /// `E_j`: what a unit force adds to `x'`.
    pub force: Vec<f64>,
    /// Unit of the displacement: `m`, `rad`, ...
    pub displacement_unit: String,
    /// Unit of the force: `N`, `N·m`, `m/s²`, ...
    pub force_unit: String,
    /// Stiffness that the linear model itself has between the two sides, force per displacement: a spring of
    /// a lumped model, `omega²` of a mode; 0 where there is none.
    pub stiffness: f64,
    /// Whether displacement and velocity here, together with those of the other such points, are the whole
    /// state.
    pub is_coordinate: bool,
}

/// A model as one linear system with outputs and injection points.
#[derive(Debug, Clone)]
pub struct StateSpace {
    pub(crate) system: LinearSystem,
    /// State per unit of input for a plant that rests where its input starts; zero for forces.
    rest: Vec<f64>,
    outputs: Vec<Output>,
    points: Vec<InjectionPoint>,
    fastest_rad_s: f64,
}

impl StateSpace {
    /// The linear part of a model, its linear left-out physics (a tip mass, a further mode) included.
    ///
    /// A model without input gets the state space of a force that stays zero.
    ///
    /// # Errors
    /// [`PlantError::Invalid`] or [`PlantError::Degenerate`].
    pub fn new(model: &Model) -> Result<Self, PlantError> {
        model.check()?;
        let (model, extra_modes) = catalogue::structure(model)?;
        let build = |model: &Model| match model {
            Model::BeamOnBase(model) => beam::of_beam(model, &extra_modes),
            Model::Modal(model) => Ok(modes::of_modes(model, &extra_modes)),
            Model::Lumped(model) => Ok(lumped::of_lumped(model)),
        };
        // Further modes are no part of the model that would be looked up.
        if extra_modes.is_empty() { recent::of(model, build) } else { build(&model) }
    }

    /// The state space whose input is zero whatever the model's is: base held, no force. For a beam and for
    /// modes its state is `q_1, q_1', q_2, q_2', ...`.
    ///
    /// # Errors
    /// As [`StateSpace::new`].
    pub fn held(model: &Model) -> Result<Self, PlantError> {
        model.check()?;
        match model {
            Model::BeamOnBase(model) => beam::of_held_beam(model, &[]),
            Model::Modal(model) => Ok(modes::of_forced_modes(model, &[], 0.0)),
            Model::Lumped(model) => Ok(lumped::of_lumped(model)),
        }
    }

    fn assemble(
        system: LinearSystem,
        rest: Vec<f64>,
        outputs: Vec<Output>,
        points: Vec<InjectionPoint>,
    ) -> Self {
        let fastest_rad_s = fastest(&system.a);
        let mut space = Self { system, rest, outputs, points, fastest_rad_s };
        let count = space.points.len();
        for output in &mut space.outputs {
            output.feedthrough.resize(count, 0.0);
        }
        space
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.system.value.len()
    }

    /// `A`, order by order.
    pub fn a(&self) -> &DMatrix<f64> {
        &self.system.a
    }

    /// `b`: effect of the input's value on `x'`.
    pub fn input_value(&self) -> &[f64] {
        &self.system.value
    }

    /// `c`: effect of the input's slope on `x'`.
    pub fn input_slope(&self) -> &[f64] {
        &self.system.slope
    }

    /// The model's outputs, in file order.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// How much of the input every output shows at once.
    pub(crate) fn shares_of_input(&self) -> Vec<f64> {
        self.outputs.iter().map(|output| output.row.value).collect()
    }

    /// Replaces the outputs by displacement and velocity of every injection point in turn.
    pub(crate) fn watch_points(&mut self) {
        let count = self.points.len();
        let rows = self.points.iter().flat_map(|point| [&point.displacement, &point.velocity]);
        self.outputs = rows
            .map(|row| Output { column: String::new(), row: row.clone(), feedthrough: vec![0.0; count] })
            .collect();
    }

    /// The places at which forces can act.
    pub fn points(&self) -> &[InjectionPoint] {
        &self.points
    }

    /// Index of the point of that name, and `-1` where the name has the two bodies the other way round
    /// (displacement, velocity and force of the point then change sign), `1` otherwise.
    pub fn find_point(&self, name: &str) -> Option<(usize, f64)> {
        let find = |name: &str| self.points.iter().position(|point| point.name == name);
        if let Some(index) = find(name) {
            return Some((index, 1.0));
        }
        let (first, second) = name.split_once('-')?;
        find(&format!("{second}-{first}")).map(|index| (index, -1.0))
    }

    /// Names of the points, as an error lists them.
    pub fn point_names(&self) -> Vec<String> {
        self.points.iter().map(|point| point.name.clone()).collect()
    }

    /// Largest absolute value of an eigenvalue of `A`, rad/s: how fast the fastest motion is.
    pub fn fastest_rad_s(&self) -> f64 {
        self.fastest_rad_s
    }

    /// Natural frequencies in hertz and damping ratios of all motions that vibrate or drift, lowest first:
    /// from the eigenvalues of `A`, one of each conjugate pair. A rigid motion has 0 Hz.
    ///
    /// # Errors
    /// [`PlantError::Degenerate`] when the eigenvalues are not found.
    pub fn natural_modes(&self) -> Result<Vec<(f64, f64)>, PlantError> {
        let schur =
            Schur::try_new(self.system.a.clone(), f64::EPSILON, 10_000).ok_or(PlantError::Degenerate)?;
        let eigenvalues = schur.complex_eigenvalues();
        // Rounding parts a double root at zero into two small ones.
        let rigid_rad_s = 1e-6 * self.fastest_rad_s;
        let mut found: Vec<(f64, f64)> = Vec::new();
        let mut rigid = 0;
        for value in eigenvalues.iter() {
            let omega_rad_s = value.norm();
            if omega_rad_s <= rigid_rad_s {
                rigid += 1;
            } else if value.im >= 0.0 {
                found.push((omega_rad_s / TAU, -value.re / omega_rad_s));
            }
        }
        found.extend(std::iter::repeat_n((0.0, 0.0), usize::div_ceil(rigid, 2)));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(found)
    }

    /// State of a plant at rest whose input starts at `u`.
    pub fn rest_at(&self, u: f64) -> Vec<f64> {
        self.rest.iter().map(|entry| entry * u).collect()
    }

    /// The state that the model starts from: at rest where the input starts at `u`, or as its `[initial]`
    /// says.
    ///
    /// # Errors
    /// As [`StateSpace::state_from`].
    pub fn initial(&self, model: &Model, u: f64) -> Result<Vec<f64>, PlantError> {
        let given = model.setup().initial.iter();
        let given = given.map(|(name, state)| (name.clone(), (state.displacement, state.velocity)));
        self.state_from(&given.collect(), u)
    }

    /// The state with given displacements and velocities `(displacement, velocity)` of coordinate points, by
    /// name; the others are as at rest where the input starts at `u`.
    ///
    /// # Errors
    /// [`PlantError::Place`] when a name is no coordinate point.
    pub fn state_from(&self, given: &BTreeMap<String, (f64, f64)>, u: f64) -> Result<Vec<f64>, PlantError> {
        let rest = self.rest_at(u);
        if given.is_empty() {
            return Ok(rest);
        }
        let coordinates: Vec<&InjectionPoint> =
            self.points.iter().filter(|point| point.is_coordinate).collect();
        if let Some(name) = given.keys().find(|name| !coordinates.iter().any(|point| point.name == **name)) {
            return Err(PlantError::Place {
                what: "[initial]".to_owned(),
                found: name.clone(),
                allowed: coordinates.iter().map(|point| point.name.clone()).collect(),
            });
        }
        let order = self.order();
        let mut rows = DMatrix::zeros(order, order);
        let mut values = DVector::zeros(order);
        let pairs = coordinates.iter().flat_map(|point| {
            let at_rest = (point.displacement.read(&rest, u, 0.0), point.velocity.read(&rest, u, 0.0));
            let (displacement, velocity) = given.get(&point.name).copied().unwrap_or(at_rest);
            [(&point.displacement, displacement), (&point.velocity, velocity)]
        });
        for (index, (row, value)) in pairs.enumerate().take(order) {
            rows.row_mut(index).copy_from_slice(&row.state);
            values[index] = value - row.value * u;
        }
        // A state behind those of the coordinates, a real pole's or a lag's, stays at rest.
        for index in (2 * coordinates.len()).min(order)..order {
            rows[(index, index)] = 1.0;
            values[index] = rest[index];
        }
        let solved = rows.lu().solve(&values).ok_or(PlantError::Degenerate)?;
        Ok(solved.iter().copied().collect())
    }
}

/// Largest absolute value of an eigenvalue.
fn fastest(a: &DMatrix<f64>) -> f64 {
    if a.is_empty() || !a.iter().all(|entry| entry.is_finite()) {
        return 0.0;
    }
    // The Frobenius norm of a high power, its root taken: no iteration that could fail to end.
    let mut power = a.clone();
    let mut logarithm = 0.0;
    let mut exponent = 1.0;
    for _ in 0..12 {
        let norm = power.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            break;
        }
        power /= norm;
        logarithm += norm.ln() / exponent;
        power = &power * &power;
        exponent *= 2.0;
    }
    logarithm.exp()
}
