//! Linear machines, true and as their models have them.

use std::f64::consts::TAU;
use std::fmt::Write;

use crate::case::model_text::model_text;
use crate::truth::plant::{BeamMachine, LinearPlant, MOST, Matrix, Vector};
use crate::truth::run::Kind;

/// What drives a machine, and whether it was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Drive {
    /// A force on the base or the first body.
    Force,
    /// The measured position of a base.
    BasePosition,
    /// The measured acceleration of a base.
    BaseAcceleration,
    /// A setpoint, through the servo that the model describes.
    ServoSetpoint,
    /// A setpoint that the base follows.
    Setpoint,
    /// The measured position of a body that is moved.
    BodyPosition,
}

impl Drive {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Force,
        Self::BasePosition,
        Self::BaseAcceleration,
        Self::ServoSetpoint,
        Self::Setpoint,
        Self::BodyPosition,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::BasePosition => "base position",
            Self::BaseAcceleration => "base acceleration",
            Self::ServoSetpoint => "setpoint through a servo",
            Self::Setpoint => "setpoint of the base",
            Self::BodyPosition => "position of a body",
        }
    }

    /// Column of a recording.
    pub fn column(self) -> &'static str {
        match self {
            Self::Force => "force_N",
            Self::BasePosition => "base_position_m",
            Self::BaseAcceleration => "base_acceleration_m_s2",
            Self::ServoSetpoint | Self::Setpoint => "setpoint_m",
            Self::BodyPosition => "carriage_position_m",
        }
    }

    /// Whether steps of the input would be steps of a base, which no machine makes.
    pub fn is_motion(self) -> bool {
        matches!(self, Self::BasePosition | Self::Setpoint | Self::BodyPosition)
    }
}

/// Bodies in a row on springs, the first tied to the ground or to a carriage that is moved.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Masses, kg.
    pub mass_kg: Vec<f64>,
    /// Stiffness to what is before every body, N/m.
    pub stiffness: Vec<f64>,
    /// Damping to what is before every body, N·s/m.
    pub damping: Vec<f64>,
    /// Whether the carriage is moved, rather than the first body pushed.
    pub moved: bool,
}

/// Modes of a beam on a base whose acceleration is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Frequency in hertz, damping ratio, share of the tip's deflection, per mode.
    pub modes: Vec<[f64; 3]>,
}

/// A linear machine.
#[derive(Debug, Clone, PartialEq)]
pub enum Machine {
    /// A strip on a base.
    Beam(BeamMachine),
    /// Bodies in a row.
    Chain(Chain),
    /// A beam's modes over its base's acceleration.
    Modes(Modes),
}

const BODIES: [&str; 4] = ["slider", "load", "third", "fourth"];

impl Machine {
    /// Equations of motion and sensors; `None` for sizes that no machine has.
    pub fn plant(&self) -> Option<LinearPlant> {
        match self {
            Self::Beam(beam) => beam.plant(),
            Self::Chain(chain) => Some(chain.plant()),
            Self::Modes(modes) => Some(modes.plant()),
        }
    }

    /// The model file of this machine as it is, with these outputs, by their columns.
    pub fn text(&self, drive: Drive, columns: &[String]) -> String {
        match self {
            Self::Beam(beam) => beam_text(beam, columns),
            Self::Chain(chain) => chain.text(drive, columns),
            Self::Modes(modes) => modes.text(drive, columns),
        }
    }
}

fn beam_text(beam: &BeamMachine, columns: &[String]) -> String {
    let mut text = model_text(&Kind::Beam(beam.clone()), &[]);
    if beam.strip.tip_mass_kg > 0.0 {
        let line = format!("[beam]\ntip_mass_kg = {:?}\n", beam.strip.tip_mass_kg);
        text = text.replacen("[beam]\n", &line, 1);
    }
    for column in columns {
        let _ = write!(text, "\n[[output]]\ncolumn = \"{column}\"\n");
    }
    text
}

fn empty(size: usize) -> LinearPlant {
    LinearPlant {
        size,
        damper: Matrix::zeros(),
        spring: Matrix::zeros(),
        input: Vector::zeros(),
        input_rate: Vector::zeros(),
        drifts: [true; MOST],
        prescribed: false,
        points: Vec::new(),
        outputs: Vec::new(),
        fastest_rad_s: 0.0,
    }
}

