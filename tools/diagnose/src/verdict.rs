//! From what was selected to effects, ties and a verdict.

use std::collections::BTreeMap;

use stillbeam_plant::Model;

use crate::adequacy::Rest;
use crate::naming::gates::{HELD_OUT, may_be_it};
use crate::naming::rounds::Tried;
use crate::naming::same_force::same_force;
use crate::naming::same_lateness::same_lateness;
use crate::naming::selection::Selection;
use crate::naming::sets::Member;
use crate::naming::stand_ins::{Moved, StandIns};
use crate::naming::trials::Candidate;
use crate::options::Options;
use crate::result::{CandidateRow, Effect, Evidence, Gate, ParameterEstimate, Tie, Verdict};
use crate::statistics::distributions::two_sided_normal;
use crate::wording::with_error;

/// Share of what noise does not explain that tied laws have to take away to be called tied where something is
/// left.
const MOST_OF_IT: f64 = 0.95;

/// Share of what noise does not explain that laws have to take away to be named at all where something is
/// left: what leaves more than it explains is not what was left out, however significant.
const MOST: f64 = 0.5;

/// The same where what is left goes with the motion: it is the machine's own, and laws that leave a third as
/// much as they take away only stand in for another. A spring that gives way half way through a run looks
/// like one that weakens all the time.
pub(crate) const MOST_OF_ITS_OWN: f64 = 0.75;

/// The verdict from what was found, what is left, whether that is louder than noise, and the share that was
/// taken off what noise does not explain.
pub(crate) fn verdict(
    selection: &Selection,
    candidates: &[Candidate],
    refit_adequate: bool,
    (rest, rest_is_loud): (Rest, bool),
    explained_share: f64,
) -> Verdict {
    if selection.chosen.laws.is_empty() {
        return if refit_adequate { Verdict::Adequate } else { Verdict::Unexplained };
    }
    weighed(&Weighed {
        rest,
        rest_is_loud,
        explained_share,
        is_tied: !selection.rivals.is_empty(),
        is_tied_with_others: selection
            .rivals
            .iter()
            .any(|rival| !is_the_same_law(&selection.chosen, rival, candidates)),
        is_cut_short: !selection.left_out.is_empty(),
        is_unrivalled: is_unrivalled(selection),
    })
}

/// What the verdict on laws that were found hangs on.
struct Weighed {
    rest: Rest,
    /// Whether what is left has more power than noise.
    rest_is_loud: bool,
    /// Share that the laws take off what noise does not explain.
    explained_share: f64,
    /// Whether other laws do as well, ...
    is_tied: bool,
    /// ... and among them such as are no other form of those that were found.
    is_tied_with_others: bool,
    /// Whether time ended the search.
    is_cut_short: bool,
    /// See [`is_unrivalled`].
    is_unrivalled: bool,
}

fn weighed(found: &Weighed) -> Verdict {
    let share = found.explained_share;
    match (found.rest, found.is_tied) {
        // Without a search for rivals nothing is certain.
        (Rest::Noise, false) if found.is_cut_short => Verdict::Improved,
        (Rest::Noise, false) => Verdict::Explained,
        (Rest::Noise, true) => Verdict::Ambiguous,
        (_, _) if share < MOST => Verdict::Unexplained,
        (Rest::Structured, _) if share < MOST_OF_ITS_OWN => Verdict::Unexplained,
        // All that goes with the motion is taken away; what is left is no law's to explain, and louder than
        // noise it is no noise.
        (Rest::Foreign, true) if !found.rest_is_loud => Verdict::Ambiguous,
        (Rest::Foreign, true) => Verdict::Improved,
        (Rest::Foreign, false) => Verdict::Improved,
        // Laws that do as well as each other and leave more than noise are a tie of what is better than
        // nothing.
        (Rest::Structured, true) if share > MOST_OF_IT && found.rest_is_loud => Verdict::Improved,
        (Rest::Structured, true) if share > MOST_OF_IT => Verdict::Ambiguous,
        // Several laws each take a part of it away and none takes all: none of them is it.
        (Rest::Structured, _) if found.is_tied_with_others => Verdict::Unexplained,
        // Something else may take all away, and was not tried.
        (Rest::Structured, _) if found.rest_is_loud && found.is_cut_short && !found.is_unrivalled => {
            Verdict::Unexplained
        }
        (Rest::Structured, _) => Verdict::Improved,
    }
}

