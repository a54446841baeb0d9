//! Verdict, place, numbers and words for what was found.

use std::borrow::Cow;

use stillbeam_plant::Model;
use stillbeam_recording::Role;

use crate::adequacy::{Adequacy, Rest, excess_power_bound, is_loud};
use crate::by_itself::differing_parameters;
use crate::comparison::Compared;
use crate::fit::Fitted;
use crate::intervals::precision;
use crate::locate::{Located, locate};
use crate::naming::by_innovations::explained_share;
use crate::naming::screening::{Screened, cosines};
use crate::naming::selection::Selection;
use crate::naming::stand_ins::{Moved, StandIns};
use crate::naming::trials::Candidate;
use crate::next_experiment::{Proposal, other_amplitude, separating_run};
use crate::noise::NoiseFloor;
use crate::options::Options;
use crate::overlays::overlays;
use crate::quality::fits;
use crate::result::{
    Confusability, Cost, Diagnosis, Effect, Fits, ParameterChange, ResidualTests, SCHEMA_VERSION, Tie,
    Verdict,
};
use crate::study::{OnAll, Study};
use crate::summary::{COLOURED, bounded, from_run_to_run, sentence};
use crate::verdict::{Contender, contenders, effects, moved_cap, range_cap, rows, ties, verdict, waiting};
use crate::visible::smallest_visible;

/// What the search for laws found.
pub(crate) struct Searched<'c> {
    pub(crate) study: Study,
    pub(crate) compared: Compared,
    pub(crate) is_exact: bool,
    pub(crate) selection: Selection,
    /// What the selection's indices point into.
    pub(crate) candidates: Cow<'c, [Candidate]>,
    /// What the refit without laws leaves, and whether that is noise.
    pub(crate) tests: Vec<(Role, Adequacy)>,
    pub(crate) refit_adequate: bool,
    pub(crate) stand_ins: StandIns,
}

/// What is left beside what was found, and what that makes of it.
struct Outcome {
    verdict: Verdict,
    /// What the recordings look like with the laws found, where these are a finding: laws that each take a
    /// part away, and none all, are named nowhere and put into no model.
    extended: Option<OnAll>,
    floors: Vec<Option<NoiseFloor>>,
    rest: Rest,
    residual_tests: ResidualTests,
    /// How much more power than noise the refit may leave.
    excess: f64,
    /// Whether something is missing from the refitted model.
    is_missing: bool,
    /// Whether more is left than noise, by its power.
    is_loud: bool,
    /// Lines on parameters that differ between recordings, each of which the model explains by itself.
    differing: Vec<String>,
}

impl Outcome {
    fn of(searched: &Searched<'_>, options: &Options) -> Self {
        let Searched { study, compared, selection, candidates, tests, refit_adequate, stand_ins, .. } =
            searched;
        let extended = (!selection.chosen.laws.is_empty()).then(|| selection.chosen.on_all());
        let final_on_all = extended.as_ref().unwrap_or(&compared.refitted_on_all);
        let floors = if extended.is_some() { study.floors(final_on_all) } else { compared.floors.clone() };
        let final_tests = study.adequacies(final_on_all, &floors);
        let samples = study.stack(Role::Train).present() as f64;
        let squares = [&compared.refitted, &selection.chosen.fitted].map(|fitted| fitted.sum_of_squares);
        let share = selection.explained_share.unwrap_or_else(|| explained_share(squares, samples));
        let rest = Rest::of(&final_tests, options);
        let fits_within = *refit_adequate && !stand_ins.moved.iter().any(Moved::is_another_machine);
        let left = (rest, is_loud(&final_tests, options));
        let verdict = verdict(selection, candidates, fits_within, left, share);
        let extended = extended.filter(|_| verdict != Verdict::Unexplained);
        Self {
            verdict,
            floors,
            rest,
            residual_tests: pooled_tests(if extended.is_some() { &final_tests } else { tests }),
            excess: excess_power_bound(tests),
            is_missing: !(fits_within && selection.chosen.laws.is_empty()),
            is_loud: left.1,
            differing: Vec::new(),
            extended,
        }
    }

    /// The same, naming nothing where the machine was another one from recording to recording.
    fn unless_recordings_differ(self, searched: &Searched<'_>, model: &Model, options: &Options) -> Self {
        let leaves_much = match self.verdict {
            Verdict::Unexplained => true,
            Verdict::Improved => self.is_loud,
            Verdict::Adequate | Verdict::Explained | Verdict::Ambiguous => false,
        };
        if !leaves_much {
            return self;
        }
        let differing = differing_parameters(&searched.study, model, &searched.compared, options);
        if differing.is_empty() {
            return self;
        }
        Self { verdict: Verdict::Unexplained, extended: None, differing, ..self }
    }

