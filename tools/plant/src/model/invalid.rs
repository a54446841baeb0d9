//! What can be wrong with a model's parameters, and what to do about it.

use thiserror::Error;

use crate::matrices::MatricesProblem;

/// A parameter that cannot be used: which one, and why.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("`{key}`: {problem}")]
pub struct InvalidParameter {
    /// Path of the parameter in a model file, such as `beam.width_m` or `mode.1.frequency_hz` (1-based).
    pub key: String,
    /// What is wrong, and the remedy.
    pub problem: Problem,
}

impl InvalidParameter {
    pub(crate) fn new(key: impl Into<String>, problem: Problem) -> Self {
        Self { key: key.into(), problem }
    }
}

/// The problem itself.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Problem {
    /// A quantity that only makes sense above zero.
    #[error("{value} is not a positive finite number; give one greater than zero")]
    NotPositive {
        /// The value found.
        value: f64,
    },
    /// A quantity that may be zero but not negative.
    #[error("{value} is negative or not finite; give zero or a positive number")]
    Negative {
        /// The value found.
        value: f64,
    },
    /// Infinite or not a number.
    #[error("{value} is not finite; give an ordinary number")]
    NotFinite {
        /// The value found.
        value: f64,
    },
    /// A motion that would be taken for a force.
    #[error(
        "{column} is a length and would be taken for a force; a motion of the base is called base_position_m, or setpoint_m \
         before the drive, and is in metres: read recordings with --column base_position_m={column}{scale}"
    )]
    MotionAsForce {
        /// The input's column.
        column: String,
        /// The factor that makes metres of it, as the option takes it.
        scale: &'static str,
    },
    /// Only underdamped modes vibrate.
    #[error(
        "damping ratio {value} of mode {mode} is outside 0 <= zeta < 1; a lightly damped beam has about 0.005"
    )]
    DampingRange {
        /// The value found.
        value: f64,
        /// 1-based mode.
        mode: usize,
    },
    /// One damping ratio per mode.
    #[error("{found} damping ratio(s) for {modes} mode(s); give one per mode")]
    DampingCount {
        /// Modes asked for.
        modes: usize,
        /// Ratios given.
        found: usize,
    },
    /// Both or neither of `damping_ratio` and `rayleigh`.
    #[error(
        "give either `damping_ratio` (one per mode) or `rayleigh = [alpha1, alpha2]`, not both and not neither"
    )]
    DampingChoice,
    /// Mode count out of range.
    #[error("{found} mode(s) asked for; give a whole number from 1 to {most}")]
    ModeCount {
        /// Modes asked for.
        found: i64,
        /// The most that are supported.
        most: usize,
    },
    /// Too few corners to be a line.
    #[error(
        "a profile of {found} corner(s); give one number for a uniform beam, or at least two [x_m, value_m] corners"
    )]
    ProfileCorners {
        /// Corners given.
        found: usize,
    },
    /// The profile does not span the beam.
    #[error(
        "the profile runs from {first_m} m to {last_m} m and does not cover the beam, 0 to {length_m} m; make the first corner 0.0 and the last beam.length_m"
    )]
    ProfileCover {
        /// Position of the first corner.
        first_m: f64,
        /// Position of the last corner.
        last_m: f64,
        /// The beam's length.
        length_m: f64,
    },
    /// Corner positions must increase.
    #[error(
        "corner {corner} at {x_m} m does not lie beyond the one before; sort the corners by position, each position once"
    )]
    ProfileOrder {
        /// 1-based corner.
        corner: usize,
        /// Its position.
        x_m: f64,
    },
    /// A corner without material.
    #[error("{value_m} m at corner {corner} is not a positive finite number; a beam has material everywhere")]
    ProfileValue {
        /// 1-based corner.
        corner: usize,
        /// Its value.
        value_m: f64,
    },
    /// The input column means nothing to this kind of model.
    #[error("`{found}` cannot drive this model; use one of {}", allowed.join(", "))]
    InputColumn {
        /// The column given.
        found: String,
        /// The columns that can.
        allowed: Vec<String>,
    },
    /// A gain other than 1 on a motion.
    #[error("gain {gain} on a motion input; a gain scales forces only, remove it or rescale the column")]
    GainOnMotion {
        /// The gain given.
        gain: f64,
    },
    /// The output column means nothing to this kind of model.
    #[error("this model does not compute `{found}`; use one of {}", allowed.join(", "))]
    OutputColumn {
        /// The column given.
        found: String,
        /// The columns it computes.
        allowed: Vec<String>,
    },
    /// No name where one is needed.
    #[error("the column has no name; give one that ends in its unit, such as tip_deflection_m")]
    EmptyColumn,
    /// A column given twice, or an output named as the input or the time.
    #[error("`{column}` is used for more than one signal; give every signal its own column")]
    RepeatedColumn {
        /// The repeated name.
        column: String,
    },
    /// Nothing to compute.
    #[error("there is none; add at least one")]
    Missing,
    /// One participation per output.
    #[error("{found} participation(s) for {outputs} output(s); give one per [[output]]")]
    ParticipationCount {
        /// Outputs of the model.
        outputs: usize,
        /// Participations given.
        found: usize,
    },
    /// A real pole where nothing slides freely under a force.
    #[error(
        "a real pole belongs to a base that a force pushes: the input must be a force and every output a position or a velocity"
    )]
    RealPolePlace,
    /// Lags, rigid motion, quadrature or feedthrough where there is no place for them.
    #[error(
        "lags, rigid motion, quadrature and feedthrough belong to modes that a force drives, without a real pole; remove them, or take a force or an acceleration as input"
    )]
    BesidePlace,
    /// A driving point without a force.
    #[error(
        "the driving point is where a force acts: the input must be a force, and there must be no real pole; remove `driving_point`"
    )]
    DrivingPointInput,
    /// The motion at the driving point does not follow from the output.
    #[error(
        "`{column}` has a share of the force itself, or lags or free motion in an acceleration, so that it does not say where the point is; mark an output that is the point's position or velocity"
    )]
    DrivingPointOutput {
        /// The output.
        column: String,
    },
    /// Matrices or a transfer function that are no model.
    #[error(transparent)]
    Matrices(Box<MatricesProblem>),
    /// Rates of some modes only.
    #[error(
        "rates of {found} modes for {modes} modes; give every [[mode]] its rate_participation, 0 for none"
    )]
    RatesPerMode {
        /// Modes of the model.
        modes: usize,
        /// Modes with a rate.
        found: usize,
    },
    /// The acceleration of a base known by sampled positions is not a function of time.
    #[error(
        "the acceleration of a mode is a train of impulses when the base's motion is given by sampled positions; use quantity = \"position\" or \"velocity\""
    )]
    AccelerationFromMotion,
    /// A section that is neither a rectangle nor tables.
    #[error(
        "give either `width_m` and `thickness_m` (a rectangular section) or `area_m2` and `second_moment_m4` (any other), not both and not one of each"
    )]
    SectionChoice,
    /// A controller without anything to act on.
    #[error(
        "a controller acts through the model's input; add an [input] with the column of the controller's output"
    )]
    ControllerWithoutInput,
    /// A limit of a motor that is not there.
    #[error(
        "an acceleration limit needs a servo: an input `setpoint_m` and `drive.bandwidth_hz`; add them or use `drive.limit`"
    )]
    NeedsServo,
    /// A key that an encoder does not have.
    #[error(
        "an encoder reads the position now, at every time stamp; remove the key or use kind = \"camera\""
    )]
    CameraOnly,
    /// Too many bodies.
    #[error("{found} bodies; at most {most} are supported, lump some together")]
    BodyCount {
        /// Bodies given.
        found: usize,
        /// The most that are supported.
        most: usize,
    },
    /// A name that cannot be used.
    #[error("\"{found}\" cannot name a body; use letters, digits and _, each name once, and not \"ground\"")]
    BodyName {
        /// The name given.
        found: String,
    },
    /// No such body.
    #[error("there is no body \"{found}\"; use one of {}", allowed.join(", "))]
    UnknownBody {
        /// The name given.
        found: String,
        /// The names there are.
        allowed: Vec<String>,
    },
    /// A pair that is none, or there twice.
    #[error(
        "\"{found}\" joins a body to itself or is there twice; name two different ends, and give each pair once"
    )]
    BadPair {
        /// The pair given.
        found: String,
    },
    /// The only body is moved by the input.
    #[error("the input prescribes the position of the only body, so nothing is left to move; add a body")]
    NothingFree,
    /// No such law.
    #[error("there is no law \"{found}\"; use one of {}", allowed.join(", "))]
    UnknownLaw {
        /// The id given.
        found: String,
        /// The laws there are.
        allowed: Vec<String>,
    },
    /// A law at a place where it cannot act.
    #[error("{what} of this model; {remedy}")]
    LawPlace {
        /// Which law cannot sit where.
        what: String,
        /// What to do instead.
        remedy: String,
    },
    /// A parameter that the law does not have.
    #[error("{law} has no such parameter; it has {}", allowed.join(", "))]
    LawParameter {
        /// The law.
        law: String,
        /// The parameters it has.
        allowed: Vec<String>,
    },
    /// A value out of the bounds of a law's parameter.
    #[error("{value} is outside {lower} to {upper} {unit}; give a value in that range")]
    OutOfBounds {
        /// The value given.
        value: f64,
        /// Least value.
        lower: f64,
        /// Greatest value.
        upper: f64,
        /// Unit.
        unit: String,
    },
    /// No number at this path.
    #[error("the model has no such parameter; it has {}", allowed.join(", "))]
    UnknownPath {
        /// The paths there are.
        allowed: Vec<String>,
    },
    /// `[fixed]` names something that is not a parameter of the model.
    #[error("this is not a parameter of the model; `[fixed]` may name {}", allowed.join(", "))]
    FixedPath {
        /// The parameters there are.
        allowed: Vec<String>,
    },
}

