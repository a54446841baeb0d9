//! From a model and recordings to a verdict: the pipeline, readable from top to bottom.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Instant;

use stillbeam_plant::{Hold, Model};
use stillbeam_recording::{Recording, Role};

use crate::adequacy::hidden::may_hide_a_force;
use crate::adequacy::{Adequacy, Rest, excess_power_bound, is_adequate, is_loud};
use crate::comparison::{Compared, adequate_on_everything, compare, settle};
use crate::cost::Meter;
use crate::error::DiagnoseError;
use crate::fit::Fitted;
use crate::held_command::{likelier, may_be_held};
use crate::intervals::precision;
use crate::linear_findings::as_linear;
use crate::linear_ties::tie;
use crate::locate::locate;
use crate::naming::by_innovations::explained_share;
use crate::naming::scales::Scales;
use crate::naming::screening::{Screened, cosines};
use crate::naming::selection::{Search, Selection};
use crate::naming::stand_ins::{Moved, StandIns};
use crate::naming::trials::{Candidate, all_candidates};
use crate::next_experiment::{other_amplitude, separating_run};
use crate::options::Options;
use crate::overlays::overlays;
use crate::patience::Patience;
use crate::quality::fits;
use crate::result::{
    Confusability, Cost, Diagnosis, Effect, Fits, ParameterChange, RecordRole, ResidualTests, SCHEMA_VERSION,
    Tie, Verdict,
};
use crate::simulation::Hypothesis;
use crate::study::Study;
use crate::verdict::{
    Contender, contenders, effects, moved_cap, range_cap, rows, ties, unsettled, verdict, waiting,
};
use crate::visible::smallest_visible;
use crate::wording::sizes;

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
    Ok(told(searched, model, &catalogue, linear_tie, options, &mut say))
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

/// What the search for laws found.
struct Searched<'c> {
    study: Study,
    compared: Compared,
    is_exact: bool,
    selection: Selection,
    /// What the selection's indices point into.
    candidates: Cow<'c, [Candidate]>,
    /// What the refit without laws leaves, and whether that is noise.
    tests: Vec<(Role, Adequacy)>,
    refit_adequate: bool,
    stand_ins: StandIns,
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
    let mut candidates = Cow::Borrowed(catalogue);
    if nothing_left {
        candidates.to_mut().retain(|candidate| candidate.is_read_off());
        if !study.is_read_in_steps(&compared.floors, options.least_excess_share) {
            candidates.to_mut().clear();
        }
    }
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
    let refitted_first = compared.refitted.clone();
    if search.weighed_again {
        say("refitting the model with the noise that is seen now", 0.6);
        let floors = search.floors.clone();
        compared = settle(search.study, &given, &compared.refitted, floors)?;
    }
    let promising = found.chosen.clone();
    let mut judging = |step: &str, done: f64| say(step, 0.65 + 0.2 * done);
    let mut selection = search.judge(found, &compared.refitted, &mut judging);
    if let Some(first) = search.back_to_the_first(&selection) {
        let floors = search.floors.clone();
        compared = settle(search.study, &given, &refitted_first, floors)?;
        selection = search.judge(first, &compared.refitted, &mut judging);
    }
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

