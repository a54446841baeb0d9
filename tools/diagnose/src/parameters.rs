//! The given model's own parameters, in the coordinates of the search.

use stillbeam_identify::levenberg_marquardt::Parameter;
use stillbeam_plant::Model;

use crate::simulation::Hypothesis;

/// What comes from a drawing, a balance or a calliper is known at least to this factor.
const MEASURED_WITHIN: f64 = 1.15;
/// Damping, losses and what a drive does are known at least to this factor.
const GUESSED_WITHIN: f64 = 2.0;

/// One parameter that a refit may move.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FreeParameter {
    /// Its path in the model file.
    pub(crate) path: String,
    /// Value in the given model.
    pub(crate) given: f64,
    /// Searched as a logarithm: a positive quantity of unknown magnitude.
    pub(crate) logarithmic: bool,
    /// Bounds of the value.
    pub(crate) lower: f64,
    pub(crate) upper: f64,
    /// Whether it belongs to a law that the diagnosis added; the laws that the model was given with are its
    /// own.
    pub(crate) is_added: bool,
}

impl FreeParameter {
    pub(crate) fn to_search(&self, value: f64) -> f64 {
        if self.logarithmic { value.max(1e-300).ln() } else { value / self.scale() }
    }

    pub(crate) fn to_value(&self, search: f64) -> f64 {
        if self.logarithmic { search.exp() } else { search * self.scale() }
    }

    /// A step for differences at a search coordinate.
    pub(crate) fn difference(&self, search: f64, relative: f64) -> f64 {
        if self.logarithmic { relative } else { relative * search.abs().max(1.0) }
    }

    /// Derivative of the value with respect to the search coordinate.
    pub(crate) fn slope(&self, search: f64) -> f64 {
        if self.logarithmic { search.exp() } else { self.scale() }
    }

    fn scale(&self) -> f64 {
        if self.given == 0.0 { 1.0 } else { self.given.abs() }
    }

    pub(crate) fn as_search(&self, value: f64) -> Parameter {
        Parameter {
            start: self.to_search(value),
            lower: self.to_search(self.lower),
            upper: self.to_search(self.upper),
            max_step: 0.3,
        }
    }

    /// The factor within which its given value may be taken to be right.
    pub(crate) fn known_within(&self) -> f64 {
        let is_guess = ["damp", "viscous", "rayleigh", "participation", "gain", "compliance", "physics."]
            .iter()
            .any(|word| self.path.contains(word))
            || self.path.starts_with("drive");
        if is_guess { GUESSED_WITHIN } else { MEASURED_WITHIN }
    }

    /// Whether the parameter sets how fast the structure vibrates, so that a wrong start may end in a wrong
    /// valley.
    pub(crate) fn sets_frequency(&self) -> bool {
        ["frequency_hz", "young_Pa", "stiffness"].iter().any(|name| self.path.ends_with(name))
    }
}

/// The parameters that a refit may move, in the order in which they are tried: first those that recordings of
/// vibration usually determine, last those that mostly repeat them. Of parameters that repeat each other
/// those stay as given that a balance or a calliper tells: a body that is let go has a frequency and a decay,
/// and its damping is a better guess from those than its mass.
pub(crate) fn free_parameters(hypothesis: &Hypothesis) -> Vec<FreeParameter> {
    let model = &hypothesis.model;
    let mut listed: Vec<(usize, FreeParameter)> = model
        .parameters()
        .into_iter()
        .filter(|parameter| !parameter.fixed && may_be_refitted(&parameter.path, hypothesis.own_laws))
        .filter_map(|parameter| {
            let order = order_of(model, &parameter.path)?;
            // A stiffness or damping of zero is a statement: that there is none.
            let absent = (parameter.value == 0.0 || !parameter.value.is_finite())
                && !parameter.path.ends_with("damping_ratio");
            (!absent || parameter.path.contains("participation")).then(|| (order, free(&parameter)))
        })
        .collect();
    listed.sort_by_key(|(order, _)| *order);
    listed.into_iter().map(|(_, parameter)| parameter).collect()
}

/// Whether a path is not one of a law: or one of the model's own laws, and moves what is simulated smoothly.
fn may_be_refitted(path: &str, own_laws: usize) -> bool {
    let Some(law) = path.strip_prefix("physics.") else { return true };
    law.split_once('.').is_some_and(|(number, name)| {
        number.parse::<usize>().is_ok_and(|number| number <= own_laws) && !AS_GIVEN.contains(&name)
    })
}

/// Parameters of laws that stay as they are: what the others already determine, or what only jumps.
pub(crate) const AS_GIVEN: [&str; 4] = ["rest_position", "step", "viscous_forward", "viscous_backward"];

fn free(parameter: &stillbeam_plant::Parameter) -> FreeParameter {
    let is_ratio = parameter.path.contains("damping_ratio") && !parameter.path.starts_with("drive");
    let given = if is_ratio { parameter.value.max(1e-5) } else { parameter.value };
    let logarithmic = given > 0.0 && parameter.lower >= 0.0;
    let (lower, upper) = if logarithmic {
        (parameter.lower.max(given * 1e-4), parameter.upper.min(given * 1e4))
    } else {
        (parameter.lower, parameter.upper)
    };
    FreeParameter { path: parameter.path.clone(), given, logarithmic, lower, upper, is_added: false }
}

/// Place in the order of trial; `None` for what a refit leaves alone.
fn order_of(model: &Model, path: &str) -> Option<usize> {
    const ORDER: [&str; 20] = [
        "mode.",
        "beam.young_Pa",
        "beam.damping_ratio",
        "beam.rayleigh",
        "beam.tip_mass_kg",
        "beam.clamp_stiffness_N_m_rad",
        "base.mass_kg",
        "base.viscous_N_s_m",
        "drive.",
        "spring.",
        "damper.",
        "body.",
        "beam.thickness_m",
        "beam.width_m",
        "beam.second_moment_m4",
        "beam.area_m2",
        "beam.density_kg_m3",
        "input.gain",
        "beam.length_m",
        "",
    ];
    // A lumped model under a known force: its gain repeats all masses, springs and dampers together.
    if path == "input.gain" && !matches!(model, Model::Modal(_)) {
        return None;
    }
    if path == "beam.length_m" {
        return None;
    }
    ORDER.iter().position(|start| path.starts_with(start))
}
