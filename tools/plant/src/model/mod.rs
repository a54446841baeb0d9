//! Models in memory: plain data, and the checks that make it usable.

mod beam_on_base;
mod beside;
mod driving_point;
mod invalid;
mod lumped;
mod modal;
mod setup;

use stillbeam_recording::Column;

pub use crate::matrices::MatricesProblem;
use crate::simulate::Hold;
pub(crate) use beam_on_base::invalid_mode_count;
pub use beam_on_base::{
    BASE_POSITION, BeamDamping, BeamFittings, BeamOnBase, BeamParameters, BeamSignal, FORCE, MAX_MODES,
    SETPOINT, SectionTables, TIP_DEFLECTION, TIP_POSITION,
};
pub use beside::{Beside, Lag, Rigid};
pub(crate) use invalid::positive;
pub use invalid::{InvalidParameter, Problem};
pub(crate) use lumped::pair;
pub use lumped::{Body, Connection, GROUND, LumpedInput, LumpedModel, LumpedOutput, MAX_BODIES};
pub use modal::{ModalModel, ModalOutput, Quantity, RealPole};
pub use setup::{Controller, DriveLimits, InitialState, Physics, Sensor, SensorKind, Setup};

/// The place where the force of the input acts, of a modal model one of whose outputs reads its motion.
pub const DRIVING_POINT: &str = "driving_point";

/// What drives the model: the recording's column of this name.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// `base_position_m` (prescribed base motion), `setpoint_m` (the same, through the drive) or a force:
    /// `force_N` for a beam on a base, any other column for a modal model.
    pub column: String,
    /// Multiplies the column when it is a force; 1 for motion.
    pub gain: f64,
    /// What the column does between its samples, where that is known; a motion always goes in straight lines.
    pub hold: Option<Hold>,
    /// Root mean square of the white noise that its readings are known to have, in the column's unit.
    pub noise_rms: Option<f64>,
}

impl Input {
    /// The named column with gain 1.
    pub fn new(column: impl Into<String>) -> Self {
        Self { column: column.into(), gain: 1.0, hold: None, noise_rms: None }
    }

    /// Whether the column is a motion of the base, in metres, rather than a force.
    pub fn is_motion(&self) -> bool {
        self.column == BASE_POSITION || self.column == SETPOINT
    }
}

/// Units of length, and the factor that makes metres of them.
const LENGTHS: [(&str, &str); 5] =
    [("m", ""), ("cm", "*0.01"), ("mm", "*0.001"), ("um", "*1e-6"), ("nm", "*1e-9")];

/// A model of any kind.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Model {
    /// Geometry and material of a beam clamped to a translating base.
    BeamOnBase(BeamOnBase),
    /// Modes without geometry, as identification finds them.
    Modal(ModalModel),
    /// Bodies, springs and dampers.
    Lumped(LumpedModel),
}

impl Model {
    /// The model's input; `None` is a free decay.
    pub fn input(&self) -> Option<&Input> {
        match self {
            Self::BeamOnBase(model) => model.input.as_ref(),
            Self::Modal(model) => model.input.as_ref(),
            Self::Lumped(model) => model.input.as_ref().map(|input| &input.signal),
        }
    }