/// `Ok` when `value` is finite and above zero.
pub(crate) fn positive(key: impl Into<String>, value: f64) -> Result<(), InvalidParameter> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(InvalidParameter::new(key, Problem::NotPositive { value }))
}

/// `Ok` when `value` is finite and not below zero.
pub(crate) fn not_negative(key: impl Into<String>, value: f64) -> Result<(), InvalidParameter> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(InvalidParameter::new(key, Problem::Negative { value }))
}

/// `Ok` when `value` is finite.
pub(crate) fn finite(key: impl Into<String>, value: f64) -> Result<(), InvalidParameter> {
    if value.is_finite() {
        return Ok(());
    }
    Err(InvalidParameter::new(key, Problem::NotFinite { value }))
}

/// `Ok` when the damping ratio of the 1-based `mode` is underdamped.
pub(crate) fn underdamped(key: impl Into<String>, mode: usize, value: f64) -> Result<(), InvalidParameter> {
    if (0.0..1.0).contains(&value) {
        return Ok(());
    }
    Err(InvalidParameter::new(key, Problem::DampingRange { value, mode }))
}

/// `Ok` when the names are there and all different, and none is the time.
pub(crate) fn distinct_columns<'a>(
    keys_and_names: impl IntoIterator<Item = (String, &'a str)>,
) -> Result<(), InvalidParameter> {
    let mut seen = std::collections::HashSet::from([stillbeam_recording::TIME_COLUMN]);
    for (key, name) in keys_and_names {
        if name.is_empty() {
            return Err(InvalidParameter::new(key, Problem::EmptyColumn));
        }
        if !seen.insert(name) {
            let column = name.to_owned();
            return Err(InvalidParameter::new(key, Problem::RepeatedColumn { column }));
        }
    }
    Ok(())
}
