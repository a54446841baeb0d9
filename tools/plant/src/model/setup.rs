//! What stands around the linear plant: a known controller, an initial state, sensors, physics that was left
//! out.

use std::collections::BTreeMap;
use std::num::NonZeroU8;

use super::Input;
use super::invalid::{InvalidParameter, Problem, finite, not_negative, positive};

/// Everything of a model file beyond the linear plant and its drive; empty by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// `[controller]`: a known feedback law; `None` is open loop.
    pub controller: Option<Controller>,
    /// `[drive]` keys that make the drive more than a linear servo.
    pub drive_limits: DriveLimits,
    /// `[initial]`: displacement and velocity at the first sample, by coordinate (`base`, `mode 1`, a body).
    /// What is not named starts at rest.
    pub initial: BTreeMap<String, InitialState>,
    /// `[[sensor]]`: what lies between the plant and a recorded column.
    pub sensors: Vec<Sensor>,
    /// `[[physics]]`: laws of the catalogue that act on the plant.
    pub physics: Vec<Physics>,
}

/// Where a coordinate starts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InitialState {
    /// Displacement in the coordinate's unit.
    pub displacement: f64,
    /// Velocity, per second.
    pub velocity: f64,
}

/// What a drive has besides its bandwidth; all absent by default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveLimits {
    /// `dead_time_s`: the drive sees its input this much late; at least 0.
    pub dead_time_s: f64,
    /// `limit`: the drive's input is clipped to `±limit`, in the input's unit; above 0.
    pub limit: Option<f64>,
    /// `acceleration_limit_m_s2`: the most that the servo's motor accelerates the base; above 0. Needs a
    /// servo.
    pub acceleration_limit_m_s2: Option<f64>,
}

/// A cascade of proportional position and velocity control, `[controller]` with `kind = "cascade_pd"`:
/// `u = kv (kp (reference − y) − dy/dt)`, renewed every `sample_s` and held in between, clipped to `±limit`;
/// `y` is the model's first output, which must be a position, and `u` is in the input column's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// Position gain, 1/s.
    pub kp: f64,
    /// Velocity gain, input unit per (output unit per second).
    pub kv: f64,
    /// Period of renewal in seconds, above 0.
    pub sample_s: f64,
    /// Column of the reference, in the unit of the first output.
    pub reference_column: String,
    /// Clip in the input's unit, above 0; `None` does not clip.
    pub limit: Option<f64>,
    /// Renewals over which dy/dt is a difference of positions, as a controller with an encoder has it: late
    /// by half of them. `None`: the derivative itself.
    pub velocity_samples: Option<NonZeroU8>,
}

/// What kind of sensor a column comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorKind {
    /// Sees an average over its exposure, late, at its own rate.
    #[default]
    Camera,
    /// Sees the position now, in counts.
    Encoder,
}

/// Between the plant and a recorded column, in the order in which it acts: exposure, delay, noise, rounding,
/// rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// The output it measures.
    pub column: String,
    /// Camera or encoder; an encoder has neither delay nor exposure nor rate.
    pub kind: SensorKind,
    /// Samples per second; between them the recorded cell is empty. `None`: a sample at every time stamp.
    pub rate_hz: Option<f64>,
    /// A sample stamped `t` ends its exposure at `t − delay_s`; at least 0.
    pub delay_s: f64,
    /// Length of the average that a sample is, ending at read-out; seconds, at least 0.
    pub exposure_s: f64,
    /// Root mean square of white Gaussian noise, output unit, at least 0.
    pub noise_rms: f64,
    /// Samples are rounded to multiples of this, output unit; 0 is no rounding.
    pub quantum: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Whether its readings are known to have no offset. That of others is what a recording makes of it, and
    /// says nothing of forces that are always there.
    pub zero_known: bool,
}

impl Sensor {
    /// Whether what it says is what there is.
    pub(crate) fn is_ideal(&self) -> bool {
        let ideal = Self::ideal(self.column.as_str());
        *self == Self { kind: self.kind, seed: self.seed, zero_known: self.zero_known, ..ideal }
    }

    /// A perfect sensor of a column.
    pub fn ideal(column: impl Into<String>) -> Self {
        Self {
            column: column.into(),
            kind: SensorKind::Camera,
            rate_hz: None,
            delay_s: 0.0,
            exposure_s: 0.0,
            noise_rms: 0.0,
            quantum: 0.0,
            seed: 0,
            zero_known: false,
        }
    }
}

