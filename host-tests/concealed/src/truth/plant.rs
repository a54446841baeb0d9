//! The linear part of the truth: coordinates, their accelerations, and the places where forces act.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::beam_elements::{Strip, StripModes};

/// The most coordinates of a plant: five modes, the base, a further mode, and one to spare.
pub const MOST: usize = 8;
/// One number per coordinate; coordinates that a plant does not have stay at zero.
pub type Vector = SVector<f64, MOST>;
/// A square of them.
pub type Matrix = SMatrix<f64, MOST, MOST>;

/// What the first column of a recording drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputKind {
    /// A force on the base or on the first body.
    Force,
    /// The base's position, as measured.
    BasePosition,
    /// The position that the drive was told.
    Setpoint,
}

/// A position servo: `y'' = w² (s − y) − 2 z w y'`, disturbed by forces over the moved mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Undamped angular frequency, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// A strip on a base.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamMachine {
    /// The strip.
    pub strip: Strip,
    /// Damping ratio per mode, base held; as many modes are kept.
    pub damping_ratio: Vec<f64>,
    /// Mass of the base alone, kg.
    pub base_mass_kg: f64,
    /// Viscous friction of the base, N·s/m.
    pub base_viscous: f64,
    /// What drives it.
    pub input: InputKind,
    /// Between setpoint and base; `None` is ideal.
    pub servo: Option<Servo>,
}

/// A position controller: `u = kv (kp (r − y) − y')`, renewed every millisecond and held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionLoop {
    /// 1/s.
    pub kp: f64,
    /// N·s/m.
    pub kv: f64,
}

/// Seconds between two renewals of a [`PositionLoop`].
pub const RENEWAL_S: f64 = 1e-3;

/// One or two bodies in a row; the first is driven and tied to the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct SlideMachine {
    /// Names and masses in kg.
    pub bodies: Vec<(String, f64)>,
    /// Spring of the first body to the ground, N/m.
    pub ground_stiffness: f64,
    /// Damper of the first body to the ground, N·s/m.
    pub ground_damping: f64,
    /// Spring and damper between the two bodies.
    pub coupling: [f64; 2],
    /// Makes the force from a reference; `None`: the force is commanded, or there is none.
    pub position_loop: Option<PositionLoop>,
    /// Nothing drives it: it is pulled aside and let go.
    pub let_go: bool,
}

/// A place where forces act: displacement `row · x + base · u`, and what a force of 1 does to the
/// accelerations.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// As in the catalogue: `base`, `beam`, `tip`, a body, or two bodies with a dash.
    pub name: String,
    /// Displacement per coordinate.
    pub row: Vector,
    /// Displacement per input, where the input prescribes the base.
    pub base: f64,
    /// Acceleration of every coordinate per unit of force.
    pub push: Vector,
}

/// `x'' = −damper x' − spring x + input u + input_rate u' + Σ push f`.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPlant {
    /// Number of coordinates, at most [`MOST`].
    pub size: usize,
    /// Times velocities.
    pub damper: Matrix,
    /// Times positions.
    pub spring: Matrix,
    /// Times the input.
    pub input: Vector,
    /// Times the input's derivative.
    pub input_rate: Vector,
    /// Which coordinates' springs move when stiffness drifts.
    pub drifts: [bool; MOST],
    /// Whether the input is the base's position, so that the springs pull on it.
    pub prescribed: bool,
    /// Places where laws act.
    pub points: Vec<Point>,
    /// What sensors see: column, row, share of the input.
    pub outputs: Vec<(String, Vector, f64)>,
    /// Angular frequencies that an integrator has to follow, rad/s.
    pub fastest_rad_s: f64,
}

impl LinearPlant {
    /// The point of a name.
    pub fn point(&self, name: &str) -> Option<usize> {
        self.points.iter().position(|point| point.name == name)
    }

    /// One more oscillator on the base, seen by the first output with a participation; only where the base is
    /// prescribed. `None` if there is no coordinate left for it.
    pub fn with_extra_mode(
        mut self,
        frequency_hz: f64,
        damping_ratio: f64,
        participation: f64,
    ) -> Option<Self> {
        let new = self.size;
        if new >= MOST || !self.prescribed {
            return None;
        }
        self.size += 1;
        let omega = std::f64::consts::TAU * frequency_hz;
        self.spring[(new, new)] = omega * omega;
        self.damper[(new, new)] = 2.0 * damping_ratio * omega;
        // In absolute coordinates, as the beam's modes: driven by the base's position and velocity.
        self.input[new] = omega * omega;
        self.input_rate[new] = 2.0 * damping_ratio * omega;
        if let Some((_, row, base)) = self.outputs.first_mut() {
            row[new] = participation;
            *base -= participation;
        }
        self.fastest_rad_s = self.fastest_rad_s.max(omega);
        Some(self)
    }
}