/// Verdict, place, numbers and words for what was found.
fn told(
    searched: Searched<'_>,
    model: &Model,
    catalogue: &[Candidate],
    linear_tie: Option<Tie>,
    options: &Options,
    say: &mut dyn FnMut(&str, f64),
) -> Diagnosis {
    let Searched { mut study, compared, is_exact, selection, candidates, tests, refit_adequate, stand_ins } =
        searched;
    let candidates = &candidates[..];
    say("testing what is left", 0.95);
    let extended = (!selection.chosen.laws.is_empty()).then(|| selection.chosen.on_all());
    let final_on_all = extended.as_ref().unwrap_or(&compared.refitted_on_all);
    let floors = if extended.is_some() { study.floors(final_on_all) } else { compared.floors.clone() };
    let final_tests = study.adequacies(final_on_all, &floors);
    let columns = model.output_columns();
    let excess = excess_power_bound(&tests);
    let samples = study.stack(Role::Train).present() as f64;
    let squares = [&compared.refitted, &selection.chosen.fitted].map(|fitted| fitted.sum_of_squares);
    let share = selection.explained_share.unwrap_or_else(|| explained_share(squares, samples));
    let rest = Rest::of(&final_tests, options);
    let is_another_machine = stand_ins.moved.iter().any(Moved::is_another_machine);
    let fits_within = refit_adequate && !is_another_machine;
    let left = (rest, is_loud(&final_tests, options));
    let verdict = verdict(&selection, candidates, fits_within, left, share);
    // Laws that each take a part away, and none all, are no finding: nothing is named or put into a model
    // then.
    let explains = verdict != Verdict::Unexplained;
    let extended = extended.filter(|_| explains);
    say("locating the mismatch", 0.97);
    let missing = !(fits_within && selection.chosen.laws.is_empty());
    let located = missing.then(|| {
        let found = extended.as_ref().map(|on_all| (&selection.chosen.fitted.hypothesis, on_all));
        let refitted = &compared.refitted;
        locate(&study, model, &refitted.hypothesis, &compared.refitted_on_all, &floors, found)
    });
    let tied: Vec<&Fitted> =
        std::iter::once(&selection.chosen).chain(&selection.rivals).map(|member| &member.fitted).collect();
    let next = if tied.len() > 1 {
        say("looking for a run that would tell the candidates apart", 0.98);
        separating_run(&study, &tied, options)
    } else {
        let wanted = missing && study.one_amplitude;
        wanted.then(|| other_amplitude(&study, model, options)).flatten()
    };
    study.caps.extend(time_cap(&selection, options));
    study.caps.extend(moved_cap(&stand_ins));
    study.caps.extend(extended.as_ref().and_then(|_| range_cap(&selection)));
    let effects = if explains { effects(&selection, candidates, samples) } else { Vec::new() };
    let contenders =
        if verdict == Verdict::Unexplained { contenders(&selection, candidates) } else { Vec::new() };
    let models = [&compared.given, &compared.refitted_on_all];
    // A refit without what is missing bends the model's own parameters to make up for it.
    let corrected = if extended.is_some() { &selection.chosen.fitted } else { &compared.refitted };
    let fit = fits(&study, &columns, models, extended.as_ref(), &floors);
    let promising: Vec<&Screened> =
        selection.screened.iter().filter(|screened| screened.t.abs() > options.training_gate).collect();
    let pooled = pooled_tests(if extended.is_some() { &final_tests } else { &tests });
    let is_coloured = pooled.whiteness_p < options.significance;
    let is_adequate = verdict == Verdict::Adequate && !is_exact;
    let visible = if is_adequate {
        say("asking how small an effect would have been seen", 0.99);
        smallest_visible(&study, &compared.refitted, catalogue, options)
    } else {
        Vec::new()
    };
    let is_cut_short = !selection.left_out.is_empty();
    let waiting = is_cut_short.then(|| waiting(&selection, candidates, options));
    let found = (&effects[..], &contenders[..], waiting.as_deref());
    let said = sentence(verdict, found, &fit, (rest, !selection.rivals.is_empty()));
    Diagnosis {
        schema_version: SCHEMA_VERSION,
        verdict,
        sentence: match (is_adequate, is_coloured) {
            (true, true) => said + &bounded(excess) + COLOURED,
            (true, false) => said + &bounded(excess),
            (false, true) if verdict == Verdict::Adequate => said + COLOURED,
            _ => said,
        },
        unconfirmed: contenders.into_iter().map(|contender| contender.name).collect(),
        excess_power_share: is_adequate.then_some(excess),
        smallest_visible: visible,
        caps: study.caps.clone(),
        ties: if explains {
            let others = ties(&selection, &stand_ins, candidates, study.has_one_output());
            linear_tie.into_iter().chain(others).collect()
        } else {
            Vec::new()
        },
        candidates: rows(&selection, candidates, options.training_gate, explains),
        confusability: Confusability {
            candidates: promising.iter().map(|s| candidates[s.candidate].name()).collect(),
            cosine: cosines(&promising),
        },
        effects,
        parameter_changes: parameter_changes(&study, corrected),
        undetermined_parameters: compared.undetermined.clone(),
        mismatch: located.as_ref().map(|located| located.mismatch.clone()),
        orders: located.as_ref().map(|located| located.orders.clone()).unwrap_or_default(),
        surfaces: located.as_ref().map(|located| located.surfaces.clone()).unwrap_or_default(),
        fit,
        next_experiment: next.as_ref().map(|next| next.command.clone()),
        next_experiment_reason: next.map(|next| next.reason),
        residual_tests: ResidualTests {
            odd_distortion_db: located.as_ref().and_then(|located| located.odd_db),
            even_distortion_db: located.as_ref().and_then(|located| located.even_db),
            ..pooled
        },
        set_aside: study.set_aside.clone(),
        controls: None,
        seconds: 0.0,
        cost: Cost::default(),
        overlays: overlays(
            &study,
            &columns,
            models,
            extended.as_ref().map(|on_all| (&selection.chosen.fitted.hypothesis, on_all)),
            model.setup().physics.len(),
        ),
        refitted_model: compared.refitted.hypothesis.model.clone(),
        extended_model: extended.is_some().then(|| selection.chosen.fitted.hypothesis.model.clone()),
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

/// A model that is adequate down to a noise that is not white: a force that nobody recorded is as loud where
/// the machine is quiet.
const COLOURED: &str = " That noise is not white: a disturbance from outside that acts all the time, or the sensor's own colour. What is \
     smaller than it is hidden.";

/// How much may be overlooked.
fn bounded(excess: f64) -> String {
    format!(" What is left has at most {:.1} % more power than noise.", 100.0 * excess)
}

/// The verdict in words, with the numbers of the first output that was recorded; `waiting`: the laws that a
/// search which its limit ended did not try to the end.
fn sentence(
    verdict: Verdict,
    (effects, contenders, waiting): (&[Effect], &[Contender], Option<&[String]>),
    fit: &Fits,
    (rest, is_tied): (Rest, bool),
) -> String {
    let pooled =
        fit.pooled.iter().find(|pooled| pooled.role == RecordRole::HeldOut).or_else(|| fit.pooled.first());
    let numbers = pooled.map_or_else(String::new, |pooled| {
        let fits = &pooled.fits;
        let role = if pooled.role == RecordRole::HeldOut { "held-out" } else { "training" };
        let last = fits.extended.map_or(fits.refitted_linear, |extended| extended);
        let values = [fits.given.rms, fits.refitted_linear.rms, last.rms, fits.given.noise_floor];
        let ([given, refitted, extended, noise], unit) = sizes(values, &pooled.output);
        let extended = fits.extended.map_or_else(String::new, |_| format!(" to {extended} {unit} with it"));
        let goes = if last.rms <= fits.given.rms { "falls" } else { "rises" };
        format!(
            "The {role} error of {} {goes} from {given} as given to {refitted} refitted{extended}, the noise being {noise} {unit}.",
            pooled.output
        )
    });
    let remains = match rest {
        Rest::Noise => "",
        Rest::Foreign => {
            " What remains does not go with the motion: a disturbance from outside, another one in every recording."
        }
        Rest::Structured => " A structured rest remains.",
    };
    let first = effects.first().map(|effect| effect.sentence.as_str()).unwrap_or_default();
    match verdict {
        Verdict::Adequate => format!(
            "Nothing is missing: refitted within its own parameters the model explains the recordings down to the noise. {numbers}"
        ),
        Verdict::Unexplained if !contenders.is_empty() => {
            let ended =
                waiting.map_or("", |_| " The search was ended before it had tried what others do together.");
            format!("{}{ended} {numbers}", unsettled(contenders))
        }
        Verdict::Unexplained if let Some(waiting) = waiting => {
            let showed = if waiting.is_empty() {
                String::new()
            } else {
                format!(": {} showed and were not tried to the end", waiting.join(", "))
            };
            format!("Something is missing, and the search was ended before it was done{showed}. {numbers}")
        }
        Verdict::Unexplained => {
            format!("Something is missing that no law of the catalogue explains. {numbers}")
        }
        Verdict::Ambiguous => {
            format!("Several candidates explain the recordings equally well. {first} {numbers}{remains}")
        }
        Verdict::Improved if is_tied => {
            format!("{first} {numbers}{remains} Other laws would take as much away.")
        }
        Verdict::Improved => format!("{first} {numbers}{remains}"),
        Verdict::Explained => format!("{first} {numbers}"),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_of_which_nothing_settles_which_it_is_are_said_where_nothing_is_named() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        let said = |contenders: &[Contender], waiting: Option<&[String]>| {
            sentence(Verdict::Unexplained, (&[], contenders, waiting), &fit, (Rest::Structured, false))
        };
        let contenders = [
            Contender { name: "hysteresis at mode 1".to_owned(), taken: 0.93, is_unconfirmed: false },
            Contender { name: "dead_zone at drive".to_owned(), taken: 0.5, is_unconfirmed: true },
        ];
        let open = said(&contenders, None);
        assert!(
            open.contains("hysteresis at mode 1 takes 93 %; dead_zone at drive takes 50 % (the"),
            "{open}"
        );
        assert!(open.contains("do not settle what") && !open.contains("ended before"), "{open}");
        assert!(said(&contenders, Some(&[])).contains("ended before"), "time ended the search");
        assert!(said(&[], None).contains("no law of the catalogue"));
    }

    #[test]
    fn a_search_that_a_limit_ended_does_not_say_that_no_law_explains() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        for waiting in [&["saturation at drive".to_owned()][..], &[]] {
            let found = (&[][..], &[][..], Some(waiting));
            let said = sentence(Verdict::Unexplained, found, &fit, (Rest::Structured, false));
            assert!(said.contains("ended before it was done") && !said.contains("no law"), "{said}");
            assert_eq!(said.contains("saturation at drive"), !waiting.is_empty(), "{said}");
        }
    }

    #[test]
    fn what_remains_is_said_to_be_the_machines_own_or_not() {
        let fit = Fits { recordings: Vec::new(), pooled: Vec::new() };
        let said = |rest: Rest| sentence(Verdict::Improved, (&[], &[], None), &fit, (rest, false));
        assert!(said(Rest::Foreign).contains("does not go with the motion"));
        assert!(said(Rest::Structured).contains("A structured rest remains"));
        assert!(!said(Rest::Noise).contains("remain"), "time ended the search, and nothing is left");
        let tied = sentence(Verdict::Improved, (&[], &[], None), &fit, (Rest::Structured, true));
        assert!(tied.contains("A structured rest remains. Other laws would take as much away"), "{tied}");
    }
}