/// A law of the catalogue at a place: one `[[physics]]` table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Physics {
    /// Id of the law, such as `coulomb_friction`.
    pub id: String,
    /// Where it sits: `base`, `beam`, `mode 1`, a body, two bodies, `drive`, `sensor`, `environment`.
    pub location: String,
    /// For laws of the `environment`: the place at which they act; by default the first that can feel them.
    pub on: Option<String>,
    /// For laws of the `sensor`: the output column; by default the first.
    pub column: Option<String>,
    /// Parameters by name; what is not given has the law's default.
    pub parameters: BTreeMap<String, f64>,
}

impl Physics {
    /// The law `id` at `location`, all parameters at their defaults.
    pub fn new(id: impl Into<String>, location: impl Into<String>) -> Self {
        Self { id: id.into(), location: location.into(), ..Self::default() }
    }

    /// The same with a parameter set.
    #[must_use]
    pub fn with(mut self, parameter: impl Into<String>, value: f64) -> Self {
        self.parameters.insert(parameter.into(), value);
        self
    }
}

impl Setup {
    /// Checks what can be checked without the plant.
    pub(super) fn check(&self, input: Option<&Input>, outputs: &[String]) -> Result<(), InvalidParameter> {
        let DriveLimits { dead_time_s, limit, acceleration_limit_m_s2 } = self.drive_limits;
        not_negative("drive.dead_time_s", dead_time_s)?;
        limit.map_or(Ok(()), |limit| positive("drive.limit", limit))?;
        acceleration_limit_m_s2.map_or(Ok(()), |limit| positive("drive.acceleration_limit_m_s2", limit))?;
        for (name, state) in &self.initial {
            finite(format!("initial.{name}.displacement"), state.displacement)?;
            finite(format!("initial.{name}.velocity"), state.velocity)?;
        }
        if let Some(controller) = &self.controller {
            controller.check(input, outputs)?;
        }
        for (number, sensor) in (1..).zip(&self.sensors) {
            sensor.check(number, outputs)?;
        }
        for (number, physics) in (1..).zip(&self.physics) {
            for (name, value) in &physics.parameters {
                finite(format!("physics.{number}.parameters.{name}"), *value)?;
            }
            if let Some(column) = physics.column.as_ref().filter(|column| !outputs.contains(column)) {
                let (found, allowed) = (column.clone(), outputs.to_vec());
                let key = format!("physics.{number}.column");
                return Err(InvalidParameter::new(key, Problem::OutputColumn { found, allowed }));
            }
        }
        Ok(())
    }
}

impl Controller {
    fn check(&self, input: Option<&Input>, outputs: &[String]) -> Result<(), InvalidParameter> {
        finite("controller.kp", self.kp)?;
        finite("controller.kv", self.kv)?;
        positive("controller.sample_s", self.sample_s)?;
        self.limit.map_or(Ok(()), |limit| positive("controller.limit", limit))?;
        if self.reference_column.is_empty() {
            return Err(InvalidParameter::new("controller.reference_column", Problem::EmptyColumn));
        }
        if input.is_none() {
            return Err(InvalidParameter::new("controller", Problem::ControllerWithoutInput));
        }
        let taken = input.map(|input| &input.column).into_iter().chain(outputs);
        if taken.into_iter().any(|column| *column == self.reference_column) {
            let column = self.reference_column.clone();
            return Err(InvalidParameter::new(
                "controller.reference_column",
                Problem::RepeatedColumn { column },
            ));
        }
        Ok(())
    }
}

impl Sensor {
    fn check(&self, number: usize, outputs: &[String]) -> Result<(), InvalidParameter> {
        let key = |name: &str| format!("sensor.{number}.{name}");
        if !outputs.contains(&self.column) {
            let (found, allowed) = (self.column.clone(), outputs.to_vec());
            return Err(InvalidParameter::new(key("column"), Problem::OutputColumn { found, allowed }));
        }
        self.rate_hz.map_or(Ok(()), |rate_hz| positive(key("rate_hz"), rate_hz))?;
        not_negative(key("delay_s"), self.delay_s)?;
        not_negative(key("exposure_s"), self.exposure_s)?;
        not_negative(key("noise_rms"), self.noise_rms)?;
        not_negative(key("quantum"), self.quantum)?;
        let camera_only = [
            ("rate_hz", self.rate_hz.is_some()),
            ("delay_s", self.delay_s > 0.0),
            ("exposure_s", self.exposure_s > 0.0),
        ];
        match camera_only.into_iter().find(|(_, given)| *given && self.kind == SensorKind::Encoder) {
            None => Ok(()),
            Some((name, _)) => Err(InvalidParameter::new(key(name), Problem::CameraOnly)),
        }
    }
}