/// A unit vector.
fn unit(index: usize) -> Vector {
    Vector::from_fn(|row, _| if row == index { 1.0 } else { 0.0 })
}

/// Numbers from a coordinate on, zeros elsewhere.
fn from_slice(first: usize, numbers: &[f64]) -> Vector {
    Vector::from_fn(|row, _| {
        row.checked_sub(first).and_then(|index| numbers.get(index)).copied().unwrap_or(0.0)
    })
}

impl BeamMachine {
    /// Coordinates and places; `None` if a size is impossible or there are too many modes.
    pub fn plant(&self) -> Option<LinearPlant> {
        let count = self.damping_ratio.len();
        if count + 1 > MOST {
            return None;
        }
        self.plant_of(&self.strip.modes(count)?)
    }

    /// The same for modes that are known already, one per damping ratio.
    pub fn plant_of(&self, modes: &StripModes) -> Option<LinearPlant> {
        match (self.input, self.servo) {
            (InputKind::Force, _) => self.on_a_free_base(modes),
            (InputKind::Setpoint, Some(servo)) => Some(self.behind_a_servo(modes, servo)),
            _ => Some(self.on_a_moved_base(modes)),
        }
    }

    /// Coordinates: the base, then the modes' deflections relative to it.
    fn on_a_free_base(&self, modes: &StripModes) -> Option<LinearPlant> {
        let size = modes.omega_rad_s.len() + 1;
        let mut mass = Matrix::identity();
        mass[(0, 0)] = self.base_mass_kg + modes.mass_kg;
        let (mut spring, mut damper) = (Matrix::zeros(), Matrix::zeros());
        damper[(0, 0)] = self.base_viscous;
        for (k, (omega, gamma)) in modes.omega_rad_s.iter().zip(&modes.base).enumerate() {
            mass[(0, k + 1)] = *gamma;
            mass[(k + 1, 0)] = *gamma;
            spring[(k + 1, k + 1)] = omega * omega;
            damper[(k + 1, k + 1)] = 2.0 * self.damping_ratio[k] * omega;
        }
        let inverse = mass.try_inverse()?;
        let on_base = unit(0);
        let on_beam = from_slice(1, &modes.tip);
        let at =
            |name: &str, row: Vector| Point { name: name.to_owned(), row, base: 0.0, push: inverse * row };
        Some(LinearPlant {
            size,
            spring: inverse * spring,
            damper: inverse * damper,
            input: inverse * on_base,
            input_rate: Vector::zeros(),
            drifts: [true; MOST],
            prescribed: false,
            points: vec![at("base", on_base), at("beam", on_beam), at("tip", on_beam + on_base)],
            outputs: vec![
                ("tip_deflection_m".to_owned(), on_beam, 0.0),
                ("base_position_m".to_owned(), on_base, 0.0),
            ],
            // Coupling to the base raises the clamped frequencies a little.
            fastest_rad_s: 1.5 * modes.omega_rad_s.last().copied().unwrap_or(1.0),
        })
    }

    /// Coordinates: per mode deflection plus participation times the base's position, so that only the base's
    /// position and speed act, however abrupt its acceleration.
    fn on_a_moved_base(&self, modes: &StripModes) -> LinearPlant {
        let omega = from_slice(0, &modes.omega_rad_s);
        let rub = 2.0 * from_slice(0, &self.damping_ratio).component_mul(&omega);
        let square = omega.component_mul(&omega);
        let (tip, base) = (from_slice(0, &modes.tip), from_slice(0, &modes.base));
        let seen = tip.dot(&base);
        let at = |name: &str, base: f64| Point { name: name.to_owned(), row: tip, base, push: tip };
        LinearPlant {
            size: modes.omega_rad_s.len(),
            spring: Matrix::from_diagonal(&square),
            damper: Matrix::from_diagonal(&rub),
            input: square.component_mul(&base),
            input_rate: rub.component_mul(&base),
            drifts: [true; MOST],
            prescribed: true,
            points: vec![at("beam", -seen), at("tip", 1.0 - seen)],
            outputs: vec![
                ("tip_deflection_m".to_owned(), tip, -seen),
                ("base_position_m".to_owned(), Vector::zeros(), 1.0),
            ],
            fastest_rad_s: modes.omega_rad_s.last().copied().unwrap_or(1.0),
        }
    }

