//! Which laws a family of machines can have, and what they look like at a strength.

use std::f64::consts::TAU;

use super::draw_machine::Family;
use crate::random::Random;
use crate::truth::law::Physics;

/// Sizes at the place of a law, from a run without it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Greatest displacement.
    pub z: f64,
    /// Greatest speed.
    pub v: f64,
    /// A force that matters there.
    pub force: f64,
    /// Greatest command.
    pub command: f64,
    /// Greatest reading of the first output.
    pub reading: f64,
    /// A frequency in the middle of the band, hertz.
    pub frequency_hz: f64,
    /// Stiffness of the clamp, N·m/rad, and mass of the beam, kg; 1 where there is no beam.
    pub clamp: f64,
    /// Mass of the beam in kg; 1 where there is none.
    pub beam_kg: f64,
}

/// A law at a place, without a size.
#[derive(Debug, Clone, PartialEq)]
pub struct Dish {
    /// Which law.
    pub id: &'static str,
    /// Where.
    pub location: &'static str,
    /// What does not depend on the strength: five numbers on 0..1.
    pub flavour: [f64; 5],
}

/// Laws of the catalogue that can sit in a family.
pub fn menu(family: Family) -> Vec<(&'static str, &'static str)> {
    const BEAM: [&str; 6] = [
        "quadratic_drag",
        "cubic_stiffness",
        "coulomb_friction",
        "hysteresis",
        "bilinear_stiffness",
        "amplitude_damping",
    ];
    const FRICTION: [&str; 9] = [
        "coulomb_friction",
        "stribeck_friction",
        "asymmetric_friction",
        "quadratic_drag",
        "cogging",
        "cable_spring",
        "cubic_stiffness",
        "hysteresis",
        "end_stop",
    ];
    const SENSOR: [&str; 8] = [
        "delay",
        "saturation",
        "quantisation",
        "nonlinearity",
        "crosstalk",
        "exposure_blur",
        "clock_skew",
        "rectification",
    ];
    const DRIVE: [&str; 5] = ["servo_lag", "dead_time", "saturation", "dead_zone", "gain_nonlinearity"];
    let at = |location: &'static str, ids: &[&'static str]| {
        ids.iter().map(|id| (*id, location)).collect::<Vec<_>>()
    };
    let mut dishes = Vec::new();
    match family {
        Family::MovedBeam => {
            dishes.extend(at("beam", &BEAM));
            dishes.extend(at("beam", &["extra_mode", "tip_mass"]));
            dishes.extend(at("sensor", &SENSOR));
            dishes.extend(at("environment", &["parameter_drift"]));
        }
        Family::CommandedBeam => {
            dishes.extend(at("beam", &BEAM));
            dishes.extend(at("base", &["backlash"]));
            dishes.extend(at("drive", &DRIVE));
            dishes.extend(at("sensor", &["delay", "nonlinearity", "clock_skew"]));
            dishes.extend(at("environment", &["parameter_drift"]));
        }
        Family::ServoBeam => {
            dishes.extend(at("beam", &BEAM));
            dishes.extend(at("base", &["coulomb_friction", "cogging"]));
            dishes.extend(at("drive", &["saturation", "dead_zone", "gain_nonlinearity"]));
        }
        Family::PushedBeam => {
            dishes.extend(at("base", &FRICTION));
            dishes.extend(at("base", &["constant_force"]));
            dishes.extend(at("beam", &BEAM));
            dishes.extend(at("drive", &DRIVE));
            dishes.extend(at("drive", &["force_ripple"]));
            dishes.extend(at("sensor", &["delay", "nonlinearity", "crosstalk", "clock_skew"]));
            dishes.extend(at("environment", &["periodic_disturbance"]));
        }
        Family::Stage => {
            dishes.extend(at("slider", &FRICTION));
            dishes.extend(at("slider", &["amplitude_damping", "bilinear_stiffness"]));
            dishes.extend(at("drive", &DRIVE));
            dishes.extend(at("drive", &["force_ripple"]));
            dishes.extend(at("sensor", &["delay", "nonlinearity", "quantisation"]));
            dishes.extend(at("environment", &["periodic_disturbance", "parameter_drift"]));
        }
        Family::TwoBodies => {
            dishes.extend(at("motor", &FRICTION));
            dishes.extend(at("load", &["coulomb_friction", "quadratic_drag"]));
            dishes
                .extend(at("motor-load", &["backlash", "cubic_stiffness", "coulomb_friction", "hysteresis"]));
            dishes.extend(at("drive", &DRIVE));
            dishes.extend(at("environment", &["periodic_disturbance"]));
        }
        Family::LoopedSlide => {
            let without_spring = FRICTION.iter().filter(|id| **id != "end_stop").copied().collect::<Vec<_>>();
            dishes.extend(at("slider", &without_spring));
            dishes.extend(at("slider", &["constant_force"]));
            dishes.extend(at("environment", &["periodic_disturbance"]));
        }
        Family::RingingStage => {
            let decaying = FRICTION.iter().filter(|id| **id != "end_stop").copied().collect::<Vec<_>>();
            dishes.extend(at("slider", &decaying));
            dishes.extend(at("slider", &["amplitude_damping", "bilinear_stiffness"]));
            dishes.extend(at("sensor", &["nonlinearity", "quantisation"]));
        }
    }
    dishes
}

