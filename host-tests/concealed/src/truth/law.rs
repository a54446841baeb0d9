//! Physics that the nominal model lacks: what a law is called and its parameters, and its formulation in this
//! simulator.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

/// A law with its place and parameters, as the catalogue of the model files names them; ids that begin with
/// `outside:` are in no catalogue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Physics {
    /// Which law.
    pub id: String,
    /// Where it sits.
    pub location: String,
    /// Parameters by name, SI units.
    pub parameters: BTreeMap<String, f64>,
}

impl Physics {
    /// A law with parameters.
    pub fn new(id: &str, location: &str, parameters: &[(&str, f64)]) -> Self {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { id: id.to_owned(), location: location.to_owned(), parameters }
    }

    /// A parameter, 0 if it is not given.
    pub fn get(&self, name: &str) -> f64 {
        self.parameters.get(name).copied().unwrap_or(0.0)
    }
}

/// Dry friction at a point: what it needs to slide and what holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dry {
    /// The same force always.
    Coulomb(f64),
    /// Sliding force, holding force, speed of the transition.
    Stribeck(f64, f64, f64),
    /// Dry backward, dry forward, viscous backward, viscous forward.
    Asymmetric([f64; 4]),
    /// In proportion to the displacement's size: a joint pressed together by its own load (in no catalogue).
    Loaded(f64),
}

impl Dry {
    /// Size of the force while sliding in a direction with a speed at a displacement.
    pub fn sliding(&self, forward: bool, speed: f64, z: f64) -> f64 {
        match *self {
            Self::Coulomb(force) => force,
            Self::Stribeck(force, holding, velocity) => {
                force + (holding.max(force) - force) * (-(speed / velocity).powi(2)).exp()
            }
            Self::Asymmetric(sizes) => {
                let side = usize::from(forward);
                sizes[side] + sizes[2 + side] * speed
            }
            Self::Loaded(per_displacement) => per_displacement * z.abs(),
        }
    }

    /// The most force that keeps it at rest against motion in a direction.
    pub fn holding(&self, forward: bool, z: f64) -> f64 {
        self.sliding(forward, 0.0, z)
    }
}

/// A force that follows from where and how fast a point is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smooth {
    /// `-c v`.
    Viscous(f64),
    /// `-c v` while `v` is above zero.
    Absorber(f64),
    /// `-c v |v|`.
    Drag(f64),
    /// `-c z² v`.
    AmplitudeDamping(f64),
    /// `-k z³`.
    Cubic(f64),
    /// `-k z²`.
    Quadratic(f64),
    /// `-k (z − rest)`.
    Spring(f64, f64),
    /// `-A sin(2π z/P + phase)`.
    Cogging(f64, f64, f64),
    /// `-k (z − contact)` beyond the contact.
    OneSided(f64, f64),
    /// `-k (|z| − distance)` beyond either stop.
    Stops(f64, f64),
    /// Takes the spring `k` back inside half the gap and by half the gap beyond.
    Gap(f64, f64),
    /// The same always.
    Constant(f64),
    /// `A sin(2π f t + phase)`.
    Shaker(f64, f64, f64),
    /// `u r sin(2π z/P + phase)` with u the drive's force.
    Ripple(f64, f64, f64),
    /// `-k e sin(2π f t) z`: a stiffness that something else pumps (in no catalogue).
    Pumped(f64, f64),
    /// `-k z` from a time on: something came loose or jammed (in no catalogue).
    Switched(f64, f64),
    /// `±A`, changing sign at times that have no pattern (in no catalogue).
    Telegraph(f64, u64),
}

impl Smooth {
    /// Whether its slope jumps at some displacement.
    pub fn has_contacts(&self) -> bool {
        matches!(self, Self::OneSided(..) | Self::Stops(..) | Self::Gap(..))
    }

    /// The same law in one run among others: what is random does not repeat itself from recording to
    /// recording.
    pub fn of_run(self, mark: u64) -> Self {
        match self {
            Self::Telegraph(size, seed) => Self::Telegraph(size, seed ^ mark),
            other => other,
        }
    }

