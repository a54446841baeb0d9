//! Laws that a set does not miss.

use rayon::prelude::*;

use super::selection::Search;
use super::sets::Member;

impl Search<'_> {
    /// The set without laws that are not missed; the one that was added last stays.
    pub(super) fn pruned(&self, member: Member) -> Member {
        let added = member.laws.last().copied();
        self.reduced(member, added)
    }

    /// A set that came of the chosen one by a richer law at a place, without what had stood beside the
    /// simpler law to do the rest of the richer one's work: beside dry friction, damping that grows with the
    /// motion does much of what a dip at low speed does.
    pub(super) fn without_what_stood_in(&self, chosen: &Member, richer: Member, place: usize) -> Member {
        if richer.laws.len() < 2 || self.is_over() {
            return richer;
        }
        let reduced = self.reduced(richer.clone(), richer.laws.get(place).copied());
        let is_as_good = self.better_by(&reduced, chosen) < self.options.separation;
        if reduced.laws.len() < richer.laws.len() && is_as_good { reduced } else { richer }
    }

    fn reduced(&self, mut member: Member, kept: Option<usize>) -> Member {
        while member.laws.len() > 1 {
            let places: Vec<usize> =
                (0..member.laws.len()).filter(|&place| kept != Some(member.laws[place])).collect();
            let weakest = places
                .par_iter()
                .filter_map(|&place| {
                    let without = self.without(&member, place)?;
                    Some((self.better_by(&without, &member), without))
                })
                .collect::<Vec<_>>()
                .into_iter()
                .min_by(|a, b| a.0.total_cmp(&b.0));
            match weakest {
                Some((z, without)) if z < self.options.separation => member = without,
                _ => break,
            }
        }
        member
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched};

    fn friction(static_force: f64) -> Physics {
        let law = Physics::new("stribeck_friction", "mass").with("force", 0.6);
        law.with("static_force", static_force).with("velocity", 0.05)
    }

    /// Damping that grows with the motion may stand beside dry friction for the friction's dip.
    #[test]
    fn what_does_the_rest_of_a_dip_beside_dry_friction_is_not_missed_beside_the_dip() {
        let mut truth = machine();
        truth.setup_mut().physics = vec![friction(1.0)];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-4);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let dry = Physics::new("coulomb_friction", "mass").with("force", 0.8);
            let damping = Physics::new("amplitude_damping", "mass").with("damping", 100.0);
            let chosen = fitted_with(search, &fitted_with(search, &refitted, &dry), &damping);
            let open = search.left_open(&chosen);
            let ids = |laws: &[usize]| -> Vec<String> {
                laws.iter().map(|&law| search.candidates[law].law.id().to_owned()).collect()
            };
            let open: Vec<Vec<String>> = open.iter().map(|member| ids(&member.laws)).collect();
            assert!(open.contains(&vec!["stribeck_friction".to_owned()]), "{open:?}");
        });
    }

    #[test]
    fn what_is_there_beside_a_richer_law_stays() {
        let drag = Physics::new("quadratic_drag", "mass").with("drag", 3.0);
        let mut truth = machine();
        truth.setup_mut().physics = vec![friction(1.4), drag.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let both = fitted_with(search, &fitted_with(search, &refitted, &friction(1.3)), &drag);
            assert_eq!(search.pruned(both.clone()).laws, both.laws);
            assert_eq!(search.without_what_stood_in(&both, both.clone(), 0).laws, both.laws);
        });
    }
}
