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

    /// The set, with a richer friction replaced by dry friction that is the same at any speed and both ways where that is as good: the
    /// richer one may have found the way to the recordings that the simpler one missed.
    pub(crate) fn even_if_as_good(&self, chosen: Member) -> Member {
        let places = 0..chosen.laws.len();
        let mut even = places.filter_map(|place| self.even_instead(&chosen, place));
        let as_good = even.find(|member| self.better_by(member, &chosen) < self.options.separation);
        as_good.unwrap_or(chosen)
    }

    fn even_instead(&self, chosen: &Member, place: usize) -> Option<Member> {
        let rich = &self.candidates[chosen.laws[place]];
        let even = self.candidates.iter().position(|other| {
            other.law.id() == EVEN && other.location == rich.location && contains(rich.law.id(), EVEN)
        })?;
        let law = chosen.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        // Forces that the richer law has at different speeds or in different directions.
        let forces = ["force", "static_force", "force_forward", "force_backward"];
        let forces: Vec<f64> = forces.iter().filter_map(|name| law.parameters.get(*name).copied()).collect();
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        let even_law = Physics::new(EVEN, rich.location.clone()).with("force", mean);
        if mean.is_finite() { self.exchanged(chosen, place, even, &even_law) } else { None }
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
    use crate::fit::Others;
    use crate::naming::on_a_spring::{machine, noisy_runs, searched};

    #[test]
    fn a_difference_of_direction_is_open_until_its_interval_is_narrow_about_nothing() {
        assert!(may_differ((1.9, 0.3), (0.1, 0.3)), "known as a sum only");
        assert!(may_differ((1.0, 0.15), (1.0, 0.15)), "even, but not known to be");
        assert!(!may_differ((1.02, 0.03), (0.98, 0.03)), "known to be even");
    }

    #[test]
    fn friction_with_a_dip_that_is_not_there_is_dry_friction() {
        let force_of = |truth: Physics| {
            let mut machine_as_it_is = machine();
            machine_as_it_is.setup_mut().physics = vec![truth];
            let noisy = |amplitudes: &[f64]| noisy_runs(&machine_as_it_is, amplitudes, 1e-5);
            searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
                let dip = search.candidates.iter().position(|c| c.law.id() == "stribeck_friction").unwrap();
                let start = Physics::new("stribeck_friction", "mass")
                    .with("force", 0.9)
                    .with("static_force", 1.2)
                    .with("velocity", 0.05);
                let amplitudes = search.candidates[dip].amplitude_names();
                let begun =
                    search.extended(&refitted, dip, &start, 1, &amplitudes, Others::Searched).unwrap();
                let with_dip = search.finished(search.member(vec![dip], begun).unwrap());
                let chosen = search.even_if_as_good(with_dip);
                let law = chosen.fitted.hypothesis.model.setup().physics[0].clone();
                (law.id.clone(), law.parameters["force"])
            })
        };
        let (id, force) = force_of(Physics::new("coulomb_friction", "mass").with("force", 1.0));
        assert_eq!(id, "coulomb_friction");
        assert!((force - 1.0).abs() < 0.01, "{force} N");
        let dip = Physics::new("stribeck_friction", "mass")
            .with("force", 0.6)
            .with("static_force", 1.4)
            .with("velocity", 0.05);
        assert_eq!(force_of(dip).0, "stribeck_friction", "a dip that is there stays");
    }
}
