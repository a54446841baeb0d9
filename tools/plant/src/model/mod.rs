//! Models in memory: plain data, and the checks that make it usable.

mod beam_on_base;
mod invalid;
mod modal;

pub(crate) use beam_on_base::invalid_mode_count;
pub use beam_on_base::{
    BASE_POSITION, BeamDamping, BeamOnBase, BeamParameters, BeamSignal, FORCE, MAX_MODES, SETPOINT,
    TIP_DEFLECTION, TIP_POSITION,
};
pub(crate) use invalid::positive;
pub use invalid::{InvalidParameter, Problem};
pub use modal::{ModalModel, ModalOutput, Quantity};

/// What drives the model: the recording's column of this name.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// `base_position_m` (prescribed base motion), `setpoint_m` (the same, through the drive) or a force:
    /// `force_N` for a beam on a base, any other column for a modal model.
    pub column: String,
    /// Multiplies the column when it is a force; 1 for motion.
    pub gain: f64,
}

impl Input {
    /// The named column with gain 1.
    pub fn new(column: impl Into<String>) -> Self {
        Self { column: column.into(), gain: 1.0 }
    }

    /// Whether the column is a motion of the base, in metres, rather than a force.
    pub fn is_motion(&self) -> bool {
        self.column == BASE_POSITION || self.column == SETPOINT
    }
}

/// A model of any kind.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Model {
    /// Geometry and material of a beam clamped to a translating base.
    BeamOnBase(BeamOnBase),
    /// Modes without geometry, as identification finds them.
    Modal(ModalModel),
}

impl Model {
    /// The model's input; `None` is a free decay.
    pub fn input(&self) -> Option<&Input> {
        match self {
            Self::BeamOnBase(model) => model.input.as_ref(),
            Self::Modal(model) => model.input.as_ref(),
        }
    }

    /// Names of the output columns in file order.
    pub fn output_columns(&self) -> Vec<String> {
        match self {
            Self::BeamOnBase(model) => {
                model.outputs.iter().map(|signal| signal.column().to_owned()).collect()
            }
            Self::Modal(model) => model.outputs.iter().map(|output| output.column.clone()).collect(),
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
        }
    }
}