impl Chain {
    fn plant(&self) -> LinearPlant {
        let mut plant = empty(self.mass_kg.len());
        for (k, mass) in self.mass_kg.iter().enumerate() {
            let (stiffness, damping) = (self.stiffness[k], self.damping[k]);
            plant.spring[(k, k)] += stiffness / mass;
            plant.damper[(k, k)] += damping / mass;
            if k > 0 {
                let before = self.mass_kg[k - 1];
                plant.spring[(k, k - 1)] -= stiffness / mass;
                plant.damper[(k, k - 1)] -= damping / mass;
                plant.spring[(k - 1, k)] -= stiffness / before;
                plant.damper[(k - 1, k)] -= damping / before;
                plant.spring[(k - 1, k - 1)] += stiffness / before;
                plant.damper[(k - 1, k - 1)] += damping / before;
            } else if self.moved {
                plant.input[0] = stiffness / mass;
                plant.input_rate[0] = damping / mass;
            } else {
                plant.input[0] = 1.0 / mass;
            }
            let row = Vector::from_fn(|row, _| f64::from(row == k));
            plant.outputs.push((format!("{}_position_m", BODIES[k]), row, 0.0));
        }
        // No eigenvalue is beyond the largest sum of a row.
        let row = |row: usize| (0..MOST).map(|column| plant.spring[(row, column)].abs()).sum::<f64>();
        plant.fastest_rad_s = (0..MOST).map(row).fold(0.0, f64::max).sqrt();
        plant
    }

    fn text(&self, drive: Drive, columns: &[String]) -> String {
        let mut text = String::from("schema = 1\nkind = \"lumped\"\n");
        // Writing into a string cannot fail.
        if self.moved {
            let _ = write!(text, "\n[[body]]\nname = \"carriage\"\nmass = 1.0\n");
        }
        for (name, mass) in BODIES.iter().zip(&self.mass_kg) {
            let _ = write!(text, "\n[[body]]\nname = \"{name}\"\nmass = {mass:?}\n");
        }
        let mut before = if self.moved { "carriage" } else { "ground" };
        for (k, name) in BODIES.iter().enumerate().take(self.mass_kg.len()) {
            let between = format!("between = [\"{name}\", \"{before}\"]");
            let _ = write!(text, "\n[[spring]]\n{between}\nstiffness = {:?}\n", self.stiffness[k]);
            let _ = write!(text, "\n[[damper]]\n{between}\ndamping = {:?}\n", self.damping[k]);
            before = name;
        }
        let column = drive.column();
        let how = if self.moved {
            "body = \"carriage\"\nquantity = \"position\"\n"
        } else {
            "body = \"slider\"\ngain = 1.0\n"
        };
        let _ = write!(text, "\n[input]\ncolumn = \"{column}\"\n{how}");
        for column in columns {
            let body = column.trim_end_matches("_position_m");
            let _ = write!(
                text,
                "\n[[output]]\ncolumn = \"{column}\"\nbody = \"{body}\"\nquantity = \"position\"\n"
            );
        }
        text
    }
}

impl Modes {
    fn plant(&self) -> LinearPlant {
        let mut plant = empty(self.modes.len());
        let mut row = Vector::zeros();
        for (k, [frequency_hz, damping_ratio, share]) in self.modes.iter().enumerate() {
            let omega = TAU * frequency_hz;
            plant.spring[(k, k)] = omega * omega;
            plant.damper[(k, k)] = 2.0 * damping_ratio * omega;
            plant.input[k] = 1.0;
            plant.fastest_rad_s = plant.fastest_rad_s.max(omega);
            row[k] = *share;
        }
        plant.outputs.push(("tip_deflection_m".to_owned(), row, 0.0));
        plant
    }

    fn text(&self, drive: Drive, columns: &[String]) -> String {
        let mut text = String::from("schema = 1\nkind = \"modal\"\n");
        for [frequency_hz, damping_ratio, share] in &self.modes {
            let _ = write!(
                text,
                "\n[[mode]]\nfrequency_hz = {frequency_hz:?}\ndamping_ratio = {damping_ratio:?}\nparticipation = [{share:?}]\n"
            );
        }
        let _ = write!(text, "\n[input]\ncolumn = \"{}\"\n", drive.column());
        for column in columns {
            let _ = write!(text, "\n[[output]]\ncolumn = \"{column}\"\nquantity = \"position\"\n");
        }
        text
    }
}