    fn explains(&self) -> bool {
        self.verdict != Verdict::Unexplained
    }
}

/// Verdict, place, numbers and words for what was found in a model, which may miss laws of a catalogue.
pub(crate) fn told(
    mut searched: Searched<'_>,
    (model, catalogue): (&Model, &[Candidate]),
    linear_tie: Option<Tie>,
    options: &Options,
    say: &mut dyn FnMut(&str, f64),
) -> Diagnosis {
    say("testing what is left", 0.95);
    let outcome = Outcome::of(&searched, options).unless_recordings_differ(&searched, model, options);
    say("locating the mismatch", 0.97);
    let located = outcome.is_missing.then(|| located(&searched, &outcome, model));
    let next = next_run(&searched, &outcome, model, options, say);
    let caps = said_besides(&searched, &outcome, options);
    searched.study.caps.extend(caps);
    let Searched { study, compared, is_exact, selection, candidates, stand_ins, .. } = &searched;
    let samples = study.stack(Role::Train).present() as f64;
    let effects = if outcome.explains() { effects(selection, candidates, samples) } else { Vec::new() };
    let is_settled = outcome.explains() || !outcome.differing.is_empty();
    let contenders = if is_settled { Vec::new() } else { contenders(selection, candidates) };
    let columns = model.output_columns();
    let models = [&compared.given, &compared.refitted_on_all];
    let fit = fits(study, &columns, models, outcome.extended.as_ref(), &outcome.floors);
    let is_bounded = outcome.verdict == Verdict::Adequate && !is_exact;
    let smallest_visible = if is_bounded {
        say("asking how small an effect would have been seen", 0.99);
        smallest_visible(study, &compared.refitted, catalogue, options)
    } else {
        Vec::new()
    };
    let extended = outcome.extended.as_ref().map(|on_all| (&selection.chosen.fitted.hypothesis, on_all));
    // A refit without what is missing bends the model's own parameters to make up for it.
    let corrected = if extended.is_some() { &selection.chosen.fitted } else { &compared.refitted };
    let ties = if outcome.explains() {
        let others = ties(selection, stand_ins, candidates, study.has_one_output());
        linear_tie.into_iter().chain(others).collect()
    } else {
        Vec::new()
    };
    Diagnosis {
        schema_version: SCHEMA_VERSION,
        verdict: outcome.verdict,
        sentence: in_words(&searched, &outcome, (&effects, &contenders), &fit, options),
        unconfirmed: contenders.into_iter().map(|contender| contender.name).collect(),
        excess_power_share: is_bounded.then_some(outcome.excess),
        smallest_visible,
        caps: study.caps.clone(),
        ties,
        candidates: rows(selection, candidates, options.training_gate, outcome.explains()),
        confusability: confusability(selection, candidates, options),
        effects,
        parameter_changes: parameter_changes(study, corrected),
        undetermined_parameters: compared.undetermined.clone(),
        fit,
        next_experiment: next.as_ref().map(|next| next.command.clone()),
        next_experiment_reason: next.map(|next| next.reason),
        residual_tests: ResidualTests {
            odd_distortion_db: located.as_ref().and_then(|located| located.odd_db),
            even_distortion_db: located.as_ref().and_then(|located| located.even_db),
            ..outcome.residual_tests
        },
        mismatch: located.as_ref().map(|located| located.mismatch.clone()),
        orders: located.as_ref().map(|located| located.orders.clone()).unwrap_or_default(),
        surfaces: located.map(|located| located.surfaces).unwrap_or_default(),
        set_aside: study.set_aside.clone(),
        controls: None,
        seconds: 0.0,
        cost: Cost::default(),
        overlays: overlays(study, &columns, models, extended, model.setup().physics.len()),
        refitted_model: compared.refitted.hypothesis.model.clone(),
        extended_model: extended.map(|(hypothesis, _)| hypothesis.model.clone()),
    }
}

fn located(searched: &Searched<'_>, outcome: &Outcome, model: &Model) -> Located {
    let Searched { study, compared, selection, .. } = searched;
    let found = outcome.extended.as_ref().map(|on_all| (&selection.chosen.fitted.hypothesis, on_all));
    let refitted = &compared.refitted.hypothesis;
    locate(study, model, refitted, &compared.refitted_on_all, &outcome.floors, found)
}

