//! Sets of laws that are one force under two names.
//!
//! Coulomb friction F beside a constant force C, at one place, is friction of F − C against forward and F + C
//! against backward motion. Sliding, both make −F + C forwards and F + C backwards. At rest the first holds
//! against other forces f with |f + C| ≤ F, the second with −(F + C) ≤ f ≤ F − C: the same. So where
//! |C| ≤ F no recording tells them apart, and naming one means the other too.
//!
//! Coulomb friction beside damping that differs with the direction is the same law with its dry part even and
//! its viscous part uneven.

use super::rounds::Tried;
use super::trials::Candidate;
use crate::result::Tie;

/// A law of a set, as far as it matters here.
struct Named<'n> {
    id: &'n str,
    location: &'n str,
    name: String,
    /// Fitted parameters and their values.
    parameters: Vec<(&'n str, f64)>,
}

impl Named<'_> {
    fn value(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(own, _)| *own == name).map(|(_, value)| *value)
    }
}

/// The tie of the chosen laws with what is the same force.
pub(crate) fn same_force(judged: &[Tried], candidates: &[Candidate]) -> Option<Tie> {
    let set: Vec<Named<'_>> = judged
        .iter()
        .map(|tried| {
            let candidate = &candidates[tried.candidate];
            Named {
                id: candidate.law.id(),
                location: &candidate.location,
                name: candidate.name(),
                parameters: tried
                    .parameters
                    .iter()
                    .map(|(name, value, ..)| (name.as_str(), *value))
                    .collect(),
            }
        })
        .collect();
    tie(&set, &|id, location| {
        candidates.iter().any(|candidate| candidate.law.id() == id && candidate.location == location)
    })
}

fn tie(set: &[Named<'_>], is_known: &dyn Fn(&str, &str) -> bool) -> Option<Tie> {
    let (replaced, twins, numbers) =
        as_asymmetric(set).or_else(|| as_uneven(set)).or_else(|| as_even(set))?;
    let location = set[*replaced.first()?].location;
    if !twins.iter().all(|id| is_known(id, location)) {
        return None;
    }
    let names = |laws: &mut dyn Iterator<Item = String>| laws.collect::<Vec<String>>();
    let chosen = names(&mut set.iter().map(|law| law.name.clone()));
    let kept = (0..set.len()).filter(|place| !replaced.contains(place)).map(|place| set[place].name.clone());
    let other = names(&mut kept.chain(twins.iter().map(|id| format!("{id} at {location}"))));
    let sentence = format!(
        "{} is the same force as {} ({numbers}): no recording tells them apart.",
        names(&mut replaced.iter().map(|&place| set[place].name.clone())).join(" with "),
        names(&mut twins.iter().map(|id| format!("{id} at {location}"))).join(" with "),
    );
    Some(Tie { candidates: vec![chosen, other], sentence })
}

/// Places in the set that are replaced, the laws in their place, and their parameters in words.
type Twin = (Vec<usize>, &'static [&'static str], String);

