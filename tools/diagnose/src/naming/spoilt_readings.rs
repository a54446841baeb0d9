//! Laws of sensors that do so much that no linear machine comes near what is read.
//!
//! No guide shows them: readings that a sensor has spoilt are no motion that a machine could be held to. But
//! each acts on its own reading alone. So they are looked for beside the model as given, reading by reading,
//! and fitted all at once: beside one reading that stays spoilt the others would bend the machine.

use rayon::prelude::*;
use stillbeam_plant::Physics;
use stillbeam_recording::Role;

use super::gross_laws::{NEARER, squares};
use super::selection::Search;
use super::sets::{Member, law_parameters};
use crate::effort::Effort;
use crate::fit::{Fitted, fit};

/// Where laws of what is read have their place.
const SENSOR: &str = "sensor";
/// Laws of sensors are what is missing where they leave no more than this share of any output, root mean
/// square.
const HARDLY_LEFT: f64 = 0.2;

impl Search<'_> {
    /// The laws of sensors that explain most of what is read and what the refit is out of phase with; `None`
    /// where there are none.
    pub(super) fn spoilt_readings(&self, refitted: &Member) -> Option<Member> {
        let is_driven = self.study.train.iter().all(|record| record.input.is_some());
        if !is_driven || !self.is_out_of_phase(refitted) {
            return None;
        }
        let mut member = self.as_drawn()?;
        let outputs = self.study.weights.len().max(1) as f64;
        while let Some((left, law, physics)) = self.nearest_at_a_sensor(&member) {
            // Every output may have a part of what is left, and a law acts on its own.
            if left > (1.0 - (1.0 - NEARER) / outputs) * member.fitted.sum_of_squares {
                break;
            }
            member = self.put_beside(&member, law, &physics)?;
        }
        if member.laws.is_empty() {
            return None;
        }
        let Fitted { hypothesis, free, values, .. } = &member.fitted;
        let states = member.fitted.initial_states();
        let fitted = fit(&self.study.stack(Role::Train), hypothesis, free, values, &states, Effort::BENT)?;
        let found = self.member(member.laws, fitted)?;
        (self.study.most_left(&found.on_all()) < HARDLY_LEFT).then_some(found)
    }

    /// The law at a sensor without one that leaves least, and what it leaves.
    fn nearest_at_a_sensor(&self, member: &Member) -> Option<(f64, usize, Physics)> {
        let column = |law: usize| self.candidates[law].column.as_ref();
        let is_free = |law: &usize| {
            self.candidates[*law].location == SENSOR
                && member.laws.iter().all(|&taken| column(taken) != column(*law))
        };
        let laws = (0..self.candidates.len()).into_par_iter().filter(is_free);
        let nearest = laws.filter_map(|law| {
            let (left, physics) = self.nearest(member, law)?;
            Some((left, law, physics))
        });
        nearest.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The set with one more law, not fitted.
    fn put_beside(&self, member: &Member, law: usize, physics: &Physics) -> Option<Member> {
        let hypothesis = member.fitted.hypothesis.with_law(physics.clone());
        let amplitudes = self.candidates[law].amplitude_names();
        let number = 1 + self.given_laws + member.laws.len();
        let added = law_parameters(&hypothesis.model, physics, number, &self.candidates[law], &amplitudes);
        let records = self.study.stack(Role::Train).begin_near(&hypothesis, &member.fitted.records)?;
        let fitted = Fitted {
            sum_of_squares: squares(&records),
            free: member.fitted.free.iter().chain(&added).cloned().collect(),
            values: member.fitted.values.iter().copied().chain(added.iter().map(|own| own.given)).collect(),
            hypothesis,
            records,
        };
        self.member([&member.laws[..], &[law]].concat(), fitted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::naming::on_a_spring::{hardening, machine, noisy_runs, searched, searched_around};
    use crate::two_bodies::{driven, slide, swept};

    #[test]
    fn readings_that_all_lost_their_signs_are_explained_all_at_once() {
        let lost = |column: &str| {
            let law = Physics::new("rectification", SENSOR).with("share", 1.0);
            Physics { column: Some(column.to_owned()), ..law }
        };
        // 15 % softer than drawn between its bodies.
        let truth = slide(17_000.0, &[lost("motor_m"), lost("load_m")]);
        let run = |amplitude_n: f64, seed: u64| driven(&truth, &swept(amplitude_n), None, seed);
        let (train, held_out) = ([run(40.0, 1), run(120.0, 2)], [run(80.0, 3)]);
        searched_around(&slide(20_000.0, &[]), &train, &held_out, |search, refitted| {
            let found = search.spoilt_readings(&refitted).expect("both are seen");
            let named =
                |law: &usize| (search.candidates[*law].law.id(), search.candidates[*law].column.clone());
            let mut named: Vec<_> = found.laws.iter().map(named).collect();
            named.sort();
            let lost = |column: &str| ("rectification", Some(column.to_owned()));
            assert_eq!(named, [lost("load_m"), lost("motor_m")]);
            let coupling = "spring.motor-load.stiffness";
            let softer = found.fitted.hypothesis.model.parameter(coupling).unwrap();
            assert!((softer / 17_000.0 - 1.0).abs() < 0.01, "{softer} N/m");
        });
    }

    #[test]
    fn a_strong_law_of_the_machine_is_no_sensors() {
        let truth = hardening(machine(), 1e6);
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            assert!(search.is_out_of_phase(&refitted), "the refit is far off");
            assert!(search.spoilt_readings(&refitted).is_none());
        });
    }
}
