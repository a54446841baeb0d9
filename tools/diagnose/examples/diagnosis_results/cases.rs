//! Which physics is left out of which machine, growing with one number.

use std::collections::BTreeMap;

use stillbeam_plant::Physics;

use crate::truth::Bench;

/// A law of one machine, as strong as asked for.
pub struct Case {
    pub bench: Bench,
    pub id: &'static str,
    pub location: &'static str,
    /// Strength 1 is about what the machine might have.
    pub law: fn(f64) -> Physics,
    /// Laws that this one contains, made from it: it is seen only by what they cannot do.
    pub contained: &'static [fn(&Physics) -> Physics],
}

fn law(id: &str, location: &str, parameters: &[(&str, f64)]) -> Physics {
    parameters.iter().fold(Physics::new(id, location), |law, (name, value)| law.with(*name, *value))
}

/// Laws that a law contains.
fn contained(id: &str, location: &str) -> &'static [fn(&Physics) -> Physics] {
    match (id, location) {
        ("stribeck_friction", _) => {
            &[|law| Physics::new("coulomb_friction", "base").with("force", law.parameters["force"])]
        }
        ("asymmetric_friction", _) => &[|law| {
            Physics::new("constant_force", "base").with("force", 0.1 * law.parameters["force_forward"])
        }],
        // While the base moves within one wave.
        ("cogging", _) => &[
            |law| Physics::new("constant_force", "base").with("force", law.parameters["force"]),
            |law| {
                let stiffness = law.parameters["force"] / law.parameters["period"];
                Physics::new("cable_spring", "base").with("stiffness", stiffness)
            },
        ],
        // Before it yields, and when it has.
        ("hysteresis", "base") => &[
            |law| Physics::new("cable_spring", "base").with("stiffness", law.parameters["stiffness"]),
            |law| {
                let force = law.parameters["stiffness"] / law.parameters["beta"];
                Physics::new("coulomb_friction", "base").with("force", force)
            },
        ],
        _ => &[],
    }
}

/// A clamp softer by this many rad/(N·m) lowers this beam's frequencies about as a kilogram at its tip does,
/// as far as small ones go.
const COMPLIANCE_PER_MASS: f64 = 6.7;

/// Sets of laws that may record the same as this one, as strong as makes them the most alike.
pub fn twins(bench: Bench, law: &Physics) -> Vec<Vec<Physics>> {
    let value = |name: &str| law.parameters.get(name).copied().unwrap_or(0.0);
    let other = |id: &str, name: &str, value: f64| {
        Physics { id: id.to_owned(), parameters: BTreeMap::new(), ..law.clone() }.with(name, value)
    };
    match (law.id.as_str(), law.location.as_str()) {
        // The mean over an exposure is late by half of it.
        ("delay", "sensor") if value("delay") > 0.0 => {
            vec![vec![other("exposure_blur", "exposure", 2.0 * value("delay"))]]
        }
        ("exposure_blur", "sensor") => vec![vec![other("delay", "delay", 0.5 * value("exposure"))]],
        // A slow motion comes out of a lag late by its time constant.
        ("dead_time", "drive") => {
            let lag = vec![other("servo_lag", "time_constant", value("delay"))];
            std::iter::once(lag).chain(all_late(bench, value("delay"))).collect()
        }
        ("servo_lag", "drive") => {
            let dead = vec![other("dead_time", "delay", value("time_constant"))];
            std::iter::once(dead).chain(all_late(bench, value("time_constant"))).collect()
        }
        ("tip_mass", "beam") => {
            vec![vec![other("clamp_compliance", "compliance", COMPLIANCE_PER_MASS * value("mass"))]]
        }
        ("clamp_compliance", "beam") => {
            vec![vec![other("tip_mass", "mass", value("compliance") / COMPLIANCE_PER_MASS)]]
        }
        // Forward the pair makes C - F, backward C + F: the same force, at rest too.
        ("asymmetric_friction", _) if value("viscous_forward") == 0.0 && value("viscous_backward") == 0.0 => {
            let (forward, backward) = (value("force_forward"), value("force_backward"));
            vec![vec![
                other("coulomb_friction", "force", 0.5 * (forward + backward)),
                other("constant_force", "force", 0.5 * (backward - forward)),
            ]]
        }
        _ => Vec::new(),
    }
}

/// Laws of more parameters that are this one where some of them are alike.
pub fn richer_forms(law: &Physics) -> &'static [&'static str] {
    match law.id.as_str() {
        // With the same force at every speed; with the same both ways.
        "coulomb_friction" if law.location == "base" => &["stribeck_friction", "asymmetric_friction"],
        "viscous_friction" => &["asymmetric_friction"],
        _ => &[],
    }
}

/// A drive that is late, and sensors that all are late by as much, record the same; each of them by a delay
/// or by its exposure.
fn all_late(bench: Bench, delay_s: f64) -> Vec<Vec<Physics>> {
    let columns = bench.model().output_columns();
    let late = columns.into_iter().map(|column| {
        let delay = Physics::new("delay", "sensor").with("delay", delay_s);
        Physics { column: Some(column), ..delay }
    });
    put_otherwise(bench, &late.collect::<Vec<Physics>>())
}

