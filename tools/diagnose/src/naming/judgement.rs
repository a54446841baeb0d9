//! The last word: every law of the chosen set against the set without it, and what would do as well.

use rayon::prelude::*;
use stillbeam_plant::catalogue::Law;

use super::gates::{Closer, DOUBT, is_only_unconfirmed, is_only_undetermined};
use super::improvement::improvement;
use super::nested::contains;
use super::rivals::Rivals;
use super::rounds::{Place, Tried};
use super::selection::{Search, Selection};
use super::sets::Member;
use crate::adequacy::{Rest, is_loud};
use crate::fit::Fitted;
use crate::intervals::precision;
use crate::record::Record;
use crate::simulation::simulate;
use stillbeam_recording::Role;

impl Search<'_> {
    /// Finishes the fit of the chosen set, keeps what passes of it, and looks for rivals: sets in which
    /// another law in a law's place does as well.
    pub(crate) fn judge(
        &self,
        selection: Selection,
        refitted: &Fitted,
        say: &mut dyn FnMut(&str, f64),
    ) -> Selection {
        say("judging what was chosen", 0.0);
        let (mut selection, without) = self.those_that_pass(selection, refitted);
        if selection.chosen.laws.is_empty() {
            let laws = Vec::new();
            selection.chosen = self.member(laws, refitted.clone()).unwrap_or(selection.chosen);
            return selection;
        }
        for (place, set) in without.iter().enumerate() {
            say("looking for laws that would do as well", 0.3 + 0.6 * place as f64 / without.len() as f64);
            // What is known already costs nothing.
            if !self.is_over() || self.knows_rivals(&selection) {
                self.find_rivals(&mut selection, place, set);
            }
            if self.is_over() {
                self.suspect_rivals(&mut selection);
                break;
            }
        }
        let both = self.both_exchanged(&selection);
        selection.rivals.extend(both);
        self.add_left_open(&mut selection, refitted);
        if !self.is_over() {
            self.put_simplest_first(&mut selection, refitted);
            self.put_richest_first(&mut selection, refitted);
        }
        selection.chosen = self.with_sharper_steps(selection.chosen);
        selection
    }

    /// Runs the gates of each law of the chosen set against the set without it, drops the weakest law that
    /// fails one and begins again, until all that are left pass. With it come the sets without each of these.
    fn those_that_pass(&self, mut selection: Selection, refitted: &Fitted) -> (Selection, Vec<Member>) {
        loop {
            if selection.chosen.laws.is_empty() {
                return (selection, Vec::new());
            }
            let finished = self.one_force_as_one_law(self.finished(selection.chosen));
            selection.chosen = self.even_if_as_good(self.uneven_if_better(finished));
            if self.study.is_spent() {
                selection.left_out.push("the best values of what was chosen");
            }
            let rivals = Rivals::of(&selection, self.is_over());
            let (judged, mut without) = self.judge_laws(&selection.chosen, refitted, &rivals);
            let failing = judged.iter().enumerate().filter(|(_, tried)| !tried.passes());
            let weight = |tried: &Tried| tried.held_out.map_or(tried.training.z, |held_out| held_out.z);
            let weakest = failing.min_by(|a, b| weight(a.1).total_cmp(&weight(b.1))).map(|(place, _)| place);
            let Some(place) = weakest else {
                selection.judged = judged;
                return (selection, without);
            };
            // What was judged stays on the record of the candidates.
            let dropped = judged[place].clone();
            selection.tried.retain(|tried| tried.candidate != dropped.candidate);
            selection.tried.push(dropped);
            selection.chosen = without.swap_remove(place);
        }
    }

    /// Adds sets in which a law of the chosen one may be richer.
    fn add_left_open(&self, selection: &mut Selection, refitted: &Fitted) {
        let open = self.left_open(&selection.chosen).into_iter();
        let open = open.filter(|member| !selection.has_rival(&member.laws));
        // What the recordings are said to show has to pass its gates; what they only leave open cannot, and
        // of a sum no part is shown.
        let contends = |member: &Member| {
            !self.is_likelier(&selection.chosen, member)
                || self.has_friction_known_as_a_sum(member)
                || self.judged_passing(member, selection, refitted).is_some()
        };
        let open: Vec<Member> = open.filter(contends).collect();
        for member in open {
            // Without what stood in for a richer law, two may be the same.
            if !selection.has_rival(&member.laws) {
                selection.rivals.push(member);
            }
        }
    }

    /// The judgement of every law of a set, where all of them pass.
    fn judged_passing(
        &self,
        member: &Member,
        selection: &Selection,
        refitted: &Fitted,
    ) -> Option<Vec<Tried>> {
        let (judged, _) = self.judge_laws(member, refitted, &Rivals::of(selection, false));
        judged.iter().all(Tried::passes).then_some(judged)
    }

    /// Of rivals with more parameters that are beyond doubt better now that they are fitted to the end, the
    /// best is the finding, where its laws pass their gates.
    fn put_richest_first(&self, selection: &mut Selection, refitted: &Fitted) {
        let chosen = &selection.chosen;
        let richer = selection.rivals.iter().enumerate().filter(|(_, rival)| {
            rival.fitted.free.len() > chosen.fitted.free.len() && self.is_beyond_doubt(chosen, rival)
        });
        let best = richer
            .min_by(|a, b| a.1.fitted.sum_of_squares.total_cmp(&b.1.fitted.sum_of_squares))
            .map(|(place, _)| place);
        let Some(best) = best else { return };
        if let Some(judged) = self.judged_passing(&selection.rivals[best], selection, refitted) {
            // The simpler one is told from it, and no tie.
            selection.chosen = selection.rivals.swap_remove(best);
            selection.judged = judged;
        }
    }

    /// Of sets that cannot be told apart the one with the fewest parameters, and then with the fewest laws,
    /// is the finding, where its laws pass their gates too.
    fn put_simplest_first(&self, selection: &mut Selection, refitted: &Fitted) {
        let size = |member: &Member| (member.fitted.free.len(), member.laws.len());
        let sizes: Vec<(usize, usize)> = selection.rivals.iter().map(size).collect();
        let Some(simplest) = simplest_below(size(&selection.chosen), &sizes) else { return };
        if let Some(judged) = self.judged_passing(&selection.rivals[simplest], selection, refitted) {
            std::mem::swap(&mut selection.rivals[simplest], &mut selection.chosen);
            selection.judged = judged;
        }
    }

    /// Every law of a set judged, and the sets without it, in the set's order; `rivals`: what is known about
    /// other laws.
    pub(super) fn judge_laws(
        &self,
        chosen: &Member,
        refitted: &Fitted,
        rivals: &Rivals<'_>,
    ) -> (Vec<Tried>, Vec<Member>) {
        let stack = self.study.stack(Role::Train);
        let known = precision(&stack, &chosen.fitted, self.study.slowest_hz, &|parameter| parameter.is_added);
        let stable = self.is_stable(chosen);
        let (beyond_noise, rest, is_loud) = self.left_under(chosen);
        let rest_is_foreign = rest == Rest::Foreign;
        let rest = (rest != Rest::Noise).then_some(beyond_noise);
        let is_cut_short = rivals.is_cut_short && is_loud;
        (0..chosen.laws.len())
            .into_par_iter()
            .map(|place| {
                let mut without = self.without_or_refitted(chosen, place, refitted);
                let own = format!("physics.{}.", self.given_laws + place + 1);
                let amplitudes = self.candidates[chosen.laws[place]].amplitude_names();
                let strengths = chosen.fitted.free.iter().zip(&known.agreements).filter(|(parameter, _)| {
                    parameter.path.strip_prefix(&own).is_some_and(|name| amplitudes.iter().any(|a| a == name))
                });
                let worst =
                    strengths.filter_map(|(_, agreement)| *agreement).min_by(|a, b| a.p.total_cmp(&b.p));
                let rivalry = rivals.beside(&chosen.laws, chosen.laws[place]);
                let closer = Some(Closer {
                    consistency: worst,
                    stable,
                    rest,
                    cut_short: is_cut_short.then_some(rivalry),
                    rest_is_foreign,
                });
                // Whether a law is there hangs on noise; how large it is, on the drawing too.
                let law = chosen.laws[place];
                let beside = |without: &Member| {
                    self.judged(without, chosen.clone(), law, &own, &known.by_noise, (closer, Some(rivalry)))
                };
                let mut tried = beside(&without);
                // What a law hardly adds may be no more than what the fit of the others without it lacked.
                let may_lack_a_fit = chosen.laws.len() > 1 && tried.passes() && !self.is_over();
                if may_lack_a_fit && self.is_in_doubt(&tried) {
                    without = self.finished(without);
                    tried = beside(&without);
                }
                for (parameter, all_told) in chosen.fitted.free.iter().zip(&known.all_told) {
                    let name = parameter.path.strip_prefix(&own);
                    let row = tried.parameters.iter_mut().find(|(row, ..)| Some(row.as_str()) == name);
                    if let Some((_, _, stderr, ..)) = row {
                        *stderr = *all_told;
                    }
                }
                (tried, without)
            })
            .unzip()
    }

    /// The set without its law at a place. Where the rest cannot be fitted without it, that is the refitted
    /// model.
    fn without_or_refitted(&self, chosen: &Member, place: usize, refitted: &Fitted) -> Member {
        let without = if chosen.laws.len() == 1 {
            self.member(Vec::new(), refitted.clone())
        } else {
            self.without(chosen, place)
        };
        without.unwrap_or_else(|| Member {
            laws: Vec::new(),
            fitted: refitted.clone(),
            held_out: chosen.held_out.clone(),
        })
    }

    /// Whether held-out recordings show a law less than twice as clearly as they must.
    fn is_in_doubt(&self, tried: &Tried) -> bool {
        tried.held_out.is_none_or(|held_out| held_out.z <= DOUBT * self.options.held_out_gate)
    }

    /// What a set leaves over: its sum of squares on the training recordings beyond the noise that is seen
    /// under it, what it is, and whether it has more power than noise.
    fn left_under(&self, member: &Member) -> (f64, Rest, bool) {
        let on_all = member.on_all();
        let floors = self.study.floors(&on_all);
        let tests = self.study.adequacies(&on_all, &floors);
        let outputs = self.study.train.iter().flat_map(|record| &record.outputs);
        let noise = outputs.filter_map(|output| {
            let relative = floors[output.index].as_ref()?.rms * self.study.weights[output.index];
            Some(relative * relative * output.at.len() as f64)
        });
        let beyond_noise = if self.study.is_coloured() {
            // The rest is what the weighting is made of: how large it is beside a law its squares do not
            // tell.
            f64::INFINITY
        } else {
            (member.fitted.sum_of_squares - noise.sum::<f64>()).max(0.0)
        };
        (beyond_noise, Rest::of(&tests, self.options), is_loud(&tests, self.options))
    }

    /// What a set leaves over.
    pub(crate) fn rest(&self, member: &Member) -> Rest {
        let on_all = member.on_all();
        Rest::of(&self.study.adequacies(&on_all, &self.study.floors(&on_all)), self.options)
    }

    /// Whether the model stays within ten times what is linear when the input is a tenth larger than any that
    /// it explains: a softening spring is one as far as it was seen, and further on nobody knows. Of the
    /// recording in which it goes furthest, since friction that holds it in one may let go of it there.
    fn is_stable(&self, member: &Member) -> bool {
        const HARDER: f64 = 1.1;
        let hypothesis = &member.fitted.hypothesis;
        let reach = |record: &Record| {
            let values = simulate(hypothesis, record, &[]).unwrap_or_else(|| vec![vec![f64::INFINITY]]);
            values.iter().flatten().fold(0.0_f64, |most, value| {
                // A comparison with NaN is false: keep it.
                if value.is_finite() { most.max(value.abs()) } else { f64::INFINITY }
            })
        };
        let train = &self.study.train;
        let normal = train.iter().map(reach).fold(0.0, f64::max);
        let harder = |record: &Record| Record { rerun: record.rerun.scaled(HARDER), ..record.clone() };
        normal.is_finite() && train.iter().all(|record| reach(&harder(record)) <= 10.0 * HARDER * normal)
    }

    /// Whether all that could take the place of the chosen laws has been tried already. What was found in
    /// pieces of the recordings has no rivals yet that were fitted to the whole of them.
    fn knows_rivals(&self, selection: &Selection) -> bool {
        selection.chosen.laws.len() == 1 && !self.weighed_again && !selection.tried.is_empty()
    }

    /// Whether a set explains the training recordings beyond doubt better than the chosen one, is no worse on
    /// all together, and only lacks held-out recordings that would show it, or would show that it is more: a
    /// weaker law that those happen to show may stand in for it, a steady force for the wave that it is a
    /// part of.
    fn is_better_in_training(&self, other: &Tried, chosen: &Member) -> bool {
        if !other.passes() && !is_only_unconfirmed(&other.gates, other.held_out) {
            return false;
        }
        let stack = self.study.stack(Role::Train);
        let (before, after) = (&chosen.fitted.records, &other.member.fitted.records);
        let training = improvement(&stack, before, after, self.study.slowest_hz);
        training.t() > DOUBT * self.options.training_gate
            && self.better_by(&other.member, chosen) < self.options.separation
    }

    /// A set with a law that only the gate of its strengths refuses, fitted to the end and as good as the
    /// chosen one: that they trade with the law's shape is no sign that it is not there. Only where the
    /// chosen set leaves nothing but noise: beside another rest a tie says that the right law may be missing,
    /// and that a law which is not known to be there must not say.
    fn undetermined_rival(&self, other: &Tried, chosen: &Member, without: &Member) -> Option<Member> {
        let amplitudes = self.candidates[other.candidate].amplitude_names();
        let may_be = |tried: &Tried| is_only_undetermined(&tried.gates, &tried.parameters, &amplitudes);
        if !may_be(other) || self.rest(chosen) != Rest::Noise {
            return None;
        }
        let member = self.finished_if_close(other.member.clone(), chosen)?;
        let finished = self.judged_on(without, member, other.candidate);
        (finished.passes() || may_be(&finished)).then_some(finished.member)
    }

    fn find_rivals(&self, selection: &mut Selection, place: usize, without: &Member) {
        let tried = if self.knows_rivals(selection) {
            selection.tried.clone()
        } else {
            let chosen = &selection.chosen;
            let place = Place { law: chosen.laws[place], left: chosen.fitted.sum_of_squares };
            let (screened, tried) = self.round_in_place(without, place);
            if selection.chosen.laws.len() == 1 {
                selection.screened = screened;
            }
            tried
        };
        for other in tried {
            if selection.chosen.laws.contains(&other.candidate) {
                continue;
            }
            let chosen = &selection.chosen;
            // A law that contains the chosen one always does as well, and for that alone is no rival for it.
            let laws = |member: &Member| -> Vec<&dyn Law> {
                member.laws.iter().map(|&law| self.candidates[law].law).collect()
            };
            let (theirs, ours) = (laws(&other.member), laws(chosen));
            let contains = theirs.iter().any(|rich| ours.iter().any(|simple| contains(*rich, *simple)));
            let as_simple = !contains || other.member.fitted.free.len() <= chosen.fitted.free.len();
            let known_to_be_better = self.is_better_in_training(&other, chosen);
            if (other.passes() || known_to_be_better)
                && let Some(member) = self.finished_if_close(other.member.clone(), chosen)
                && (as_simple || known_to_be_better || self.is_open_beside(chosen, &member))
            {
                selection.rivals.push(member);
            } else if !contains && let Some(member) = self.undetermined_rival(&other, chosen, without) {
                selection.rivals.push(member);
            }
            selection.tried.retain(|known| known.candidate != other.candidate);
            selection.tried.push(other);
        }
    }
}