    /// As on a moved base, with the base as coordinate 0 behind a servo that the beam does not move.
    fn behind_a_servo(&self, modes: &StripModes, servo: Servo) -> LinearPlant {
        let held = self.on_a_moved_base(modes);
        let size = held.size + 1;
        let (omega, rub) = (servo.omega_rad_s, 2.0 * servo.damping_ratio * servo.omega_rad_s);
        let (mut spring, mut damper) = (Matrix::zeros(), Matrix::zeros());
        spring[(0, 0)] = omega * omega;
        damper[(0, 0)] = rub;
        for k in 1..size {
            spring[(k, k)] = held.spring[(k - 1, k - 1)];
            damper[(k, k)] = held.damper[(k - 1, k - 1)];
            spring[(k, 0)] = -held.input[k - 1];
            damper[(k, 0)] = -held.input_rate[k - 1];
        }
        let with_base = |row: &Vector, base: f64| from_slice(1, row.as_slice()) + base * unit(0);
        let moved_kg = self.base_mass_kg + modes.mass_kg;
        let mut points =
            vec![Point { name: "base".to_owned(), row: unit(0), base: 0.0, push: unit(0) / moved_kg }];
        points.extend(held.points.iter().map(|point| Point {
            name: point.name.clone(),
            row: with_base(&point.row, point.base),
            base: 0.0,
            push: with_base(&point.push, 0.0),
        }));
        let outputs = held.outputs.iter();
        LinearPlant {
            size,
            spring,
            damper,
            input: unit(0) * (omega * omega),
            input_rate: Vector::zeros(),
            drifts: std::array::from_fn(|k| k > 0),
            prescribed: false,
            points,
            outputs: outputs.map(|(name, row, base)| (name.clone(), with_base(row, *base), 0.0)).collect(),
            fastest_rad_s: held.fastest_rad_s.max(omega),
        }
    }
}

impl SlideMachine {
    /// What a reference drives when the controller is fast: its gains as a spring and a damper. Without a
    /// controller the machine itself.
    pub fn with_a_fast_loop(&self) -> Option<LinearPlant> {
        let Some(PositionLoop { kp, kv }) = self.position_loop else { return self.plant() };
        let mut tied = self.clone();
        tied.ground_stiffness += kp * kv;
        tied.ground_damping += kv;
        let mut plant = tied.plant()?;
        plant.input *= kp * kv;
        Some(plant)
    }

    /// Coordinates are the bodies' positions, the input is the force; `None` if there are not one or two
    /// bodies.
    pub fn plant(&self) -> Option<LinearPlant> {
        let size = self.bodies.len();
        if !(1..=2).contains(&size) {
            return None;
        }
        let mass = |k: usize| self.bodies.get(k).map_or(1.0, |(_, mass)| *mass);
        let inverse = Matrix::from_diagonal(&Vector::from_fn(|k, _| 1.0 / mass(k)));
        let ground = unit(0);
        let mut spring = ground * ground.transpose() * self.ground_stiffness;
        let mut damper = ground * ground.transpose() * self.ground_damping;
        let mut rows: Vec<(String, Vector)> =
            self.bodies.iter().enumerate().map(|(k, (name, _))| (name.clone(), unit(k))).collect();
        let outputs = rows.iter().map(|(name, row)| (format!("{name}_position_m"), *row, 0.0)).collect();
        if size == 2 {
            let between = unit(0) - unit(1);
            spring += between * between.transpose() * self.coupling[0];
            damper += between * between.transpose() * self.coupling[1];
            rows.push((format!("{}-{}", self.bodies[0].0, self.bodies[1].0), between));
        }
        let points = rows.into_iter();
        let points = points.map(|(name, row)| Point { name, push: inverse * row, row, base: 0.0 });
        let lightest = self.bodies.iter().map(|(_, mass)| *mass).fold(f64::INFINITY, f64::min);
        Some(LinearPlant {
            size,
            spring: inverse * spring,
            damper: inverse * damper,
            input: inverse * ground,
            input_rate: Vector::zeros(),
            drifts: [true; MOST],
            prescribed: false,
            points: points.collect(),
            outputs,
            fastest_rad_s: (4.0 * (self.ground_stiffness + self.coupling[0]) / lightest).sqrt().max(200.0),
        })
    }
}