    /// The force in the direction of the point's displacement.
    pub fn force(&self, time_s: f64, z: f64, v: f64, u: f64) -> f64 {
        match *self {
            Self::Viscous(c) => -c * v,
            Self::Absorber(c) => -c * v.max(0.0),
            Self::Drag(c) => -c * v * v.abs(),
            Self::AmplitudeDamping(c) => -c * z * z * v,
            Self::Cubic(k) => -k * z * z * z,
            Self::Quadratic(k) => -k * z * z,
            Self::Spring(k, rest) => -k * (z - rest),
            Self::Cogging(size, period, phase) => -size * (TAU * z / period + phase).sin(),
            Self::OneSided(k, contact) => -k * (z - contact).max(0.0),
            Self::Stops(k, distance) => -k * (z.abs() - distance).max(0.0) * z.signum(),
            Self::Gap(k, gap) => k * z.clamp(-0.5 * gap, 0.5 * gap),
            Self::Constant(force) => force,
            Self::Shaker(size, frequency_hz, phase) => size * (TAU * frequency_hz * time_s + phase).sin(),
            Self::Ripple(share, period, phase) => u * share * (TAU * z / period + phase).sin(),
            Self::Pumped(k, frequency_hz) => -k * (TAU * frequency_hz * time_s).sin() * z,
            Self::Switched(k, from_s) => {
                if time_s < from_s {
                    0.0
                } else {
                    -k * z
                }
            }
            Self::Telegraph(size, seed) => size * telegraph(time_s, seed),
        }
    }
}

/// A sign that changes at irregular times, about every second, smoothed over 20 ms.
fn telegraph(time_s: f64, seed: u64) -> f64 {
    let slot = |number: f64| {
        let mixed = (number as i64 as u64).wrapping_add(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        if (mixed >> 63) == 0 { -1.0 } else { 1.0 }
    };
    let slots = time_s / 0.37;
    let (number, past) = (slots.floor(), slots.fract() * 0.37 / 0.02);
    let (before, now) = (slot(number - 1.0), slot(number));
    if past >= 1.0 { now } else { before + (now - before) * past * past * (3.0 - 2.0 * past) }
}

/// What happens to a signal between command and drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// First-order lag with a time constant.
    Lag(f64),
    /// Pure delay.
    DeadTime(f64),
    /// Clipped either way.
    Saturation(f64),
    /// Small values do nothing; what exceeds passes.
    DeadZone(f64),
    /// `u (1 + a u + b u²)`.
    Bent(f64, f64),
    /// Play: half the total lost motion either way; of a prescribed motion only.
    Play(f64),
    /// Slew rate limited: in no catalogue.
    Slew(f64),
}

/// What happens between an output and its reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sensor {
    /// Reports late.
    Delay(f64),
    /// Stamps with a clock that is fast by this share.
    Skew(f64),
    /// Trailing mean.
    Exposure(f64),
    /// Clipped readings.
    Saturation(f64),
    /// Readings in steps.
    Quantisation(f64),
    /// `y (1 + a y + b y²)`.
    Bent(f64, f64),
    /// A share of the base shows.
    Crosstalk(f64),
    /// `(1 − s) y + s |y|`.
    Rectification(f64),
    /// A pointer with play: follows only after half of this either way (in no catalogue).
    Play(f64),
    /// Line by line read-out: a reading is later by this many seconds per metre of deflection (in no
    /// catalogue).
    Rolling(f64),
}

/// A law put to work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Dry friction at the law's place.
    Dry(Dry),
    /// A smooth force at the law's place.
    Smooth(Smooth),
    /// Bouc-Wen force at the law's place: stiffness, beta, gamma.
    Hysteresis([f64; 3]),
    /// In the drive.
    Drive(Drive),
    /// In the sensor of the first output.
    Sensor(Sensor),
    /// Frequencies grow by this share per second.
    Drift(f64),
    /// Frequency in hertz, damping ratio, participation of a further mode.
    ExtraMode([f64; 3]),
    /// Mass at the tip, kg.
    TipMass(f64),
    /// Rotational compliance of the clamp, rad/(N·m).
    ClampCompliance(f64),
}