/// All sets in which some of the laws are put as their twins; the laws themselves first.
pub fn put_otherwise(bench: Bench, laws: &[Physics]) -> Vec<Vec<Physics>> {
    laws.iter().fold(vec![Vec::new()], |sets, law| {
        let ways: Vec<Vec<Physics>> = std::iter::once(vec![law.clone()]).chain(twins(bench, law)).collect();
        ways.iter().flat_map(|way| sets.iter().map(move |set| [&set[..], way].concat())).collect()
    })
}

macro_rules! case {
    ($bench:ident $id:literal at $location:literal, $s:ident: $($name:literal = $value:expr),+) => {
        Case {
            bench: Bench::$bench,
            id: $id,
            location: $location,
            law: |$s| law($id, $location, &[$(($name, $value)),+]),
            contained: contained($id, $location),
        }
    };
}

/// Every law of the catalogue on the machine on which it shows: linear laws where the model has no parameter,
/// or none that may be refitted, that does what they do.
pub fn cases() -> Vec<Case> {
    vec![
        case!(ForcedBase "coulomb_friction" at "base", s: "force" = 0.3 * s),
        case!(ForcedBase "stribeck_friction" at "base", s: "force" = 0.3 * s, "static_force" = 0.6 * s, "velocity" = 0.02),
        case!(ForcedBase "asymmetric_friction" at "base", s: "force_forward" = 0.4 * s, "force_backward" = 0.2 * s),
        case!(ForcedBase "quadratic_drag" at "base", s: "drag" = 3.0 * s),
        case!(ForcedBase "cogging" at "base", s: "force" = 0.2 * s, "period" = 0.03, "phase" = 0.4),
        case!(ForcedBase "cable_spring" at "base", s: "stiffness" = 5.0 * s),
        case!(ForcedBase "cubic_stiffness" at "base", s: "stiffness" = 200.0 * s),
        case!(ForcedBase "hysteresis" at "base", s: "stiffness" = 30.0 * s, "beta" = 60.0),
        case!(ForcedBase "end_stop" at "base", s: "distance" = 0.12, "stiffness" = 300.0 * s),
        case!(ForcedBase "constant_force" at "base", s: "force" = 0.2 * s),
        case!(FloatingBase "viscous_friction" at "base", s: "damping" = 0.2 * s),
        case!(MovedBase "backlash" at "base", s: "gap" = 5e-5 * s),
        case!(MovedBase "quadratic_drag" at "beam", s: "drag" = 0.02 * s),
        case!(MovedBase "cubic_stiffness" at "beam", s: "stiffness" = 40.0 * s),
        case!(MovedBase "coulomb_friction" at "beam", s: "force" = 0.004 * s),
        case!(MovedBase "hysteresis" at "beam", s: "stiffness" = 0.5 * s, "beta" = 80.0),
        case!(MovedBase "bilinear_stiffness" at "beam", s: "stiffness" = 0.3 * s, "contact" = 0.005),
        case!(MovedBase "amplitude_damping" at "beam", s: "damping" = 20.0 * s),
        case!(MovedBase "extra_mode" at "beam", s: "frequency" = 4.3, "damping_ratio" = 0.02, "participation" = 0.1 * s),
        case!(MeasuredBeam "tip_mass" at "beam", s: "mass" = 1e-3 * s),
        case!(MeasuredBeam "clamp_compliance" at "beam", s: "compliance" = 1e-3 * s),
        case!(ForcedBase "servo_lag" at "drive", s: "time_constant" = 0.004 * s),
        case!(ForcedBase "dead_time" at "drive", s: "delay" = 0.004 * s),
        case!(ForcedBase "saturation" at "drive", s: "limit" = 8.0 / (1.0 + 0.5 * s)),
        case!(ForcedBase "dead_zone" at "drive", s: "threshold" = 0.3 * s),
        case!(ForcedBase "force_ripple" at "drive", s: "ripple" = 0.1 * s, "period" = 0.03, "phase" = 0.4),
        case!(ForcedBase "gain_nonlinearity" at "drive", s: "cubic" = 0.002 * s),
        case!(MovedBase "delay" at "sensor", s: "delay" = 0.004 * s),
        case!(MovedBase "saturation" at "sensor", s: "limit" = 0.025 / (1.0 + 0.5 * s)),
        case!(MovedBase "quantisation" at "sensor", s: "step" = 4e-4 * s),
        case!(MovedBase "nonlinearity" at "sensor", s: "quadratic" = 2.0 * s),
        case!(MovedBase "nonlinearity" at "sensor", s: "cubic" = 100.0 * s),
        case!(MovedBase "crosstalk" at "sensor", s: "share" = 0.1 * s),
        case!(MovedBase "exposure_blur" at "sensor", s: "exposure" = 0.01 * s),
        case!(MovedBase "clock_skew" at "sensor", s: "skew" = 1e-4 * s),
        case!(MovedBase "rectification" at "sensor", s: "share" = 0.1 * s),
        case!(MovedBase "periodic_disturbance" at "environment", s: "force" = 0.002 * s, "frequency" = 3.1, "phase" = 0.7),
        case!(MovedBase "parameter_drift" at "environment", s: "rate" = 1e-4 * s),
    ]
}
