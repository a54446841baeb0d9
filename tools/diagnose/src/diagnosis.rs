//! From a model and recordings to a verdict: the pipeline, readable from top to bottom.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use stillbeam_plant::{Hold, Model};
use stillbeam_recording::{Recording, Role};

use crate::adequacy::hidden::may_hide_a_force;
use crate::adequacy::{Adequacy, is_adequate};
use crate::comparison::{Compared, adequate_on_everything, compare, settle};
use crate::cost::Meter;
use crate::error::DiagnoseError;
use crate::held_command::{likelier, may_be_held};
use crate::linear_findings::as_linear;
use crate::linear_ties::tie;
use crate::naming::scales::Scales;
use crate::naming::selection::{Search, Selection};
use crate::naming::stand_ins::StandIns;
use crate::naming::trials::{Candidate, all_candidates};
use crate::options::Options;
use crate::patience::Patience;
use crate::result::Diagnosis;
use crate::simulation::Hypothesis;
use crate::study::Study;
use crate::telling::{Searched, told};

/// What a diagnosis is doing.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// The step, in words.
    pub step: String,
    /// How much of the whole is done, 0 to 1.
    pub done: f64,
}

/// Diagnoses a model on recordings.
///
/// `recordings` are trained on, except those whose side file says `held_out`; `held_out` are judged on.
/// Without any to judge on, the last training recording is held out, or the second half of the only one, and
/// the result says what could therefore not be decided.
///
/// # Errors
/// [`DiagnoseError`]: which recording does not fit the model, why, and the remedy.
pub fn diagnose(
    model: &Model,
    recordings: &[Recording],
    held_out: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
) -> Result<Diagnosis, DiagnoseError> {
    let started = Instant::now();
    check_asked(recordings, held_out, options)?;
    let patience = Patience::new(options);
    let mut meter = Meter::new(progress);
    let found = diagnosed((model, recordings, held_out), options, patience, &mut meter)?;
    let found = if !patience.is_over() && may_be_held(model, recordings, &found) {
        let held = model.with_hold(Hold::ZeroOrder);
        meter.goes_on_with("with the command held between samples", LAST_STEP);
        let held = diagnosed((&held, recordings, held_out), options, patience, &mut meter);
        // A command that cannot be simulated held is none.
        match held {
            Ok(held) => likelier(found, held, model),
            Err(_) => found,
        }
    } else {
        found
    };
    Ok(Diagnosis { seconds: started.elapsed().as_secs_f64(), cost: meter.end(), ..found })
}

/// Refuses what would give an answer to another question.
fn check_asked(
    recordings: &[Recording],
    held_out: &[Recording],
    options: &Options,
) -> Result<(), DiagnoseError> {
    let mut limits = options.time_limit_s.into_iter().chain(options.processor_limit_s);
    if let Some(seconds) = limits.find(|seconds| !seconds.is_finite() || *seconds < 0.0) {
        return Err(DiagnoseError::Limit { seconds });
    }
    let is_trained_on = |judging: &&Recording| {
        recordings.iter().any(|it| it.time_s == judging.time_s && it.columns == judging.columns)
    };
    match held_out.iter().find(is_trained_on) {
        Some(judging) => Err(DiagnoseError::BothRoles { recording: judging.name.clone() }),
        None => Ok(()),
    }
}

/// Share of the work done when the last step begins.
const LAST_STEP: f64 = 0.98;

/// The same with the command between its samples as the model says.
fn diagnosed(
    (model, recordings, held_out): (&Model, &[Recording], &[Recording]),
    options: &Options,
    patience: Patience,
    meter: &mut Meter<'_>,
) -> Result<Diagnosis, DiagnoseError> {
    let work = Arc::clone(&meter.work);
    let mut say = |step: &str, done: f64| meter.begin(step, done);
    say("reading the recordings", 0.0);
    let study = Study::new(model, recordings, held_out)?.counted_by(&work);
    let study = Study { patience: Some(patience), ..study };
    let refitted = refitted(study, model, options, &mut say)?;
    say("trying the catalogue of physics", 0.2);
    let catalogue = if refitted.is_exact { Vec::new() } else { catalogue(&refitted, options) };
    let linear_tie = refitted
        .linear
        .as_ref()
        .and_then(|(plain, before)| tie((plain, &before.refitted), &refitted.study, &catalogue));
    let searched = searched(refitted, model, &catalogue, options, &mut say)?;
    Ok(told(searched, (model, &catalogue), linear_tie, options, &mut say))
}

