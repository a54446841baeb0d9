//! What a linear machine may do that its model does not say: asked before any law is.
//!
//! A model has as many modes as somebody gave it, and a recording says nothing of its input between two
//! samples. With more modes, or with an input that is held, the machine is as linear as before; laws that
//! delay, weaken or leak would do much of the same.

use stillbeam_plant::Model;

use crate::adequacy::is_adequate;
use crate::between_samples::BetweenSamples;
use crate::comparison::{Compared, compare_from};
use crate::error::DiagnoseError;
use crate::options::Options;
use crate::simulation::Hypothesis;
use crate::study::Study;

/// Said where the model is adequate with a share of the input beside it.
const MODES_BEYOND: &str = "the model has too few modes: those beyond add a share of what drives them, nearly without delay; the machine is linear with them too";
/// Said where another guess of the input does it.
const HELD: &str = "the input is held from sample to sample, as a digital controller puts it out: half a sample late, on the average";
const LINES: &str = "the input goes in straight lines from sample to sample";
const SMOOTH: &str = "the input is a smooth curve through its samples";

/// The first of these, each refitted, that leaves nothing but noise: the study as it is then, which says so,
/// and the comparison on it.
pub(crate) fn as_linear(
    study: &Study,
    model: &Model,
    compared: &Compared,
    options: &Options,
) -> Result<Option<(Study, Compared)>, DiagnoseError> {
    let given = Hypothesis::given(model);
    let refitted = compared.refitted.hypothesis.without_laws();
    let others = others_between(study, model);
    let as_guessed = std::iter::once((study.clone(), None));
    let others =
        others.into_iter().filter_map(|(between, words)| Some((study.between(between, model)?, Some(words))));
    let guesses: Vec<(Study, Option<&str>)> = as_guessed.chain(others).collect();
    // What says least comes first: another guess of the input, then further modes, then both.
    let alone = guesses.iter().skip(1).map(|(guess, words)| (guess.clone(), *words, None));
    let with_modes = guesses.iter().filter_map(|(guess, words)| {
        Some((guess.with_remainders(&refitted.model)?, *words, Some(MODES_BEYOND)))
    });
    for (mut wider, words, modes) in alone.chain(with_modes) {
        let freed = compare_from(&mut wider, &given, compared)?;
        wider.draw_input_errors(&freed.refitted);
        if is_adequate(&wider.adequacies(&freed.refitted_on_all, &freed.floors), options) {
            wider.caps.extend(words.into_iter().chain(modes).map(str::to_owned));
            return Ok(Some((wider, freed)));
        }
    }
    Ok(None)
}

/// Guesses that were not made, and what is said where they are right; none where the model says what its
/// input does.
fn others_between(study: &Study, model: &Model) -> Vec<(BetweenSamples, &'static str)> {
    if BetweenSamples::stated(model).is_some() {
        return Vec::new();
    }
    let guessed = study.train.first().map(|record| record.between.0);
    // No base jumps; a servo may be told to.
    let may_be_held = !model.input_is_motion() || model.servo().is_some();
    let held = may_be_held.then_some((BetweenSamples::Held, HELD));
    let smooth = match guessed {
        Some(BetweenSamples::Lines) => (BetweenSamples::Spline, SMOOTH),
        _ => (BetweenSamples::Lines, LINES),
    };
    held.into_iter().chain([smooth]).collect()
}
