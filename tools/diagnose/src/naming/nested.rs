//! Laws that are others at the end of their range.
//!
//! A law that contains the chosen one always fits as well, and for that alone is no rival: the simpler one is
//! the finding. But a recording may say that what the richer law has more is nothing, or say nothing of it.
//! In the second case half of the name is a guess, and both are published.

use rayon::prelude::*;
use stillbeam_plant::Physics;
use stillbeam_plant::catalogue::{Law, Trial};
use stillbeam_recording::Role;

use super::selection::Search;
use super::sets::Member;
use super::trials::Candidate;
use crate::fit::Fitted;
use crate::intervals::standard_errors;
use crate::parameters::FreeParameter;

/// Dry friction that is the same both ways, and that which need not be.
const EVEN: &str = "coulomb_friction";
const UNEVEN: &str = "asymmetric_friction";
const STEADY: &str = "constant_force";
/// A spring that pulls to where it was laid.
const CABLE: &str = "cable_spring";
/// Dry friction that is larger at low speed.
const DIPPED: &str = "stribeck_friction";
/// Dry friction that gives way a little before it slides.
const MICRO_SLIP: &str = "hysteresis";
/// Forces that may be the same: forwards and backwards, sliding fast and at rest.
const BY_DIRECTION: [&str; 2] = ["force_forward", "force_backward"];
const BY_SPEED: [&str; 2] = ["force", "static_force"];