/// Whether a rival is the same set of laws with one of them seen against the ground instead of against the
/// base: a spring of the tip that is one of the beam where the base hardly moves.
fn is_the_same_law(chosen: &Member, rival: &Member, candidates: &[Candidate]) -> bool {
    let of = |member: &Member| as_of_the_beam(member.laws.iter().map(|index| &candidates[*index]));
    of(chosen) == of(rival)
}

/// Laws with their places and the outputs that they are about, in an order of their own, the tip being the
/// beam's.
fn as_of_the_beam<'c>(
    laws: impl Iterator<Item = &'c Candidate>,
) -> Vec<(&'static str, String, Option<String>)> {
    let mut laws: Vec<_> = laws
        .map(|candidate| {
            let location = if candidate.location == "tip" { "beam" } else { &candidate.location };
            (candidate.law.id(), location.to_owned(), candidate.column.clone())
        })
        .collect();
    laws.sort();
    laws
}

/// Whether no laws that were not tried could do the work of any law of the chosen set.
fn is_unrivalled(selection: &Selection) -> bool {
    selection.judged.iter().all(|tried| tried.unrivalled)
}

/// Effects in order of importance: what the held-out (or training) recordings would lose.
pub(crate) fn effects(selection: &Selection, candidates: &[Candidate], samples: f64) -> Vec<Effect> {
    let mut found: Vec<(f64, Effect)> = selection
        .judged
        .iter()
        .filter(|tried| selection.chosen.laws.contains(&tried.candidate))
        .map(|tried| {
            let candidate = &candidates[tried.candidate];
            let gain_db = tried.held_out.map_or(tried.training.gain_db, |held_out| held_out.gain_db);
            let evidence = Evidence {
                delta_bic: -samples * tried.training.gain_db / 10.0 * std::f64::consts::LN_10
                    + tried.parameters.len() as f64 * samples.ln(),
                held_out_gain_db: gain_db,
                p_value: two_sided_normal(tried.training.t()),
                held_out_z: tried.held_out.map(|held_out| held_out.z),
            };
            let parameters = estimates(&selection.chosen.fitted.hypothesis.model, candidate, tried);
            let sentence = sentence(candidate, &parameters, gain_db);
            let effect = Effect {
                id: candidate.law.id().to_owned(),
                location: candidate.location.clone(),
                parameters,
                evidence,
                sentence,
            };
            (gain_db, effect)
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, effect)| effect).collect()
}

fn estimates(model: &Model, candidate: &Candidate, tried: &Tried) -> BTreeMap<String, ParameterEstimate> {
    let units = stillbeam_plant::catalogue::parameters_of(model, candidate.law, &candidate.location);
    tried
        .parameters
        .iter()
        .map(|(name, value, stderr, ..)| {
            let unit = units.iter().find(|(spec, _)| spec.name == name).map(|(_, unit)| unit.clone());
            let estimate =
                ParameterEstimate { value: *value, stderr: *stderr, unit: unit.unwrap_or_default() };
            (name.clone(), estimate)
        })
        .collect()
}