/// Laws that no catalogue has.
pub fn outside(family: Family) -> Vec<(&'static str, &'static str)> {
    let place = match family {
        Family::PushedBeam => "base",
        Family::Stage | Family::LoopedSlide | Family::RingingStage => "slider",
        Family::TwoBodies => "motor",
        _ => "beam",
    };
    let mut dishes = vec![
        ("outside:random_telegraph", place),
        ("outside:play", "sensor"),
        ("outside:rolling_shutter", "sensor"),
    ];
    match family {
        // Without a spring at the base there is nothing to pump.
        Family::PushedBeam => dishes.push(("outside:pumped_stiffness", "beam")),
        _ => dishes.push(("outside:pumped_stiffness", place)),
    }
    if place != "base" {
        dishes.extend([("outside:stiffness_step", place), ("outside:loaded_friction", place)]);
    }
    dishes
}

impl Dish {
    /// A law without a size, with what else it needs drawn.
    pub fn draw(id: &'static str, location: &'static str, random: &mut Random) -> Self {
        Self { id, location, flavour: std::array::from_fn(|_| random.unit()) }
    }

    /// The greatest strength that still looks like a machine.
    pub fn most(&self) -> f64 {
        match self.id {
            "saturation" | "end_stop" => 0.6,
            "rectification" | "crosstalk" | "dead_zone" | "force_ripple" => 0.6,
            "coulomb_friction" | "stribeck_friction" | "asymmetric_friction" | "constant_force" => 0.5,
            "delay" | "dead_time" | "servo_lag" | "exposure_blur" | "clock_skew" => 0.8,
            "quantisation" => 0.15,
            _ => 2.0,
        }
    }