impl Search<'_> {
    /// Sets in which friction of the chosen set may be richer: differ by direction where the recordings do
    /// not say that it does not, or be larger at low speed where they may.
    pub(crate) fn left_open(&self, chosen: &Member) -> Vec<Member> {
        let places = 0..chosen.laws.len();
        let richer = places.flat_map(|place| {
            let may_be = |richer: &Member, within: f64, names: [&str; 2]| {
                self.is_even(chosen, place)
                    && self.better_by(richer, chosen) < within
                    && self.may_differ(richer, place, names)
            };
            let uneven = self.uneven_instead(chosen, place).filter(|uneven| {
                self.is_likelier(chosen, uneven) || may_be(uneven, self.options.separation, BY_DIRECTION)
            });
            let dipped = self
                .dipped_instead(chosen, place)
                .into_iter()
                .find(|dipped| self.is_likelier(chosen, dipped) || may_be(dipped, INTERVAL, BY_SPEED));
            [uneven, dipped].map(|richer| Some(self.without_what_stood_in(chosen, richer?, place)))
        });
        richer.flatten().collect()
    }

    /// Whether a set with a law that contains one of the chosen set's stands beside it: the recordings rather
    /// have it so, or what the richer law has more is large in a fit that is as good.
    pub(crate) fn is_open_beside(&self, chosen: &Member, richer: &Member) -> bool {
        let differs = || {
            let places = 0..richer.laws.len();
            let mut new = places.filter(|place| !chosen.laws.contains(&richer.laws[*place]));
            new.any(|place| {
                let forces = self.forces(richer, place, BY_DIRECTION);
                forces.is_some_and(|[forward, backward]| {
                    half_difference(forward, backward) > differing(forward, backward)
                })
            })
        };
        self.is_likelier(chosen, richer) || (self.better_by(richer, chosen) < INTERVAL && differs())
    }

    /// The set, with dry friction that differs by direction where that is beyond doubt better.
    pub(crate) fn uneven_if_better(&self, chosen: Member) -> Member {
        let places = (0..chosen.laws.len()).filter(|place| self.is_even(&chosen, *place));
        let mut uneven = places.filter_map(|place| self.uneven_instead(&chosen, place));
        uneven.find(|member| self.is_beyond_doubt(&chosen, member)).unwrap_or(chosen)
    }

    fn is_even(&self, chosen: &Member, place: usize) -> bool {
        self.candidates[chosen.laws[place]].law.id() == EVEN
    }

    /// Whether a richer set is better by what two sets must be apart to be told from each other.
    pub(crate) fn is_beyond_doubt(&self, chosen: &Member, richer: &Member) -> bool {
        self.better_by(chosen, richer) > self.options.separation
    }

    /// Whether the recordings rather have the richer set.
    pub(crate) fn is_likelier(&self, chosen: &Member, richer: &Member) -> bool {
        self.better_by(chosen, richer) > LIKELIER * self.options.separation
    }

    /// The set, with a richer friction replaced by dry friction that is the same at any speed and both ways
    /// where that is as good: the richer one may have found the way to the recordings that the simpler one
    /// missed.
    pub(crate) fn even_if_as_good(&self, chosen: Member) -> Member {
        let places = 0..chosen.laws.len();
        let mut even = places.filter_map(|place| self.even_instead(&chosen, place));
        let as_good = even.find(|member| self.better_by(member, &chosen) < self.options.separation);
        as_good.unwrap_or(chosen)
    }

    /// The set, with two laws at one place that are one law together as that one: even friction and a steady
    /// force that it holds as friction that differs by direction, a cable and a steady force as a cable that
    /// pulls elsewhere. The same force has the same name then, whichever way the search came. (`same_force`
    /// says the other one of friction.)
    pub(crate) fn one_force_as_one_law(&self, chosen: Member) -> Member {
        [Self::uneven_for_both, Self::moved_cable_for_both].iter().fold(chosen, |chosen, for_both| {
            let one = for_both(self, &chosen);
            let as_good = one.filter(|one| self.better_by(one, &chosen) < self.options.separation);
            as_good.unwrap_or(chosen)
        })
    }

    /// -k z beside a steady force F is -k (z - F / k).
    fn moved_cable_for_both(&self, chosen: &Member) -> Option<Member> {
        let place_of = |id: &str, location: Option<&str>| {
            chosen.laws.iter().position(|&index| {
                let candidate = &self.candidates[index];
                candidate.law.id() == id && location.is_none_or(|location| candidate.location == location)
            })
        };
        let cable = place_of(CABLE, None)?;
        let steady = place_of(STEADY, Some(&self.candidates[chosen.laws[cable]].location))?;
        let laws = &chosen.fitted.hypothesis.model.setup().physics;
        let value = |place: usize, name: &str| {
            laws.get(self.given_laws + place).map(|law| law.parameters.get(name).copied().unwrap_or(0.0))
        };
        let rest = value(cable, "rest_position")? + value(steady, "force")? / value(cable, "stiffness")?;
        let moved = laws.get(self.given_laws + cable)?.clone().with("rest_position", rest);
        let alone = self.without(chosen, steady).filter(|_| rest.is_finite())?;
        let place = if steady < cable { cable - 1 } else { cable };
        self.exchanged(&alone, place, chosen.laws[cable], &moved)
    }

    fn uneven_for_both(&self, chosen: &Member) -> Option<Member> {
        let is_at = |index: usize, id: &str, location: &str| {
            let candidate = &self.candidates[index];
            candidate.law.id() == id && candidate.location == location
        };
        let even = (0..chosen.laws.len()).find(|place| self.is_even(chosen, *place))?;
        let location = &self.candidates[chosen.laws[even]].location;
        let steady = chosen.laws.iter().position(|index| is_at(*index, STEADY, location))?;
        let uneven = (0..self.candidates.len()).find(|index| is_at(*index, UNEVEN, location))?;
        let laws = &chosen.fitted.hypothesis.model.setup().physics;
        let force_of = |place: usize| laws.get(self.given_laws + place)?.parameters.get("force").copied();
        let (friction, force) = (force_of(even)?, force_of(steady)?);
        if force.abs() > friction {
            return None;
        }
        let law = uneven_friction(location, [friction - force, friction + force]);
        let alone = self.without(chosen, steady)?;
        self.exchanged(&alone, if steady < even { even - 1 } else { even }, uneven, &law)
    }

    /// Even friction where the law at a place of a set contains it.
    pub(super) fn even_for(&self, chosen: &Member, place: usize) -> Option<usize> {
        let rich = &self.candidates[chosen.laws[place]];
        self.candidates.iter().position(|other| {
            other.law.id() == EVEN && other.location == rich.location && contains(rich.law, other.law)
        })
    }

    /// The set with the friction at a place of it even, begun from the force with which it slides.
    pub(super) fn even_instead(&self, chosen: &Member, place: usize) -> Option<Member> {
        let rich = &self.candidates[chosen.laws[place]];
        let even = self.even_for(chosen, place)?;
        let law = chosen.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        let even_law = Physics::new(EVEN, rich.location.clone()).with("force", sliding_force(law)?);
        self.exchanged(chosen, place, even, &even_law)
    }

    /// The set with the friction at a place of it begun as even and free to differ: begun from nothing, a law
    /// with two forces often stops on its way.
    fn uneven_instead(&self, chosen: &Member, place: usize) -> Option<Member> {
        let even = &self.candidates[chosen.laws[place]];
        let is_there = |index: usize, id: &str| {
            let other = &self.candidates[index];
            other.law.id() == id && other.location == even.location
        };
        let uneven = (0..self.candidates.len()).find(|&index| is_there(index, UNEVEN))?;
        let steady = even.law.id() == STEADY;
        // Even friction with a steady force is uneven friction already: see `same_force`.
        let other_half = if steady { EVEN } else { STEADY };
        let differs = chosen.laws.iter().any(|&index| index == uneven || is_there(index, other_half));
        if (even.law.id() != EVEN && !steady) || differs {
            return None;
        }
        let laws = &chosen.fitted.hypothesis.model.setup().physics;
        let force = *laws.get(self.given_laws + place)?.parameters.get("force")?;
        // A steady force is half the difference of friction that acts mostly one way.
        let [forward, backward] =
            if steady { [MOSTLY * force.abs() - force, MOSTLY * force.abs() + force] } else { [force; 2] };
        self.exchanged(chosen, place, uneven, &uneven_friction(&even.location, [forward, backward]))
    }

    /// The set with the dry friction at a place of it larger at low speed, begun at several speeds, the best
    /// first: a dip so narrow that only what it was fitted to knows it may come before the right one.
    fn dipped_instead(&self, chosen: &Member, place: usize) -> Vec<Member> {
        let even = &self.candidates[chosen.laws[place]];
        let laws = &chosen.fitted.hypothesis.model.setup().physics;
        let law = laws.get(self.given_laws + place).filter(|law| law.id == EVEN && !self.is_over());
        let force = law.and_then(|law| law.parameters.get("force").copied());
        let is_there = |other: &Candidate| other.law.id() == DIPPED && other.location == even.location;
        let (Some(force), Some(dipped)) = (force, self.candidates.iter().position(is_there)) else {
            return Vec::new();
        };
        let speed_of = |trial: &Trial| {
            trial.shapes.iter().find(|(name, _)| *name == "velocity").map(|(_, speed)| *speed)
        };
        let mut speeds: Vec<f64> = self.candidates[dipped].trials.iter().filter_map(speed_of).collect();
        // A dip as wide as most of the motion is a law of its own only beside a friction that is there.
        speeds.extend(speeds.iter().copied().reduce(f64::max).map(|fastest| WIDER * fastest));
        let begun = speeds.into_par_iter().filter_map(|speed| {
            let [sliding, breaking_away] = DIP.map(|share| share * force);
            let dip = Physics::new(DIPPED, even.location.clone())
                .with("force", sliding)
                .with("static_force", breaking_away)
                .with("velocity", speed);
            self.exchanged(chosen, place, dipped, &dip)
        });
        let mut begun: Vec<Member> = begun.collect();
        begun.sort_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares));
        begun
    }

    fn forces(&self, member: &Member, place: usize, names: [&str; 2]) -> Option<[f64; 2]> {
        let law = member.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)?;
        let [one, other] = names.map(|name| law.parameters.get(name).copied());
        Some([one?, other?])
    }

    /// Whether two forces of the law at a place may be different.
    fn may_differ(&self, member: &Member, place: usize, names: [&str; 2]) -> bool {
        match self.known_forces(member, place, names) {
            // Dry friction that holds with less than it slides with is dry friction of one force.
            Some([(sliding, _), (holding, _)]) if names == BY_SPEED && holding <= sliding => false,
            Some([one, other]) => may_differ(one, other),
            None => false,
        }
    }

    /// Whether a set has friction by direction of which the recordings show the sum of its forces and not
    /// their difference: on a spring and to a sensor with an unknown zero, however it is shared out.
    pub(crate) fn has_friction_known_as_a_sum(&self, member: &Member) -> bool {
        let places = (0..member.laws.len()).filter(|&place| {
            let candidate = &self.candidates[member.laws[place]];
            candidate.law.id() == UNEVEN
        });
        let forces = |place| self.known_forces(member, place, BY_DIRECTION);
        places.filter_map(forces).any(|[one, other]| is_known_as_a_sum(one, other))
    }

    /// Two forces of the law at a place and their standard errors, all shapes of the law as they are: at the
    /// speed that its dip has, say.
    fn known_forces(&self, member: &Member, place: usize, names: [&str; 2]) -> Option<[(f64, f64); 2]> {
        let own = format!("physics.{}.", self.given_laws + place + 1);
        let is_shape = |parameter: &FreeParameter| {
            parameter.path.strip_prefix(&own).is_some_and(|name| !names.contains(&name))
        };
        let rows = member.fitted.free.iter().zip(&member.fitted.values);
        let (free, values): (Vec<FreeParameter>, Vec<f64>) = rows
            .filter(|(parameter, _)| !is_shape(parameter))
            .map(|(parameter, value)| (parameter.clone(), *value))
            .unzip();
        let fitted = Fitted { free, values, ..member.fitted.clone() };
        let errors = standard_errors(&self.study.stack(Role::Train), &fitted, self.study.slowest_hz);
        let [one, other] = names.map(|name| {
            let index = fitted.free.iter().position(|free| free.path.strip_prefix(&own) == Some(name))?;
            Some((fitted.values[index], errors[index]))
        });
        Some([one?, other?])
    }
}