/// The refitted model and what it leaves, before any law is looked for.
struct Refitted {
    study: Study,
    compared: Compared,
    /// Whether simulation and recordings agree to rounding.
    is_exact: bool,
    /// Where nothing but noise is left, no law is looked for but what the readings themselves show.
    nothing_left: bool,
    /// Whether a refit on all recordings was asked for, ...
    asked_all: bool,
    /// ... and leaves nothing but noise.
    saw_all: bool,
    /// The study and refit without what else a linear machine may do, where that explains everything.
    linear: Option<(Study, Compared)>,
}

/// The model refitted within its own parameters, and where that is not enough, within what else a linear
/// machine may do.
fn refitted(
    mut study: Study,
    model: &Model,
    options: &Options,
    say: &mut dyn FnMut(&str, f64),
) -> Result<Refitted, DiagnoseError> {
    say("refitting the model within its own parameters", 0.05);
    let given = Hypothesis::given(model);
    let mut compared = compare(&mut study, &given)?;
    study.draw_input_errors(&compared.refitted);
    let is_exact = study.is_exact(&compared.refitted_on_all);
    let tests = study.adequacies(&compared.refitted_on_all, &compared.floors);
    let mut nothing_left = is_exact || is_adequate(&tests, options);
    let mut saw_all = false;
    let asked_all = !nothing_left && is_trained(&tests, options);
    if asked_all {
        say(SEEING_ALL, 0.1);
        if let Some(everywhere) = adequate_on_everything(&study, &given, &compared, options)? {
            (study, compared) = everywhere;
            study.caps.push(REFITTED_ON_ALL.to_owned());
            (nothing_left, saw_all) = (true, true);
        }
    }
    let mut linear = None;
    if !nothing_left {
        say("asking what else a linear machine may do", 0.15);
        if let Some((wider, freed)) = as_linear(&study, model, &compared, options)? {
            linear = Some((std::mem::replace(&mut study, wider), std::mem::replace(&mut compared, freed)));
            nothing_left = true;
        }
    }
    if nothing_left && !is_exact && linear.is_none() && may_hide_a_force(&tests) {
        nothing_left = false;
    }
    Ok(Refitted { study, compared, is_exact, nothing_left, asked_all, saw_all, linear })
}

/// The laws that the recordings demand beside the refitted model.
fn searched<'c>(
    refitted: Refitted,
    model: &Model,
    catalogue: &'c [Candidate],
    options: &Options,
    say: &mut dyn FnMut(&str, f64),
) -> Result<Searched<'c>, DiagnoseError> {
    let Refitted { mut study, mut compared, is_exact, nothing_left, asked_all, mut saw_all, .. } = refitted;
    let given = Hypothesis::given(model);
    let mut candidates = match nothing_left {
        true => Cow::Owned(shown_by_readings(&study, &compared, catalogue, options)),
        false => Cow::Borrowed(catalogue),
    };
    let mut search = search_beside(&mut study, &compared, model, &candidates, options);
    let held_out = compared.refitted_on_all.held_out.clone();
    let mut found = Selection::nothing(&compared.refitted, held_out.clone());
    if !candidates.is_empty() {
        let run = search.run(&compared.refitted, held_out, &mut |step, done| say(step, 0.2 + 0.4 * done));
        if !nothing_left || !run.chosen.laws.is_empty() {
            found = run;
        }
    }
    if nothing_left && found.chosen.laws.is_empty() {
        search.candidates = catalogue;
    }
    let promising = found.chosen.clone();
    let selection = judged(&mut search, &mut compared, found, say)?;
    let mut tests = search.study.adequacies(&compared.refitted_on_all, &compared.floors);
    let mut refit_adequate = is_exact || is_adequate(&tests, options);
    let again = if !selection.chosen.laws.is_empty() {
        search.refined_by_innovations(&selection, &given, &compared)
    } else if !refit_adequate {
        search.by_innovations(&promising, &given, &compared, &mut |step, done| say(step, 0.85 + 0.08 * done))
    } else {
        None
    };
    let selection = again.unwrap_or(selection);
    // The same question has the same answer, unless outputs are weighted otherwise by now.
    let may_ask_all = !asked_all || search.weighed_again;
    if !refit_adequate && selection.chosen.laws.is_empty() && may_ask_all {
        say(SEEING_ALL, 0.93);
        saw_all = true;
        if let Some((wider, everywhere)) = adequate_on_everything(search.study, &given, &compared, options)? {
            (*search.study, compared, refit_adequate) = (wider, everywhere, true);
            tests = search.study.adequacies(&compared.refitted_on_all, &compared.floors);
            search.study.caps.push(REFITTED_ON_ALL.to_owned());
        }
    }
    let stand_ins = if refit_adequate && selection.chosen.laws.is_empty() && !is_exact && !saw_all {
        say("asking what parameters that moved too far stand for", 0.94);
        search.stand_ins(&selection.chosen)
    } else {
        StandIns::default()
    };
    if nothing_left && selection.chosen.laws.is_empty() {
        candidates = Cow::Borrowed(catalogue);
    }
    Ok(Searched { study, compared, is_exact, selection, candidates, tests, refit_adequate, stand_ins })
}

