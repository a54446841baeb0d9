//! Ties of ties.
//!
//! Where each of two laws is tied with another one, four sets may do the same, and rivals that differ from
//! the chosen set in one law are only three of them: even friction for friction that differs by direction,
//! the sensor's zero being unknown, beside a lag for a dead time that is as long. The fourth may be the
//! truth.

use stillbeam_plant::Physics;

use super::selection::{Search, Selection};
use super::sets::Member;

/// What a rival has instead of one law of the chosen set.
struct Exchange<'r> {
    rival: &'r Member,
    /// The law that it lacks, and the one that it has in its place.
    old: usize,
    new: usize,
}

impl Search<'_> {
    /// Sets in which two laws of the chosen one are exchanged for what each is tied with, where those do as
    /// well and are no rivals yet.
    pub(super) fn both_exchanged(&self, selection: &Selection) -> Vec<Member> {
        let chosen = &selection.chosen;
        let exchanges: Vec<Exchange<'_>> =
            selection.rivals.iter().filter_map(|rival| exchange(&chosen.laws, rival)).collect();
        let pairs = exchanges
            .iter()
            .enumerate()
            .flat_map(|(k, one)| exchanges[k + 1..].iter().map(move |other| (one, other)))
            .filter(|(one, other)| one.old != other.old && one.new != other.new);
        let both = pairs.filter_map(|(one, other)| {
            if self.is_over() {
                return None;
            }
            let place = one.rival.laws.iter().position(|law| *law == other.old)?;
            let mut laws = one.rival.laws.clone();
            laws[place] = other.new;
            if selection.has_rival(&laws) {
                return None;
            }
            let both = self.exchanged(one.rival, place, other.new, self.law_of(other)?)?;
            self.finished_if_close(both, chosen)
        });
        both.collect()
    }

    /// The new law of an exchange as it was fitted.
    fn law_of<'r>(&self, exchange: &Exchange<'r>) -> Option<&'r Physics> {
        let place = exchange.rival.laws.iter().position(|law| *law == exchange.new)?;
        exchange.rival.fitted.hypothesis.model.setup().physics.get(self.given_laws + place)
    }
}

/// `None` of a rival that differs in more than one law or has another number of them.
fn exchange<'r>(chosen: &[usize], rival: &'r Member) -> Option<Exchange<'r>> {
    let only = |these: &[usize], those: &[usize]| {
        let mut own = these.iter().copied().filter(|law| !those.contains(law));
        own.next().filter(|_| own.next().is_none())
    };
    let (old, new) = (only(chosen, &rival.laws)?, only(&rival.laws, chosen)?);
    Some(Exchange { rival, old, new })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::naming::on_a_spring::{fitted_with, machine, noisy_runs, searched};

    #[test]
    fn where_each_of_two_laws_is_tied_the_set_with_both_exchanged_is_too() {
        let friction = Physics::new("asymmetric_friction", "mass")
            .with("force_forward", 0.3)
            .with("force_backward", 0.1);
        let late = Physics::new("dead_time", "drive").with("delay", 0.004);
        let mut truth = machine();
        truth.setup_mut().physics = vec![friction.clone(), late.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let even = Physics::new("coulomb_friction", "mass").with("force", 0.2);
            let delay = Physics::new("delay", "sensor").with("delay", 0.004);
            let set = |one: &Physics, other: &Physics| {
                fitted_with(search, &fitted_with(search, &refitted, one), other)
            };
            let selection = |chosen: &Member, rivals: &[Member]| Selection {
                chosen: chosen.clone(),
                screened: Vec::new(),
                first: None,
                tried: Vec::new(),
                rivals: rivals.to_vec(),
                judged: Vec::new(),
                kept: Vec::new(),
                left_out: Vec::new(),
                explained_share: None,
            };
            let chosen = set(&even, &delay);
            let rivals = [set(&friction, &delay), set(&even, &late)];
            let both = search.both_exchanged(&selection(&chosen, &rivals));
            let ids = |member: &Member| {
                let mut ids: Vec<&str> =
                    member.laws.iter().map(|law| search.candidates[*law].law.id()).collect();
                ids.sort_unstable();
                ids.join(" ")
            };
            let found: Vec<String> = both.iter().map(ids).collect();
            assert_eq!(found, ["asymmetric_friction dead_time"]);
            assert!(search.better_by(&both[0], &chosen) < search.options.separation);
            let known = [&rivals[..], &both[..]].concat();
            assert!(search.both_exchanged(&selection(&chosen, &known)).is_empty(), "it is a rival already");
            assert!(search.both_exchanged(&selection(&chosen, &rivals[..1])).is_empty(), "one tie");
        });
    }
}