    /// The law at a strength; the effect grows with it.
    pub fn at(&self, strength: f64, sizes: &Sizes) -> Physics {
        let [a, b, c, ..] = self.flavour;
        let sign = if a < 0.5 { -1.0 } else { 1.0 };
        let Sizes { z, v, force, command, reading, .. } = *sizes;
        let middle = TAU * sizes.frequency_hz;
        let s = strength;
        let phase = TAU * (b - 0.5);
        let with = |parameters: &[(&str, f64)]| Physics::new(self.id, self.location, parameters);
        match (self.location, self.id) {
            ("drive", "saturation") => with(&[("limit", command * (1.0 - s))]),
            ("sensor", "saturation") => with(&[("limit", reading * (1.0 - s))]),
            (_, "coulomb_friction") => with(&[("force", s * force)]),
            (_, "stribeck_friction") => with(&[
                ("force", s * force),
                ("static_force", s * force * (1.4 + 0.6 * b)),
                ("velocity", v * (0.03 + 0.12 * c)),
            ]),
            (_, "asymmetric_friction") => {
                let lean = sign * (0.3 + 0.4 * b);
                with(&[
                    ("force_forward", s * force * (1.0 + lean)),
                    ("force_backward", s * force * (1.0 - lean)),
                ])
            }
            (_, "quadratic_drag") => with(&[("drag", s * force / (v * v))]),
            (_, "amplitude_damping") => with(&[("damping", 4.0 * s * force / (z * z * v))]),
            (_, "cogging") => {
                with(&[("force", s * force), ("period", z * (0.3 + 0.7 * c)), ("phase", phase)])
            }
            (_, "cable_spring") => with(&[("stiffness", s * force / z), ("rest_position", z * (b - 0.5))]),
            (_, "cubic_stiffness") => with(&[("stiffness", sign * s.min(0.6) * force / (z * z * z))]),
            (_, "hysteresis") => {
                let yields = z * (0.05 + 0.25 * b);
                with(&[("stiffness", s * force / yields), ("beta", 1.0 / yields), ("gamma", 0.0)])
            }
            (_, "end_stop") => {
                with(&[("distance", z * (1.0 - s)), ("stiffness", (4.0 + 8.0 * b) * force / z)])
            }
            (_, "constant_force") => with(&[("force", sign * s * force)]),
            ("base", "backlash") => with(&[("gap", 2.0 * s.min(0.6) * command)]),
            (_, "backlash") => with(&[("gap", 2.0 * s.min(0.8) * z)]),
            (_, "bilinear_stiffness") => {
                with(&[("stiffness", sign * s.min(0.6) * force / z), ("contact", z * (0.05 + 0.4 * b))])
            }
            (_, "extra_mode") => with(&[
                ("frequency", sizes.frequency_hz * (0.7 + 0.7 * b)),
                ("damping_ratio", 0.01 + 0.02 * c),
                ("participation", sign * s),
            ]),
            (_, "tip_mass") => with(&[("mass", s * sizes.beam_kg)]),
            (_, "clamp_compliance") => with(&[("compliance", s / sizes.clamp)]),
            (_, "servo_lag") => with(&[("time_constant", s / middle)]),
            (_, "dead_time") => with(&[("delay", s / middle)]),
            (_, "dead_zone") => with(&[("threshold", s * command)]),
            (_, "force_ripple") => with(&[("ripple", s), ("period", z * (0.4 + 0.8 * c)), ("phase", phase)]),
            ("drive", "gain_nonlinearity") => {
                let (quadratic, cubic) = bent(b, sign * s.min(0.5), command);
                with(&[("quadratic", quadratic), ("cubic", cubic)])
            }
            (_, "nonlinearity") => {
                let (quadratic, cubic) = bent(b, sign * s.min(0.5), reading);
                with(&[("quadratic", quadratic), ("cubic", cubic)])
            }
            (_, "delay") => with(&[("delay", s / middle)]),
            (_, "clock_skew") => with(&[("skew", (sign * s / middle / 25.0).clamp(-9e-3, 9e-3))]),
            (_, "exposure_blur") => with(&[("exposure", 2.0 * s / middle)]),
            (_, "quantisation") => with(&[("step", s * reading)]),
            (_, "crosstalk") => with(&[("share", sign * s)]),
            (_, "rectification") => with(&[("share", s)]),
            (_, "periodic_disturbance") => with(&[
                ("force", s * force),
                ("frequency", sizes.frequency_hz * (0.75 + 0.6 * c)),
                ("phase", phase),
            ]),
            (_, "parameter_drift") => with(&[("rate", (sign * 0.02 * s).clamp(-9e-3, 9e-3))]),
            (_, "outside:random_telegraph") => with(&[("force", s * force), ("seed", (1e6 * b).floor())]),
            (_, "outside:play") => with(&[("play", s * reading)]),
            (_, "outside:rolling_shutter") => with(&[("line_time", s / middle / reading)]),
            (_, "outside:pumped_stiffness") => with(&[
                ("stiffness", s.min(0.5) * force / z),
                ("frequency", sizes.frequency_hz * (0.3 + 0.5 * b)),
            ]),
            (_, "outside:stiffness_step") => {
                with(&[("stiffness", sign * s.min(0.5) * force / z), ("from", 8.0 + 8.0 * b)])
            }
            (_, "outside:loaded_friction") => with(&[("friction", s * force / z)]),
            _ => with(&[]),
        }
    }
}

/// Either a quadratic or a cubic coefficient of this relative size at an amplitude.
fn bent(flavour: f64, size: f64, amplitude: f64) -> (f64, f64) {
    if flavour < 0.5 { (size / amplitude, 0.0) } else { (0.0, size / (amplitude * amplitude)) }
}