    /// Names of the output columns in file order.
    pub fn output_columns(&self) -> Vec<String> {
        match self {
            Self::BeamOnBase(model) => {
                model.outputs.iter().map(|signal| signal.column().to_owned()).collect()
            }
            Self::Modal(model) => model.outputs.iter().map(|output| output.column.clone()).collect(),
            Self::Lumped(model) => model.outputs.iter().map(|output| output.column.clone()).collect(),
        }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first [`InvalidParameter`] found: which key, what is wrong with it and the remedy.
    pub fn check(&self) -> Result<(), InvalidParameter> {
        match self {
            Self::BeamOnBase(model) => model.check(),
            Self::Modal(model) => model.check(),
            Self::Lumped(model) => model.check(),
        }?;
        self.check_fixed()?;
        self.check_input()?;
        crate::catalogue::check(self)
    }

    /// Checks that no motion is taken for a force. What pushes a body of a lumped model may be in any unit:
    /// the model has a gain.
    fn check_input(&self) -> Result<(), InvalidParameter> {
        let Some(input) = self.input().filter(|input| !input.is_motion()) else { return Ok(()) };
        let column = Column { name: input.column.clone(), samples: Vec::new() };
        let length = LENGTHS.iter().find(|(name, _)| *name == column.unit());
        match length {
            Some((_, scale)) if !matches!(self, Self::Lumped(_)) => {
                let problem = Problem::MotionAsForce { column: input.column.clone(), scale };
                Err(InvalidParameter::new("input.column", problem))
            }
            _ => Ok(()),
        }
    }

    /// Checks that `[fixed]` names numbers of the model, or what several of them lie below.
    fn check_fixed(&self) -> Result<(), InvalidParameter> {
        let numbers = self.parameters();
        let is_one = |path: &String| numbers.iter().any(|number| lies_below(&number.path, path));
        match self.fixed().keys().find(|path| !is_one(path)) {
            None => Ok(()),
            Some(path) => {
                let allowed = self.parameter_paths();
                Err(InvalidParameter::new(format!("fixed.{path}"), Problem::FixedPath { allowed }))
            }
        }
    }

    fn parameter_paths(&self) -> Vec<String> {
        match self {
            Self::BeamOnBase(model) => model.parameter_paths(),
            Self::Modal(model) => model.parameter_paths(),
            Self::Lumped(model) => model.parameter_paths(),
        }
    }

    /// The same with an input that does this between its samples.
    #[must_use]
    pub fn with_hold(&self, hold: Hold) -> Self {
        let mut model = self.clone();
        let input = match &mut model {
            Self::BeamOnBase(model) => model.input.as_mut(),
            Self::Modal(model) => model.input.as_mut(),
            Self::Lumped(model) => model.input.as_mut().map(|input| &mut input.signal),
        };
        if let Some(input) = input {
            input.hold = Some(hold);
        }
        model
    }

    /// Whether an output, by its place in [`Model::output_columns`], is a velocity: what stands still reads
    /// nothing.
    pub fn output_is_velocity(&self, output: usize) -> bool {
        let quantity = match self {
            Self::BeamOnBase(_) => None,
            Self::Modal(model) => model.outputs.get(output).map(|output| output.quantity),
            Self::Lumped(model) => model.outputs.get(output).map(|output| output.quantity),
        };
        quantity == Some(Quantity::Velocity)
    }

    /// The injection point whose motion an output reads; `None` where it reads the sum of several.
    pub fn output_point(&self, output: usize) -> Option<String> {
        match self {
            Self::BeamOnBase(model) => model.outputs.get(output).map(|signal| signal.point().to_owned()),
            Self::Modal(_) => None,
            Self::Lumped(model) => model.outputs.get(output).map(|output| match &output.relative_to {
                Some(other) => format!("{}-{other}", output.body),
                None => output.body.clone(),
            }),
        }
    }

    /// Whether what is at a location turns about an axis of its own against the ground: an output reads a
    /// body's angle, angular velocity or angular acceleration in radian.
    pub fn turns(&self, location: &str) -> bool {
        let model = match self {
            Self::Lumped(model) => model,
            Self::Modal(model) if location == DRIVING_POINT => {
                let output = model.driving_output();
                return output.is_some_and(|(_, output)| unit_of(&output.column).starts_with("rad"));
            }
            _ => return false,
        };
        let mut outputs = model.outputs.iter().filter(|output| output.body == location);
        outputs.any(|output| unit_of(&output.column).starts_with("rad"))
    }

    /// Whether the input is a motion, in straight lines between its samples, rather than a force.
    pub fn input_is_motion(&self) -> bool {
        match self {
            Self::Lumped(model) => model.moved_body().is_some(),
            _ => self.input().is_some_and(Input::is_motion),
        }
    }

    /// Whether the input is a motion behind the drive, as it was or as it is prescribed, and no setpoint:
    /// what the drive does is in it already.
    pub fn input_is_behind_the_drive(&self) -> bool {
        self.input_is_motion() && self.input().is_some_and(|input| input.column != SETPOINT)
    }

    /// Controller, initial state, sensors and left-out physics.
    pub fn setup(&self) -> &Setup {
        match self {
            Self::BeamOnBase(model) => &model.setup,
            Self::Modal(model) => &model.setup,
            Self::Lumped(model) => &model.setup,
        }
    }

    /// The same, to be changed; [`Model::check`] afterwards.
    pub fn setup_mut(&mut self) -> &mut Setup {
        match self {
            Self::BeamOnBase(model) => &mut model.setup,
            Self::Modal(model) => &mut model.setup,
            Self::Lumped(model) => &mut model.setup,
        }
    }

    /// Parameters that a refit must not move, by path.
    pub fn fixed(&self) -> &std::collections::BTreeMap<String, bool> {
        match self {
            Self::BeamOnBase(model) => &model.fixed,
            Self::Modal(model) => &model.fixed,
            Self::Lumped(model) => &model.fixed,
        }
    }

    /// The servo between setpoint and base, if the model has one and its input passes through it.
    pub fn servo(&self) -> Option<&crate::drive::ServoDrive> {
        let drive = match self {
            Self::BeamOnBase(model) => model.drive.as_ref(),
            Self::Modal(model) => model.drive.as_ref(),
            Self::Lumped(_) => None,
        };
        self.input().and_then(|input| crate::state_space::drive_for(&input.column, drive))
    }
}

/// The unit that ends a column's name.
pub(crate) fn unit_of(column: &str) -> String {
    stillbeam_recording::Column { name: column.to_owned(), samples: Vec::new() }.unit().to_owned()
}

/// Whether a number's path is this one, or lies below it.
pub(crate) fn lies_below(number: &str, path: &str) -> bool {
    number.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}
