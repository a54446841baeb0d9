//! Laws that are others at the end of their range.
//!
//! A law that contains the chosen one always fits as well, and for that alone is no rival: the simpler one is the finding. But a
//! recording may say that what the richer law has more is nothing, or say nothing of it. In the second case half
//! of the name is a guess, and both are published.

use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use crate::intervals::standard_errors;

/// Dry friction that is the same both ways, and that which need not be.
const EVEN: &str = "coulomb_friction";
const UNEVEN: &str = "asymmetric_friction";
const STEADY: &str = "constant_force";

impl Search<'_> {
    /// Sets in which dry friction of the chosen set may differ by direction, where the recordings do not say that it does not.
    pub(crate) fn left_open(&self, chosen: &Member) -> Vec<Member> {
        let places = 0..chosen.laws.len();
        let uneven = places.filter_map(|place| Some((place, self.uneven_instead(chosen, place)?)));
        let as_good = uneven.filter(|(_, member)| self.better_by(member, chosen) < self.options.separation);
        as_good.filter(|(place, member)| self.may_differ(member, *place)).map(|(_, member)| member).collect()
    }

    /// The set, with dry friction that differs by direction where that is beyond doubt better.
    pub(crate) fn uneven_if_better(&self, chosen: Member) -> Member {
        let places = 0..chosen.laws.len();
        let mut uneven = places.filter_map(|place| self.uneven_instead(&chosen, place));
        let better = uneven.find(|member| self.better_by(&chosen, member) > self.options.separation);
        better.unwrap_or(chosen)
    }

    /// The set with the friction at a place of it begun as even and free to differ: begun from nothing, a law with two forces often stops
    /// on its way.
    fn uneven_instead(&self, chosen: &Member, place: usize) -> Option<Member> {
        let even = &self.candidates[chosen.laws[place]];
        let is_there = |index: usize, id: &str| {
            let other = &self.candidates[index];
            other.law.id() == id && other.location == even.location
        };
        let uneven = (0..self.candidates.len()).find(|&index| is_there(index, UNEVEN))?;
        // Even friction with a steady force is uneven friction already: see `same_force`.
        let differs = chosen.laws.iter().any(|&index| index == uneven || is_there(index, STEADY));
        if even.law.id() != EVEN || differs {
            return None;
        }
        let laws = &chosen.fitted.hypothesis.model.setup().physics;
        let force = *laws.get(self.given_laws + place)?.parameters.get("force")?;
        let both_ways = Physics::new(UNEVEN, even.location.clone())
            .with("force_forward", force)
            .with("force_backward", force)
            .with("viscous_forward", 0.0)
            .with("viscous_backward", 0.0);
        self.exchanged(chosen, place, uneven, &both_ways)
    }

    fn may_differ(&self, member: &Member, place: usize) -> bool {
        let fitted = &member.fitted;
        let errors = standard_errors(&self.study.stack(Role::Train), fitted, self.study.slowest_hz);
        let found = |name: &str| {
            let path = format!("physics.{}.{name}", self.given_laws + place + 1);
            let index = fitted.free.iter().position(|free| free.path == path)?;
            Some((fitted.values[index], errors[index]))
        };
        match (found("force_forward"), found("force_backward")) {
            (Some(forward), Some(backward)) => may_differ(forward, backward),
            _ => false,
        }
    }
}

/// Whether one law is another at the end of its range.
pub(crate) fn contains(rich: &str, simple: &str) -> bool {
    match simple {
        "coulomb_friction" => ["stribeck_friction", "asymmetric_friction", "hysteresis"].contains(&rich),
        "constant_force" => ["asymmetric_friction", "cogging"].contains(&rich),
        "cable_spring" => ["hysteresis", "cogging", "bilinear_stiffness"].contains(&rich),
        _ => false,
    }
}

/// Friction that differs by direction by more than this share of its mean, either way, is not the same both ways.
const SAME_BOTH_WAYS: f64 = 0.2;
/// Standard errors to either side that an interval has.
const INTERVAL: f64 = 2.0;

/// Whether the recordings leave open that dry friction differs by direction, from both forces and their standard errors. Where they are
/// known as a sum only they may be anything between one-sided and even: to a sensor whose zero is unknown the difference is an
/// offset while the body slides.
fn may_differ((forward, forward_error): (f64, f64), (backward, backward_error): (f64, f64)) -> bool {
    let (mean, half_difference) = (0.5 * (forward + backward), 0.5 * (forward - backward).abs());
    // Where the sum is known well, either force is as uncertain as half the difference.
    half_difference + INTERVAL * forward_error.min(backward_error) > SAME_BOTH_WAYS * mean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_of_direction_is_open_until_its_interval_is_narrow_about_nothing() {
        assert!(may_differ((1.9, 0.3), (0.1, 0.3)), "known as a sum only");
        assert!(may_differ((1.0, 0.15), (1.0, 0.15)), "even, but not known to be");
        assert!(!may_differ((1.02, 0.03), (0.98, 0.03)), "known to be even");
    }
}