/// The first of the smallest that are smaller than what was chosen: as simple is no reason to change.
fn simplest_below(chosen: (usize, usize), rivals: &[(usize, usize)]) -> Option<usize> {
    let smaller = rivals.iter().enumerate().filter(|(_, size)| **size < chosen);
    smaller.min_by_key(|(_, size)| **size).map(|(place, _)| place)
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;

    use super::{Record, simplest_below, simulate};
    use crate::naming::gates::DETERMINED;
    use crate::naming::on_a_spring::{fitted_with, hardening, machine, noisy_runs, searched, stopped_at};
    use crate::result::Gate;
    use crate::{Options, diagnose};

    #[test]
    fn a_law_refused_for_its_strength_alone_is_a_rival_only_of_what_leaves_nothing_but_noise() {
        let spring = Physics::new("cubic_stiffness", "mass").with("stiffness", 3e4);
        let mut truth = machine();
        truth.setup_mut().physics = vec![spring.clone()];
        // Louder than what a spline through the force's samples and straight lines between them make of it.
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 3e-4);
        searched(&noisy(&[3.0, 6.0]), &noisy(&[4.5]), |search, refitted| {
            let chosen = search.weighed_again(fitted_with(search, &refitted, &spring));
            let refitted = search.reweighted(refitted).unwrap();
            let mut other = search.judged_on(&refitted, chosen.clone(), chosen.laws[0]);
            let failed = |name: &str| Gate { name: name.to_owned(), passed: false, detail: String::new() };
            // As if its strength traded with a shape.
            other.gates = vec![failed(DETERMINED)];
            assert!(search.undetermined_rival(&other, &chosen, &refitted).is_some());
            let short =
                stopped_at(search, &chosen, |path| if path.starts_with("physics.") { 0.7 } else { 1.0 });
            assert!(search.undetermined_rival(&other, &short, &refitted).is_none(), "a structured rest");
            other.parameters[0].2 = other.parameters[0].1 / 1.4;
            assert!(
                search.undetermined_rival(&other, &chosen, &refitted).is_none(),
                "it may as well be nothing"
            );
            other.parameters[0].2 = other.parameters[0].1 / 3.1;
            assert!(search.undetermined_rival(&other, &chosen, &refitted).is_some());
            other.gates.push(failed("held out"));
            assert!(
                search.undetermined_rival(&other, &chosen, &refitted).is_none(),
                "it fails elsewhere too"
            );
        });
    }

    /// What holds the machine in one recording lets go of it half as hard again.
    #[test]
    fn friction_that_holds_the_machine_in_one_recording_is_stable_and_a_spring_that_lets_go_is_not() {
        let friction = Physics::new("stribeck_friction", "mass").with("force", 2.5);
        let friction = friction.with("static_force", 4.0).with("velocity", 0.05);
        let mut truth = machine();
        truth.setup_mut().physics = vec![friction.clone()];
        let noisy = |amplitudes: &[f64]| noisy_runs(&truth, amplitudes, 1e-5);
        searched(&noisy(&[3.0, 9.0]), &noisy(&[5.0]), |search, refitted| {
            let held = fitted_with(search, &refitted, &friction);
            assert!(search.is_stable(&held));
            // A spring that turns around a little farther than 9 N take the mass.
            let (stiffness, cubic) = (300.0, 6.6e3);
            let turns_at: f64 = f64::sqrt(stiffness / cubic);
            let mut escaping = held;
            let softening = Physics::new("cubic_stiffness", "mass").with("stiffness", -cubic);
            escaping.fitted.hypothesis.model.setup_mut().physics = vec![softening];
            let stays = |record: &Record| {
                let reached = simulate(&escaping.fitted.hypothesis, record, &[]);
                reached.is_some_and(|values| values.iter().flatten().all(|value| value.abs() < turns_at))
            };
            assert!(search.study.train.iter().all(stays), "as hard as it was");
            assert!(!search.is_stable(&escaping));
        });
    }

    #[test]
    fn a_spring_that_would_let_go_a_little_farther_is_named_with_how_far_it_is_known() {
        let softening = |stiffness: f64| hardening(machine(), -stiffness);
        let noisy = |stiffness: f64, amplitudes: &[f64]| noisy_runs(&softening(stiffness), amplitudes, 1e-5);
        let named = |stiffness: f64| {
            let (train, held_out) = (noisy(stiffness, &[3.0, 9.0]), noisy(stiffness, &[5.0]));
            let found = diagnose(&machine(), &train, &held_out, &Options::default(), &mut |_| {}).unwrap();
            let ids: Vec<String> = found.effects.iter().map(|effect| effect.id.clone()).collect();
            assert_eq!(ids, ["cubic_stiffness"], "{}", found.sentence);
            found.caps.iter().any(|cap| cap.contains("runs away"))
        };
        assert!(named(6.6e3));
        assert!(!named(3e3), "one that holds a tenth more");
    }

    #[test]
    fn only_a_simpler_rival_takes_the_place_of_the_chosen_set_and_the_first_of_the_simplest() {
        assert_eq!(simplest_below((5, 2), &[]), None);
        assert_eq!(simplest_below((5, 2), &[(5, 2), (6, 1), (5, 3)]), None);
        assert_eq!(simplest_below((5, 2), &[(4, 2), (3, 2), (6, 2), (3, 2)]), Some(1));
        assert_eq!(simplest_below((5, 2), &[(5, 2), (5, 1)]), Some(1), "one law that does what two do");
    }
}