/// Dry friction with these forces against forward and against backward motion.
fn uneven_friction(location: &str, [forward, backward]: [f64; 2]) -> Physics {
    Physics::new(UNEVEN, location)
        .with("force_forward", forward)
        .with("force_backward", backward)
        .with("viscous_forward", 0.0)
        .with("viscous_backward", 0.0)
}

/// The force that a law which contains dry friction comes to while a body slides.
fn sliding_force(law: &Physics) -> Option<f64> {
    let value = |name: &str| law.parameters.get(name).copied();
    let force = if law.id == MICRO_SLIP {
        // dF/dz = k − (β + γ) F has an end.
        value("stiffness")? / (value("beta")? + value("gamma").unwrap_or(0.0))
    } else {
        // Forces that the richer law has at different speeds or in different directions.
        let forces = ["force", "static_force", "force_forward", "force_backward"];
        let forces: Vec<f64> = forces.into_iter().filter_map(value).collect();
        forces.iter().sum::<f64>() / forces.len() as f64
    };
    (force.is_finite() && force > 0.0).then_some(force)
}

/// Whether one law is another at the end of its range.
pub(crate) fn contains(rich: &dyn Law, simple: &dyn Law) -> bool {
    simple.richer().contains(&rich.id())
}

/// Friction that differs by direction by more than this share of its mean, either way, is not the same both
/// ways.
const SAME_BOTH_WAYS: f64 = 0.2;
/// Share of the separation from which a richer law is published beside the one that it contains. Chosen on
/// cases whose truth is dry friction or a steady force, where richer laws that are not there were better by
/// up to 0.36 of it; it does not catch all that are there: see docs/derivations/diagnosis.md.
const LIKELIER: f64 = 0.5;
/// Mean of friction that a steady force may be part of, in steady forces.
const MOSTLY: f64 = 1.5;
/// Sliding and static friction that dry friction is begun with where it may be larger at low speed, in times
/// its force.
const DIP: [f64; 2] = [0.7, 1.3];
/// The widest dip that dry friction is begun with, in times the widest that is tried from nothing.
const WIDER: f64 = 3.0;
/// Standard errors to either side that an interval has.
const INTERVAL: f64 = 2.0;