/// Where nothing is left, nothing hides but what the readings themselves show.
fn shown_by_readings(
    study: &Study,
    compared: &Compared,
    catalogue: &[Candidate],
    options: &Options,
) -> Vec<Candidate> {
    let is_in_steps = study.is_read_in_steps(&compared.floors, options.least_excess_share);
    catalogue.iter().filter(|candidate| is_in_steps && candidate.is_read_off()).cloned().collect()
}

/// What was found, judged beside a refit that is weighed by the noise that is seen now; or what was found
/// first, where nothing else passes.
fn judged(
    search: &mut Search<'_>,
    compared: &mut Compared,
    found: Selection,
    say: &mut dyn FnMut(&str, f64),
) -> Result<Selection, DiagnoseError> {
    let given = Hypothesis::given(search.given);
    let refitted_first = compared.refitted.clone();
    if search.weighed_again {
        say("refitting the model with the noise that is seen now", 0.6);
        let floors = search.floors.clone();
        *compared = settle(search.study, &given, &compared.refitted, floors)?;
    }
    let mut judging = |step: &str, done: f64| say(step, 0.65 + 0.2 * done);
    let selection = search.judge(found, &compared.refitted, &mut judging);
    let Some(first) = search.back_to_the_first(&selection) else { return Ok(selection) };
    let floors = search.floors.clone();
    *compared = settle(search.study, &given, &refitted_first, floors)?;
    Ok(search.judge(first, &compared.refitted, &mut judging))
}

/// A search that has not begun.
fn search_beside<'s>(
    study: &'s mut Study,
    compared: &Compared,
    model: &'s Model,
    candidates: &'s [Candidate],
    options: &'s Options,
) -> Search<'s> {
    let held_out_starts = if model.input().is_none() {
        compared.refitted_on_all.held_out.iter().map(|fit| fit.initial.clone()).collect()
    } else {
        Vec::new()
    };
    Search {
        given_laws: model.setup().physics.len(),
        given: model,
        candidates,
        options,
        floors: compared.floors.clone(),
        weighed_again: false,
        in_pieces: false,
        rounds: std::sync::Mutex::default(),
        held_out_starts,
        study,
    }
}

/// The step that looks at all recordings.
const SEEING_ALL: &str = "refitting the model on the held-out recordings too";

/// Whether nothing but noise is left on the training recordings.
fn is_trained(tests: &[(Role, Adequacy)], options: &Options) -> bool {
    let train: Vec<(Role, Adequacy)> =
        tests.iter().filter(|(role, _)| *role == Role::Train).cloned().collect();
    is_adequate(&train, options)
}

/// Said where the training recordings did not show enough of the machine.
const REFITTED_ON_ALL: &str = "the training recordings alone do not determine the model's parameters: it was refitted on the held-out ones too, and \
     no recording is left to judge that refit on; record one more that excites everything";

/// The catalogue, with trial values that fit this machine.
fn catalogue(refitted: &Refitted, options: &Options) -> Vec<Candidate> {
    let Refitted { study, compared, .. } = refitted;
    let hypothesis = &compared.refitted.hypothesis;
    let starts = compared.refitted.initial_states();
    let Some(scales) = Scales::new(hypothesis, &study.train, &starts) else { return Vec::new() };
    let peaks_hz = study.peaks_hz(&compared.refitted_on_all);
    all_candidates(hypothesis, &scales, &study.train, &peaks_hz, &options.without)
}