fn as_asymmetric(set: &[Named<'_>]) -> Option<Twin> {
    let even = set.iter().position(|law| law.id == "coulomb_friction")?;
    let at = set[even].location;
    let offset = set.iter().position(|law| law.id == "constant_force" && law.location == at)?;
    let (friction, force) = (set[even].value("force")?, set[offset].value("force")?);
    (force.abs() <= friction).then(|| {
        let numbers =
            format!("force forward {:.4}, force backward {:.4}", friction - force, friction + force);
        (vec![even, offset], &["asymmetric_friction"][..], numbers)
    })
}

fn as_uneven(set: &[Named<'_>]) -> Option<Twin> {
    let even = set.iter().position(|law| law.id == "coulomb_friction")?;
    let at = set[even].location;
    let damper = set.iter().position(|law| law.id == "bilinear_damping" && law.location == at)?;
    let (friction, damping) = (set[even].value("force")?, set[damper].value("damping")?);
    let harder = if damping > 0.0 { "forward" } else { "backward" };
    let numbers = format!("force {friction:.4} both ways, viscous {harder} larger by {:.4}", damping.abs());
    Some((vec![even, damper], &["asymmetric_friction"][..], numbers))
}

fn as_even(set: &[Named<'_>]) -> Option<Twin> {
    let place = set.iter().position(|law| law.id == "asymmetric_friction")?;
    let law = &set[place];
    let is_dry =
        ["viscous_forward", "viscous_backward"].iter().all(|name| law.value(name).unwrap_or(0.0) == 0.0);
    let (forward, backward) = (law.value("force_forward")?, law.value("force_backward")?);
    is_dry.then(|| {
        let (friction, force) = (0.5 * (forward + backward), 0.5 * (backward - forward));
        let numbers = format!("force {friction:.4} with force {force:.4}");
        (vec![place], &["coulomb_friction", "constant_force"][..], numbers)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law<'n>(id: &'n str, location: &'n str, parameters: &[(&'n str, f64)]) -> Named<'n> {
        Named { id, location, name: format!("{id} at {location}"), parameters: parameters.to_vec() }
    }

    fn all(_id: &str, _location: &str) -> bool {
        true
    }

    #[test]
    fn even_friction_with_a_constant_force_is_friction_that_differs_by_direction_and_the_other_way_round() {
        let lag = || law("servo_lag", "drive", &[("time_constant", 0.01)]);
        let even = [
            law("coulomb_friction", "base", &[("force", 20.0)]),
            lag(),
            law("constant_force", "base", &[("force", 3.0)]),
        ];
        let found = tie(&even, &all).expect("a tie");
        assert_eq!(found.candidates[1], ["servo_lag at drive", "asymmetric_friction at base"]);
        assert!(
            found.sentence.contains("force forward 17.0000, force backward 23.0000"),
            "{}",
            found.sentence
        );

        let uneven =
            [law("asymmetric_friction", "base", &[("force_forward", 17.0), ("force_backward", 23.0)])];
        let found = tie(&uneven, &all).expect("a tie");
        assert_eq!(found.candidates[1], ["coulomb_friction at base", "constant_force at base"]);
        assert!(found.sentence.contains("force 20.0000 with force 3.0000"), "{}", found.sentence);
    }

    #[test]
    fn friction_with_damping_that_differs_with_the_direction_is_uneven_friction() {
        let set = |damper: &'static str| {
            [
                law("coulomb_friction", "base", &[("force", 20.0)]),
                law("bilinear_damping", damper, &[("damping", -70.0)]),
            ]
        };
        let found = tie(&set("base"), &all).unwrap();
        assert_eq!(found.candidates[1], ["asymmetric_friction at base"]);
        assert!(found.sentence.contains("viscous backward larger by 70"), "{}", found.sentence);
        assert_eq!(tie(&set("tip"), &all), None, "at another place");
    }

    #[test]
    fn at_two_places_with_viscous_parts_or_a_force_that_friction_cannot_hold_they_are_not_the_same() {
        let friction = || law("coulomb_friction", "base", &[("force", 2.0)]);
        for other in [
            law("constant_force", "load", &[("force", 1.0)]),
            law("constant_force", "base", &[("force", 2.5)]),
            law("quadratic_drag", "base", &[("drag", 1.0)]),
        ] {
            assert_eq!(tie(&[friction(), other], &all), None);
        }
        let viscous = [("force_forward", 1.0), ("force_backward", 2.0), ("viscous_forward", 0.1)];
        assert_eq!(tie(&[law("asymmetric_friction", "base", &viscous)], &all), None);
        let known = |id: &str, _: &str| id != "constant_force";
        let uneven = law("asymmetric_friction", "base", &viscous[..2]);
        assert_eq!(tie(&[uneven], &known), None, "a law that is not looked for is not offered");
    }
}