/// Whether the recordings leave open that dry friction differs by direction, from both forces and their
/// standard errors. Where they are known as a sum only they may be anything between one-sided and even: to a
/// sensor whose zero is unknown the difference is an offset while the body slides.
fn may_differ((forward, forward_error): (f64, f64), (backward, backward_error): (f64, f64)) -> bool {
    // Where the sum is known well, either force is as uncertain as half the difference.
    half_difference(forward, backward) + INTERVAL * forward_error.min(backward_error)
        > differing(forward, backward)
}

/// Whether neither force is known to be there, though their sum is: all of it may act one way.
fn is_known_as_a_sum((forward, forward_error): (f64, f64), (backward, backward_error): (f64, f64)) -> bool {
    INTERVAL * forward_error.min(backward_error) > 0.5 * (forward + backward)
}

fn half_difference(forward: f64, backward: f64) -> f64 {
    0.5 * (forward - backward).abs()
}

/// Half the difference of two forces from which they count as different.
fn differing(forward: f64, backward: f64) -> f64 {
    SAME_BOTH_WAYS * 0.5 * (forward + backward)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Others;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched, searched_around, unheld};

    #[test]
    fn a_difference_of_direction_is_open_until_its_interval_is_narrow_about_nothing() {
        assert!(may_differ((1.9, 0.3), (0.1, 0.3)), "known as a sum only");
        assert!(may_differ((1.0, 0.15), (1.0, 0.15)), "even, but not known to be");
        assert!(!may_differ((1.02, 0.03), (0.98, 0.03)), "known to be even");
        assert!(is_known_as_a_sum((0.11, 0.085), (0.0, 0.085)), "case 198 of seed 21");
        assert!(!is_known_as_a_sum((2.0, 0.1), (0.0, 0.1)), "one-sided for certain");
        assert!(!is_known_as_a_sum((1.0, 0.3), (1.0, 0.3)));
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
        let (id, force) = force_of(dry(1.0));
        assert_eq!(id, "coulomb_friction");
        assert!((force - 1.0).abs() < 0.01, "{force} N");
        let dip = Physics::new("stribeck_friction", "mass")
            .with("force", 0.6)
            .with("static_force", 1.4)
            .with("velocity", 0.05);
        assert_eq!(force_of(dip).0, "stribeck_friction", "a dip that is there stays");
    }

    #[test]
    fn micro_slip_that_is_not_there_is_dry_friction() {
        let slip = |stiffness: f64, force: f64| {
            let law = Physics::new("hysteresis", "mass").with("stiffness", stiffness);
            law.with("beta", stiffness / force).with("gamma", 0.0)
        };
        let even = |truth: Physics, begun: &Physics| {
            let mut machine_as_it_is = machine();
            machine_as_it_is.setup_mut().physics = vec![truth];
            let noisy = |amplitudes: &[f64]| noisy_runs(&machine_as_it_is, amplitudes, 1e-5);
            searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
                let chosen = search.even_if_as_good(fitted_with(search, &refitted, begun));
                chosen.fitted.hypothesis.model.setup().physics[0].clone()
            })
        };
        let law = even(dry(1.0), &slip(2e4, 1.1));
        assert_eq!(law.id, "coulomb_friction");
        assert!((law.parameters["force"] - 1.0).abs() < 0.01, "{law:?}");
        assert_eq!(even(slip(300.0, 1.0), &slip(250.0, 1.1)).id, "hysteresis", "slip that is there stays");
    }

    #[test]
    fn laws_that_contain_dry_friction_say_with_which_force_a_body_slides() {
        let slip = Physics::new("hysteresis", "mass").with("stiffness", 6e3).with("beta", 1e3);
        assert_eq!(sliding_force(&slip), Some(6.0));
        assert_eq!(sliding_force(&slip.with("gamma", 1e3)), Some(3.0));
        assert_eq!(sliding_force(&dip(1.0, 2.0)), Some(1.5));
        assert_eq!(sliding_force(&Physics::new("hysteresis", "mass").with("stiffness", 6e3)), None);
        assert_eq!(sliding_force(&Physics::new("cogging", "mass")), None, "nothing slides");
    }

    /// What is beyond doubt instead of a law fitted to runs of a machine, or the law itself, and all that is
    /// left open beside it.
    fn taken_for(truth: Physics, named: &Physics, noise: f64) -> (String, Vec<String>) {
        let mut machine_as_it_is = machine();
        machine_as_it_is.setup_mut().physics = vec![truth];
        let noisy = |amplitudes: &[f64]| noisy_runs(&machine_as_it_is, amplitudes, noise);
        let (train, held_out) = (noisy(&[3.0, 9.0]), noisy(&[5.0]));
        searched(&train, &held_out, |search, refitted| {
            let law = search.candidates.iter().position(|c| c.law.id() == named.id).unwrap();
            let amplitudes = search.candidates[law].amplitude_names();
            let begun = search.extended(&refitted, law, named, 1, &amplitudes, Others::Searched).unwrap();
            let chosen = search.finished(search.member(vec![law], begun).unwrap());
            let id = |member: &Member| member.fitted.hypothesis.model.setup().physics[0].id.clone();
            let open = search.left_open(&chosen);
            let named = open.iter().find(|richer| search.is_beyond_doubt(&chosen, richer));
            (id(named.unwrap_or(&chosen)), open.iter().map(id).collect())
        })
    }

    fn dry(force: f64) -> Physics {
        Physics::new("coulomb_friction", "mass").with("force", force)
    }

    fn dip(force: f64, static_force: f64) -> Physics {
        let with_force = Physics::new("stribeck_friction", "mass").with("force", force);
        with_force.with("static_force", static_force).with("velocity", 0.05)
    }

    #[test]
    fn dry_friction_that_has_a_dip_is_named_so_where_it_shows_and_left_open_where_it_may() {
        let (named, open) = taken_for(dip(0.6, 1.4), &dry(0.9), 1e-5);
        assert_eq!((named.as_str(), open.contains(&named)), ("stribeck_friction", true));
        let (named, open) = taken_for(dip(0.8, 1.2), &dry(0.9), 3e-2);
        assert_eq!(named, "coulomb_friction", "buried in noise");
        assert!(open.iter().any(|id| id == "stribeck_friction"), "{open:?}");
        let (named, open) = taken_for(dry(1.0), &dry(0.9), 1e-5);
        assert_eq!(named, "coulomb_friction");
        assert!(!open.iter().any(|id| id == "stribeck_friction"), "there is none: {open:?}");
    }

    #[test]
    fn a_steady_force_that_is_half_of_a_friction_by_direction_is_named_so() {
        let truth = Physics::new("asymmetric_friction", "mass")
            .with("force_forward", 0.4)
            .with("force_backward", 1.2);
        let steady = Physics::new("constant_force", "mass").with("force", 0.4);
        assert_eq!(taken_for(truth, &steady, 1e-5).0, "asymmetric_friction");
    }

    #[test]
    fn even_friction_with_a_steady_force_that_it_holds_is_named_as_one_law() {
        let (even, steady) = (dry(1.0), Physics::new("constant_force", "mass").with("force", 0.4));
        let mut truth = machine();
        truth.setup_mut().physics = vec![even.clone(), steady.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let with = |member: &Member, law: &Physics| {
                let index = search.candidates.iter().position(|c| c.law.id() == law.id).unwrap();
                let (number, names) = (member.laws.len() + 1, search.candidates[index].amplitude_names());
                let fitted = search.extended(member, index, law, number, &names, Others::Searched).unwrap();
                search.member([member.laws.clone(), vec![index]].concat(), fitted).unwrap()
            };
            let first = with(&refitted, &even);
            let both = search.finished(with(&first, &steady));
            let one = search.one_force_as_one_law(both);
            let laws = &one.fitted.hypothesis.model.setup().physics;
            assert_eq!(laws.iter().map(|law| law.id.as_str()).collect::<Vec<_>>(), ["asymmetric_friction"]);
            let [forward, backward] = search.forces(&one, 0, BY_DIRECTION).unwrap();
            // On a spring their difference hardly shows.
            assert!((0.5 * (forward + backward) - 1.0).abs() < 0.01, "{forward} {backward}");
            assert!((backward - forward - 0.8).abs() < 0.1, "{forward} {backward}");
        });
    }

    /// A cable that was laid elsewhere than where the recordings begin.
    #[test]
    fn a_cable_beside_a_steady_force_is_a_cable_that_pulls_elsewhere() {
        let cable = Physics::new("cable_spring", "mass").with("stiffness", 40.0);
        let mut truth = unheld();
        truth.setup_mut().physics = vec![cable.clone().with("rest_position", 0.02)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched_around(&unheld(), &noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let steady = Physics::new("constant_force", "mass").with("force", 0.5);
            let both = fitted_with(search, &fitted_with(search, &refitted, &cable), &steady);
            let one = search.one_force_as_one_law(both);
            let laws = &one.fitted.hypothesis.model.setup().physics;
            assert_eq!(laws.iter().map(|law| law.id.as_str()).collect::<Vec<_>>(), ["cable_spring"]);
            let found = ["stiffness", "rest_position"].map(|name| laws[0].parameters[name]);
            assert!((found[0] / 40.0 - 1.0).abs() < 1e-3 && (found[1] - 0.02).abs() < 1e-4, "{found:?}");
        });
    }

    #[test]
    fn friction_far_from_even_that_fits_as_well_is_open_beside_even_friction() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![dry(1.0)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-2);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let fitted = |law: &Physics| {
                let index = search.candidates.iter().position(|c| c.law.id() == law.id).unwrap();
                let amplitudes = search.candidates[index].amplitude_names();
                let begun = search.extended(&refitted, index, law, 1, &amplitudes, Others::Searched).unwrap();
                search.member(vec![index], begun).unwrap()
            };
            let even = search.finished(fitted(&dry(0.9)));
            let uneven = |forward: f64, backward: f64| {
                let law = Physics::new("asymmetric_friction", "mass");
                fitted(&law.with("force_forward", forward).with("force_backward", backward))
            };
            let (apart, alike) = (uneven(1.5, 0.5), uneven(1.0, 1.0));
            assert!(search.is_open_beside(&even, &apart));
            assert!(!search.is_open_beside(&even, &alike));
        });
    }
}