/// The run that would tell sets apart that do as well; where there are none, one at another amplitude if all
/// were driven equally hard. None where it is the machine that changed.
fn next_run(
    searched: &Searched<'_>,
    outcome: &Outcome,
    model: &Model,
    options: &Options,
    say: &mut dyn FnMut(&str, f64),
) -> Option<Proposal> {
    let Searched { study, selection, .. } = searched;
    if !outcome.differing.is_empty() {
        return None;
    }
    let sets = std::iter::once(&selection.chosen).chain(&selection.rivals);
    let tied: Vec<&Fitted> = sets.map(|member| &member.fitted).collect();
    if tied.len() > 1 {
        say("looking for a run that would tell the candidates apart", 0.98);
        return separating_run(study, &tied, options);
    }
    let is_wanted = outcome.is_missing && study.one_amplitude;
    is_wanted.then(|| other_amplitude(study, model, options)).flatten()
}

/// What is to be known besides: what time left out, what moved too far, how far laws are known.
fn said_besides(searched: &Searched<'_>, outcome: &Outcome, options: &Options) -> Vec<String> {
    let Searched { selection, stand_ins, .. } = searched;
    let range = outcome.extended.as_ref().and_then(|_| range_cap(selection));
    let differing = outcome.differing.iter().cloned();
    time_cap(selection, options)
        .into_iter()
        .chain(moved_cap(stand_ins))
        .chain(range)
        .chain(differing)
        .collect()
}

/// The sentence of the diagnosis.
fn in_words(
    searched: &Searched<'_>,
    outcome: &Outcome,
    (effects, contenders): (&[Effect], &[Contender]),
    fit: &Fits,
    options: &Options,
) -> String {
    let Searched { selection, candidates, is_exact, .. } = searched;
    let is_cut_short = !selection.left_out.is_empty();
    let waiting = is_cut_short.then(|| waiting(selection, candidates, options));
    let found = (effects, contenders, waiting.as_deref());
    let is_tied = !selection.rivals.is_empty();
    if !outcome.differing.is_empty() {
        return from_run_to_run(fit);
    }
    let mut said = sentence(outcome.verdict, found, fit, (outcome.rest, is_tied));
    if outcome.verdict == Verdict::Adequate {
        if !is_exact {
            said += &bounded(outcome.excess);
        }
        if outcome.residual_tests.whiteness_p < options.significance {
            said += COLOURED;
        }
    }
    said
}

/// How alike the effects are of laws that the screen is sure of.
fn confusability(selection: &Selection, candidates: &[Candidate], options: &Options) -> Confusability {
    let sure = selection.screened.iter().filter(|screened| screened.t.abs() > options.training_gate);
    let promising: Vec<&Screened> = sure.collect();
    Confusability {
        candidates: promising.iter().map(|screened| candidates[screened.candidate].name()).collect(),
        cosine: cosines(&promising),
    }
}

/// What was not looked for because time was over.
fn time_cap(selection: &Selection, options: &Options) -> Option<String> {
    let limit_s =
        options.processor_limit_s.or(options.time_limit_s).filter(|_| !selection.left_out.is_empty())?;
    let mut left_out = selection.left_out.clone();
    left_out.dedup();
    Some(format!(
        "the search was ended after {limit_s} s, before it looked for {}; a longer limit may tell more",
        left_out.join(" and for ")
    ))
}

fn pooled_tests(tests: &[(Role, Adequacy)]) -> ResidualTests {
    let smallest = |pick: &dyn Fn(&Adequacy) -> f64| {
        // Bonferroni: the smallest of several.
        let smallest = tests.iter().map(|(_, test)| pick(test)).fold(1.0, f64::min);
        (smallest * tests.len() as f64).min(1.0)
    };
    ResidualTests {
        whiteness_p: smallest(&|test| test.whiteness_p),
        cross_correlation_p: smallest(&|test| test.cross_correlation.p),
        structure_p: smallest(&|test| test.structure.p),
        odd_distortion_db: None,
        even_distortion_db: None,
    }
}

/// Parameters of the given model that moved by more than three standard errors.
fn parameter_changes(study: &Study, fitted: &Fitted) -> Vec<ParameterChange> {
    let known = precision(&study.stack(Role::Train), fitted, study.slowest_hz, &|_| false);
    let errors = known.by_noise.into_iter().zip(known.all_told);
    let rows = fitted.free.iter().zip(&fitted.values).zip(errors);
    rows.filter(|((parameter, _), _)| !parameter.is_added)
        // That it had to move, the rest being as drawn, noise decides; how well it is known then hangs on the
        // rest, too.
        .filter(|((parameter, value), (by_noise, _))| (*value - parameter.given).abs() > 3.0 * by_noise)
        .map(|((parameter, value), (_, stderr))| ParameterChange {
            path: parameter.path.clone(),
            from: parameter.given,
            to: *value,
            stderr,
        })
        .collect()
}