/// What was left out, its numbers, what it is good for, and how it is recognised.
fn sentence(candidate: &Candidate, parameters: &BTreeMap<String, ParameterEstimate>, gain_db: f64) -> String {
    let numbers: Vec<String> = parameters
        .iter()
        .map(|(name, estimate)| {
            format!(
                "{} {}",
                name.replace('_', " "),
                with_error(estimate.value, estimate.stderr, &estimate.unit)
            )
        })
        .collect();
    let of_what_size = match &numbers[..] {
        // Play that is never crossed does the same however wide it is.
        [] => "the recordings do not tell how large it is".to_owned(),
        numbers => numbers.join(", "),
    };
    let of_output = candidate.column.as_ref().map_or_else(String::new, |column| format!(" of {column}"));
    format!(
        "{} at the {}{of_output} was left out: {of_what_size}. Without it the error is {:.1} times as large. {}",
        capitalised(&candidate.law.id().replace('_', " ")),
        candidate.location,
        10f64.powf(gain_db / 20.0),
        candidate.law.sentence(),
    )
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Parameters that had to move further than they can be wrong.
pub(crate) fn moved_cap(stand_ins: &StandIns) -> Option<String> {
    let words: Vec<String> = stand_ins.moved.iter().map(Moved::words).collect();
    (!words.is_empty()).then(|| {
        format!(
            "the recordings need {}; a drawing is rarely that wrong: measure it by itself, or look for what acts beside it",
            words.join(" and ")
        )
    })
}

/// That the physics found holds no further than the recordings went.
pub(crate) fn range_cap(selection: &Selection) -> Option<String> {
    let runs_away = selection.judged.iter().any(|tried| tried.runs_away);
    runs_away.then(|| {
        "the physics found is known as far as the recordings went: driven a tenth harder, the model with it runs away"
            .to_owned()
    })
}

/// A law that by itself takes away much of what the refit leaves, and of which nothing settles whether it is
/// what is missing.
pub(crate) struct Contender {
    pub(crate) name: String,
    /// Share of the power of what the refit leaves of the training recordings.
    pub(crate) taken: f64,
    /// Whether the held-out recordings neither confirm nor contradict it.
    pub(crate) is_unconfirmed: bool,
}

impl Contender {
    fn words(&self) -> String {
        let held_out = if self.is_unconfirmed { " (the held-out recordings hardly show it)" } else { "" };
        format!("{} takes {:.0} %{held_out}", self.name, 100.0 * self.taken)
    }
}

/// Laws of which each by itself would be it, but that held-out recordings hardly show it, that too large a
/// rest remains, or that time ended the search for others; those that take most first.
pub(crate) fn contenders(selection: &Selection, candidates: &[Candidate]) -> Vec<Contender> {
    let alone = selection.tried.iter().filter(|tried| tried.member.laws.len() == 1);
    let contends = alone.filter(|tried| may_be_it(&tried.gates, tried.held_out));
    let mut found: Vec<Contender> = contends
        .map(|tried| Contender {
            name: candidates[tried.candidate].name(),
            taken: 1.0 - 10f64.powf(-tried.training.gain_db / 10.0),
            is_unconfirmed: tried.gates.iter().any(|gate| gate.name == HELD_OUT && !gate.passed),
        })
        .filter(|contender| contender.taken > 0.0)
        .collect();
    found.sort_by(|a, b| b.taken.total_cmp(&a.taken));
    found.truncate(MOST_SAID);
    found
}

/// What is said of laws of which nothing settles which one it is.
pub(crate) fn unsettled(contenders: &[Contender]) -> String {
    let words: Vec<String> = contenders.iter().map(Contender::words).collect();
    format!(
        "Something is missing, and the recordings do not settle what. By itself, of the power that the refit leaves, {}.",
        words.join("; ")
    )
}

/// Laws that the screen is sure of and that a search ended by its limit did not fit to the end, those that
/// promise most first.
pub(crate) fn waiting(selection: &Selection, candidates: &[Candidate], options: &Options) -> Vec<String> {
    let is_tried = |candidate: usize| {
        selection.tried.iter().any(|tried| tried.candidate == candidate && !tried.passes())
    };
    let sure = selection.screened.iter().filter(|seen| seen.t.abs() > options.training_gate);
    let mut seen: Vec<_> = sure.filter(|seen| !is_tried(seen.candidate)).collect();
    seen.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    seen.iter().take(MOST_SAID).map(|seen| candidates[seen.candidate].name()).collect()
}

/// More than these are no help.
const MOST_SAID: usize = 3;

/// Sets of laws that cannot be told from the chosen one, or from a parameter's other value; `one_output`:
/// whether all recordings have the same single output.
pub(crate) fn ties(
    selection: &Selection,
    stand_ins: &StandIns,
    candidates: &[Candidate],
    one_output: bool,
) -> Vec<Tie> {
    let late = same_lateness(selection, candidates, one_output);
    let same = same_force(&selection.judged, candidates).into_iter().chain(late);
    if selection.rivals.is_empty() {
        return stood_for(stand_ins, candidates).into_iter().chain(same).collect();
    }
    let name = |member: &Member| -> Vec<String> {
        member.laws.iter().map(|index| candidates[*index].name()).collect()
    };
    let sets: Vec<Vec<String>> =
        std::iter::once(&selection.chosen).chain(&selection.rivals).map(name).collect();
    let words: Vec<String> = sets.iter().map(|set| set.join(" with ")).collect();
    let sentence = format!("These recordings cannot tell apart: {}.", words.join("; or "));
    std::iter::once(Tie { candidates: sets, sentence }).chain(same).collect()
}

/// The tie of wrong parameters and laws that do the same; the parameters are the empty set.
fn stood_for(stand_ins: &StandIns, candidates: &[Candidate]) -> Option<Tie> {
    if stand_ins.members.is_empty() {
        return None;
    }
    let moved: Vec<String> = stand_ins.moved.iter().map(Moved::words).collect();
    let mut sets = vec![Vec::new()];
    let mut words = vec![format!("{}, and nothing missing", moved.join(" with "))];
    for member in &stand_ins.members {
        let names: Vec<String> = member.laws.iter().map(|index| candidates[*index].name()).collect();
        let numbers: Vec<String> = member
            .fitted
            .free
            .iter()
            .zip(&member.fitted.values)
            .filter(|(parameter, _)| parameter.is_added)
            .filter_map(|(parameter, value)| {
                let (_, name) = parameter.path.strip_prefix("physics.")?.split_once('.')?;
                Some(format!("{} {value:.4}", name.replace('_', " ")))
            })
            .collect();
        words.push(format!("{} ({})", names.join(" with "), numbers.join(", ")));
        sets.push(names);
    }
    let sentence = format!("These recordings cannot tell apart: {}.", words.join("; or "));
    Some(Tie { candidates: sets, sentence })
}

/// Standard errors at which a law counts as seen.
const DETECTED: f64 = 5.0;

/// Every candidate with what became of it; `explains`: whether those chosen are a finding.
pub(crate) fn rows(
    selection: &Selection,
    candidates: &[Candidate],
    gate_t: f64,
    explains: bool,
) -> Vec<CandidateRow> {
    let model = &selection.chosen.fitted.hypothesis.model;
    let mut rows: Vec<CandidateRow> = selection
        .screened
        .iter()
        .map(|screened| {
            let candidate = &candidates[screened.candidate];
            let of = |tried: &&Tried| tried.candidate == screened.candidate;
            let tried = selection.judged.iter().find(of).or_else(|| selection.tried.iter().find(of));
            let chosen = selection.chosen.laws.contains(&screened.candidate);
            let mut gates = tried.map_or_else(
                || {
                    vec![Gate {
                        name: "screen".to_owned(),
                        passed: screened.t.abs() > gate_t,
                        detail: format!(
                            "{:.1} standard errors from zero; {}",
                            screened.t.abs(),
                            if screened.t.abs() > gate_t { "others explain more" } else { "not seen" }
                        ),
                    }]
                },
                |tried| tried.gates.clone(),
            );
            if chosen && !explains {
                gates.push(Gate {
                    name: "sufficient".to_owned(),
                    passed: false,
                    detail: "takes a part of it away, as others do, and none takes all".to_owned(),
                });
            }
            CandidateRow {
                id: candidate.law.id().to_owned(),
                location: candidate.location.clone(),
                screen_t: screened.t,
                detection_limit: screened.trial.amplitudes.first().map(|(name, value)| {
                    ((*name).to_owned(), (value * screened.factor * DETECTED / screened.t).abs())
                }),
                hidden_share: screened.hidden,
                parameters: tried.map(|tried| estimates(model, candidate, tried)).unwrap_or_default(),
                training_t: tried.map(|tried| tried.training.t()),
                held_out_z: tried.and_then(|tried| tried.held_out).map(|held_out| held_out.z),
                gates,
                named: chosen && explains,
            }
        })
        .collect();
    rows.sort_by(|a, b| {
        let key = |row: &CandidateRow| (row.named, row.training_t.is_some(), row.screen_t.abs());
        let (a, b) = (key(a), key(b));
        b.0.cmp(&a.0).then(b.1.cmp(&a.1)).then(b.2.total_cmp(&a.2))
    });
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Weighed = Weighed {
        rest: Rest::Noise,
        rest_is_loud: false,
        explained_share: 1.0,
        is_tied: false,
        is_tied_with_others: false,
        is_cut_short: false,
        is_unrivalled: true,
    };

    fn candidate(id: &str, location: &str, column: Option<&str>) -> Candidate {
        Candidate {
            law: stillbeam_plant::catalogue::laws().iter().copied().find(|law| law.id() == id).unwrap(),
            location: location.to_owned(),
            column: column.map(str::to_owned),
            trials: Vec::new(),
            ranges: Vec::new(),
            step_stderr: None,
        }
    }

    #[test]
    fn laws_that_leave_noise_explain_unless_others_do_as_well_or_were_not_looked_for() {
        assert_eq!(weighed(&NOISE), Verdict::Explained);
        assert_eq!(weighed(&Weighed { is_tied: true, ..NOISE }), Verdict::Ambiguous);
        assert_eq!(weighed(&Weighed { is_cut_short: true, ..NOISE }), Verdict::Improved);
    }

    #[test]
    fn a_law_whose_size_no_recording_shows_is_said_to_be_of_unknown_size() {
        let play = candidate("backlash", "motor-load", None);
        let said = sentence(&play, &BTreeMap::new(), 20.0);
        assert!(
            said.contains("was left out: the recordings do not tell how large it is. Without it"),
            "{said}"
        );
        let gap = ParameterEstimate { value: 1e-3, stderr: 1e-5, unit: "m".to_owned() };
        let said = sentence(&play, &BTreeMap::from([("gap".to_owned(), gap)]), 20.0);
        assert!(said.contains("was left out: gap 0.001000 ± 0.000010 m. Without it"), "{said}");
    }

    #[test]
    fn a_law_of_one_of_several_sensors_is_said_with_its_output() {
        let said = sentence(&candidate("rectification", "sensor", Some("tip_m")), &BTreeMap::new(), 20.0);
        assert!(said.starts_with("Rectification at the sensor of tip_m was left out"), "{said}");
    }

    /// A spring that gives way half way through a run looks for 57 % like one that weakens all the time, play
    /// of a sensor for 59 % like a mode.
    #[test]
    fn laws_are_named_beside_a_rest_where_they_take_most_and_more_of_it_where_it_is_the_machines_own() {
        let beside = |rest: Rest, explained_share: f64| {
            weighed(&Weighed { rest, explained_share, rest_is_loud: true, ..NOISE })
        };
        for share in [0.3, 0.49] {
            assert_eq!(beside(Rest::Foreign, share), Verdict::Unexplained);
            assert_eq!(beside(Rest::Structured, share), Verdict::Unexplained);
        }
        for share in [0.57, 0.71] {
            assert_eq!(beside(Rest::Foreign, share), Verdict::Improved);
            assert_eq!(beside(Rest::Structured, share), Verdict::Unexplained);
        }
        assert_eq!(beside(Rest::Structured, 0.8), Verdict::Improved);
    }

    #[test]
    fn a_tie_that_leaves_something_of_the_machine_is_no_finding_unless_it_takes_nearly_all() {
        let tied = Weighed { rest: Rest::Structured, is_tied: true, is_tied_with_others: true, ..NOISE };
        assert_eq!(weighed(&Weighed { explained_share: 0.9, ..tied }), Verdict::Unexplained);
        assert_eq!(
            weighed(&Weighed { explained_share: 0.98, rest_is_loud: true, ..tied }),
            Verdict::Improved
        );
        assert_eq!(weighed(&Weighed { explained_share: 0.98, ..tied }), Verdict::Ambiguous);
        // A spring of the beam and the same spring of its tip are one finding.
        let one = Weighed { is_tied_with_others: false, ..tied };
        assert_eq!(weighed(&Weighed { explained_share: 0.9, ..one }), Verdict::Improved);
        assert_eq!(weighed(&Weighed { explained_share: 0.6, ..one }), Verdict::Unexplained);
    }

    #[test]
    fn a_law_of_the_tip_is_the_same_of_the_beam_and_one_of_another_output_is_not() {
        let spring = |location: &str| candidate("cubic_stiffness", location, None);
        let late = |column: &str| candidate("delay", "sensor", Some(column));
        let named = |laws: &[Candidate]| as_of_the_beam(laws.iter());
        assert_eq!(named(&[spring("tip"), late("a")]), named(&[late("a"), spring("beam")]));
        assert_ne!(named(&[late("a")]), named(&[late("b")]));
        assert_ne!(named(&[spring("tip"), spring("beam")]), named(&[spring("beam")]));
        assert_ne!(named(&[spring("base")]), named(&[spring("beam")]));
    }

    #[test]
    fn a_tie_beside_what_is_louder_than_noise_is_an_improvement() {
        let tied = Weighed { rest: Rest::Foreign, is_tied: true, is_tied_with_others: true, ..NOISE };
        assert_eq!(weighed(&tied), Verdict::Ambiguous);
        assert_eq!(weighed(&Weighed { rest_is_loud: true, ..tied }), Verdict::Improved);
    }

    #[test]
    fn what_time_left_untried_may_be_it_where_much_is_left_and_the_laws_have_rivals() {
        let cut = Weighed { rest: Rest::Structured, rest_is_loud: true, is_cut_short: true, ..NOISE };
        assert_eq!(weighed(&Weighed { is_unrivalled: false, ..cut }), Verdict::Unexplained);
        assert_eq!(weighed(&cut), Verdict::Improved);
    }
}