/// The formulation of a law; `None` for an id that this simulator does not know at that place.
///
/// `spring` is the stiffness of the law's pair of bodies, for a gap in it.
pub fn action(law: &Physics, spring: f64) -> Option<Action> {
    let p = |name: &str| law.get(name);
    Some(match (law.location.as_str(), law.id.as_str()) {
        ("drive", "servo_lag") => Action::Drive(Drive::Lag(p("time_constant"))),
        ("drive", "dead_time") => Action::Drive(Drive::DeadTime(p("delay"))),
        ("drive", "saturation") => Action::Drive(Drive::Saturation(p("limit"))),
        ("drive", "dead_zone") => Action::Drive(Drive::DeadZone(p("threshold"))),
        ("drive", "gain_nonlinearity") => Action::Drive(Drive::Bent(p("quadratic"), p("cubic"))),
        ("drive", "force_ripple") => Action::Smooth(Smooth::Ripple(p("ripple"), p("period"), p("phase"))),
        ("drive", "outside:slew_rate") => Action::Drive(Drive::Slew(p("rate"))),
        ("sensor", "delay") => Action::Sensor(Sensor::Delay(p("delay"))),
        ("sensor", "clock_skew") => Action::Sensor(Sensor::Skew(p("skew"))),
        ("sensor", "exposure_blur") => Action::Sensor(Sensor::Exposure(p("exposure"))),
        ("sensor", "saturation") => Action::Sensor(Sensor::Saturation(p("limit"))),
        ("sensor", "quantisation") => Action::Sensor(Sensor::Quantisation(p("step"))),
        ("sensor", "nonlinearity") => Action::Sensor(Sensor::Bent(p("quadratic"), p("cubic"))),
        ("sensor", "crosstalk") => Action::Sensor(Sensor::Crosstalk(p("share"))),
        ("sensor", "rectification") => Action::Sensor(Sensor::Rectification(p("share"))),
        ("sensor", "outside:play") => Action::Sensor(Sensor::Play(p("play"))),
        ("sensor", "outside:rolling_shutter") => Action::Sensor(Sensor::Rolling(p("line_time"))),
        ("environment", "periodic_disturbance") => {
            Action::Smooth(Smooth::Shaker(p("force"), p("frequency"), p("phase")))
        }
        ("environment", "parameter_drift") => Action::Drift(p("rate")),
        ("base", "backlash") => Action::Drive(Drive::Play(p("gap"))),
        ("beam", "extra_mode") => Action::ExtraMode([p("frequency"), p("damping_ratio"), p("participation")]),
        ("beam", "tip_mass") => Action::TipMass(p("mass")),
        ("beam", "clamp_compliance") => Action::ClampCompliance(p("compliance")),
        ("drive" | "sensor" | "environment", _) => return None,
        (_, "coulomb_friction") => Action::Dry(Dry::Coulomb(p("force"))),
        (_, "stribeck_friction") => Action::Dry(Dry::Stribeck(p("force"), p("static_force"), p("velocity"))),
        (_, "asymmetric_friction") => Action::Dry(Dry::Asymmetric([
            p("force_backward"),
            p("force_forward"),
            p("viscous_backward"),
            p("viscous_forward"),
        ])),
        (_, "viscous_friction") => Action::Smooth(Smooth::Viscous(p("damping"))),
        (_, "bilinear_damping") => Action::Smooth(Smooth::Absorber(p("damping"))),
        (_, "quadratic_drag") => Action::Smooth(Smooth::Drag(p("drag"))),
        (_, "amplitude_damping") => Action::Smooth(Smooth::AmplitudeDamping(p("damping"))),
        (_, "cubic_stiffness") => Action::Smooth(Smooth::Cubic(p("stiffness"))),
        (_, "quadratic_stiffness") => Action::Smooth(Smooth::Quadratic(p("stiffness"))),
        (_, "cable_spring") => Action::Smooth(Smooth::Spring(p("stiffness"), p("rest_position"))),
        (_, "cogging") => Action::Smooth(Smooth::Cogging(p("force"), p("period"), p("phase"))),
        (_, "bilinear_stiffness") => Action::Smooth(Smooth::OneSided(p("stiffness"), p("contact"))),
        (_, "end_stop") => Action::Smooth(Smooth::Stops(p("stiffness"), p("distance"))),
        (_, "backlash") => Action::Smooth(Smooth::Gap(spring, p("gap"))),
        (_, "constant_force") => Action::Smooth(Smooth::Constant(p("force"))),
        (_, "hysteresis") => Action::Hysteresis([p("stiffness"), p("beta"), p("gamma")]),
        (_, "outside:pumped_stiffness") => Action::Smooth(Smooth::Pumped(p("stiffness"), p("frequency"))),
        (_, "outside:stiffness_step") => Action::Smooth(Smooth::Switched(p("stiffness"), p("from"))),
        (_, "outside:random_telegraph") => Action::Smooth(Smooth::Telegraph(p("force"), p("seed") as u64)),
        (_, "outside:loaded_friction") => Action::Dry(Dry::Loaded(p("friction"))),
        _ => return None,
    })
}
