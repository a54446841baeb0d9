//! The catalogue of physics that a model may have left out: one file per law.
//!
//! A model file holds laws as `[[physics]]` tables, and [`crate::simulate()`] runs them:
//!
//! ```toml
//! [[physics]]
//! id = "coulomb_friction"
//! location = "base"
//! parameters = { force = 3.1 }
//! ```
//!
//! | kind of law | acts | written as |
//! |---|---|---|
//! | force law | at an injection point of the [state space](crate::state_space) | [`ForceLaw`] |
//! | drive law | between the recorded input and the plant; `backlash` of a prescribed base behind the servo | [`SignalLaw`] |
//! | sensor law | between an output and its column | [`SensorAction`] |
//! | environment law | a force law that knows the time | [`ForceLaw`] |
//! | linear law | a further mode, a tip mass, a soft clamp: another linear model | [`Structure`] |
//!
//! # Forces over a step
//! Between two samples the linear part is exact for a force that is constant over a sub-step, and every law
//! chooses that mean force so that it agrees with the motion it makes ([`Step`]): conservative laws by the
//! difference of their potential energies over the way, which keeps the energy balance exact and makes them
//! stable at any step; laws of the velocity at its mean; hysteresis by its integral along the way; dry
//! friction set-valued, with true sticking. All are of second order in the sub-step.
//!
//! Adding a law is adding a file with a [`Law`] and its line in [`laws`].

mod amplitude_damping;
mod asymmetric_friction;
mod backlash;
mod bilinear_damping;
mod bilinear_stiffness;
mod cable_spring;
mod clamp_compliance;
mod clock_skew;
mod cogging;
mod constant_force;
mod coulomb_friction;
mod crosstalk;
mod cubic_stiffness;
mod dead_time;
mod dead_zone;
mod delay;
mod dry;
mod end_stop;
mod exposure_blur;
mod extra_mode;
mod force_ripple;
mod gain_nonlinearity;
mod hysteresis;
mod law;
mod nonlinearity;
mod parameter_drift;
mod pendulum;
mod periodic_disturbance;
mod piecewise;
mod quadratic_drag;
mod quadratic_stiffness;
mod quantisation;
mod rectification;
mod registry;
mod saturation;
mod servo_lag;
mod small_angles;
mod stribeck_friction;
mod tip_mass;
mod trial;
mod viscous_friction;

pub(crate) use dead_time::Late;
pub use end_stop::BEYOND_REACH;
pub use law::{
    Action, ForceLaw, Given, Instant, Law, ParameterSpec, Place, SensorAction, SignalLaw, Step, Structure,
};
pub use registry::{Candidate, candidates, find, parameters_of, place_of};
pub(crate) use registry::{action, bounds, check, structure};
pub use trial::{Sizes, Trial};

pub(crate) use saturation::Clip;

/// Every law, in the order of the contract's table.
pub fn laws() -> &'static [&'static dyn Law] {
    &[
        &coulomb_friction::CoulombFriction,
        &stribeck_friction::StribeckFriction,
        &viscous_friction::ViscousFriction,
        &asymmetric_friction::AsymmetricFriction,
        &quadratic_drag::QuadraticDrag,
        &cogging::Cogging,
        &cable_spring::CableSpring,
        &cubic_stiffness::CubicStiffness,
        &quadratic_stiffness::QuadraticStiffness,
        &pendulum::Pendulum,
        &hysteresis::Hysteresis,
        &backlash::Backlash,
        &end_stop::EndStop,
        &constant_force::ConstantForce,
        &bilinear_stiffness::BilinearStiffness,
        &bilinear_damping::BilinearDamping,
        &amplitude_damping::AmplitudeDamping,
        &extra_mode::ExtraMode,
        &tip_mass::TipMass,
        &clamp_compliance::ClampCompliance,
        &servo_lag::ServoLag,
        &dead_time::DeadTime,
        &saturation::DriveSaturation,
        &dead_zone::DeadZone,
        &force_ripple::ForceRipple,
        &gain_nonlinearity::GainNonlinearity,
        &delay::Delay,
        &saturation::SensorSaturation,
        &quantisation::Quantisation,
        &nonlinearity::SensorNonlinearity,
        &crosstalk::Crosstalk,
        &exposure_blur::ExposureBlur,
        &clock_skew::ClockSkew,
        &rectification::Rectification,
        &periodic_disturbance::PeriodicDisturbance,
        &parameter_drift::ParameterDrift,
    ]
}
