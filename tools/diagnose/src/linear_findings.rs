//! What a linear machine may do that its model does not say: asked before any law is.
//!
//! A model has as many modes as somebody gave it, and a recording says nothing of its input between two
//! samples. With more modes, or with an input that is held, the machine is as linear as before; laws that
//! delay, weaken or leak would do much of the same.

use stillbeam_identify::tall::{Orthonormal, dot};
use stillbeam_plant::Model;
use stillbeam_recording::Role;

use crate::adequacy::is_adequate;
use crate::between_samples::BetweenSamples;
use crate::comparison::{Compared, compare_from, settle};
use crate::error::DiagnoseError;
use crate::fit::Fitted;
use crate::options::Options;
use crate::parameters::FreeParameter;
use crate::phase::OUT_OF_PHASE;
use crate::simulation::Hypothesis;
use crate::study::Study;

/// Said where the model is adequate with a share of the input beside it.
const MODES_BEYOND: &str = "the model has too few modes: those beyond add a share of what drives them, nearly without delay; the machine is linear with them too";
/// Said where the shares of its modes are free as well.
const SHARES: &str = "the model has too few modes or bodies: its outputs show another share of its modes than it says, and those beyond add a share of what drives them; the machine is linear with them too";
/// Said where another guess of the input does it.
const HELD: &str = "the input is held from sample to sample, as a digital controller puts it out: half a sample late, on the average";
const LINES: &str = "the input goes in straight lines from sample to sample";
const SMOOTH: &str = "the input is a smooth curve through its samples";

/// What may be beyond a model and leaves the machine linear, the least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beyond {
    Nothing,
    Modes,
    ModesAndShares,
}

impl Beyond {
    const ALL: [Self; 3] = [Self::Nothing, Self::Modes, Self::ModesAndShares];

    /// The recordings with it freed; `None` where nothing drives it.
    fn freed_on(self, study: &Study, model: &Model) -> Option<Study> {
        match self {
            Self::Nothing => Some(study.clone()),
            Self::Modes => study.with_remainders(model),
            Self::ModesAndShares => study.with_shares(model),
        }
    }

    fn words(self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Modes => Some(MODES_BEYOND),
            Self::ModesAndShares => Some(SHARES),
        }
    }

    /// What a mode does is known as well as its frequency, which a refit without its share may have missed.
    fn depends_on_the_refit(self) -> bool {
        self == Self::ModesAndShares
    }
}

/// The first of these, each refitted, that leaves nothing but noise: the study as it is then, which says so,
/// and the comparison on it.
pub(crate) fn as_linear(
    study: &Study,
    model: &Model,
    compared: &Compared,
    options: &Options,
) -> Result<Option<(Study, Compared)>, DiagnoseError> {
    let as_guessed = std::iter::once((study.clone(), None));
    let others = others_between(study, model);
    let others =
        others.into_iter().filter_map(|(between, words)| Some((study.between(between, model)?, Some(words))));
    let guesses: Vec<(Study, Option<&'static str>)> = as_guessed.chain(others).collect();
    let tangents = compared.refitted.sensitivities(&study.stack(Role::Train));
    // What says least comes first: another guess of the input, then what is beyond, then both.
    for beyond in Beyond::ALL {
        for (guess, words) in guesses.iter().skip(usize::from(beyond == Beyond::Nothing)) {
            let found = explained(guess, beyond, (model, compared), &tangents, options)?;
            if let Some((mut wider, freed)) = found {
                wider.caps.extend(words.iter().copied().chain(beyond.words()).map(str::to_owned));
                return Ok(Some((wider, freed)));
            }
        }
    }
    Ok(None)
}

/// What a mode does is reckoned anew from the last refit so often: the part of its share that is free stands
/// still in every refit, and the model moves too far by as much.
const MOST_REFITS: usize = 8;

/// The study with this freed and the comparison on it, if that leaves nothing but noise.
fn explained(
    guess: &Study,
    beyond: Beyond,
    (model, compared): (&Model, &Compared),
    tangents: &[Vec<f64>],
    options: &Options,
) -> Result<Option<(Study, Compared)>, DiagnoseError> {
    let given = Hypothesis::given(model);
    let mut before = compared.clone();
    for round in 0..if beyond.depends_on_the_refit() { MOST_REFITS } else { 1 } {
        let refitted = before.refitted.hypothesis.without_laws();
        let Some(mut wider) = beyond.freed_on(guess, &refitted.model) else { return Ok(None) };
        if round == 0 && wider.promises_little(compared, tangents) {
            return Ok(None);
        }
        let mut freed = compare_from(&mut wider, &given, &before)?;
        let floors = wider.floors(&freed.refitted_on_all);
        if wider.much_lower(&floors, &freed.floors) {
            freed = settle(&mut wider, &given, &freed.refitted, floors)?;
        }
        // Free shares do the work of every mode as well as the model does, which may then go anywhere.
        let as_known = |parameter: &FreeParameter| parameter.known_within().ln();
        if beyond.depends_on_the_refit() && farthest(&before.refitted, &freed.refitted, as_known) > ASTRAY {
            return Ok(None);
        }
        wider.draw_input_errors(&freed.refitted);
        if is_adequate(&wider.adequacies(&freed.refitted_on_all, &freed.floors), options) {
            return Ok(Some((wider, freed)));
        }
        if farthest(&before.refitted, &freed.refitted, |_| 1.0) < SETTLED {
            return Ok(None);
        }
        before = freed;
    }
    Ok(None)
}

/// A refit has settled where no parameter moves by this share any more, ...
const SETTLED: f64 = 0.002;
/// ... and is off the way where one moves at once by so many times what it is known to.
const ASTRAY: f64 = 2.0;

/// By how many of these units the logarithm of the parameter moved that moved most.
fn farthest(before: &Fitted, after: &Fitted, unit: impl Fn(&FreeParameter) -> f64) -> f64 {
    let moved = after.free.iter().zip(&after.values).map(|(parameter, value)| {
        let there = before.hypothesis.model.parameter(&parameter.path).unwrap_or(parameter.given);
        (parameter.to_search(*value) - parameter.to_search(there)).abs() / unit(parameter)
    });
    moved.fold(0.0, f64::max)
}

/// A guess is not tried where one step of a fit ahead it leaves more than so many squares of the noise ...
const FAR_FROM_NOISE: f64 = 4.0;
/// ... and more than this share of what was left without it.
const STILL_THERE: f64 = 0.05;

impl Study {
    /// Whether what it frees would leave nearly as much as was left without it, far more than noise;
    /// `tangents` are those of the fit without it. Beside a refit that is out of phase nobody knows how loud
    /// noise is.
    fn promises_little(&self, compared: &Compared, tangents: &[Vec<f64>]) -> bool {
        let before = &compared.refitted;
        let stack = self.stack(Role::Train);
        let Some(records) = stack.evaluate(&before.hypothesis, &before.initial_states()) else { return true };
        let mut left: Vec<f64> = records.iter().flat_map(|fit| fit.residuals.iter().copied()).collect();
        let mut basis = Orthonormal::default();
        for column in tangents {
            let mut own = column.clone();
            let mut start = 0;
            for fit in &records {
                let end = start + fit.residuals.len();
                fit.nuisances.remove_from(&mut own[start..end]);
                start = end;
            }
            basis.push(own);
        }
        basis.remove_from(&mut left);
        let square = dot(&left, &left);
        let is_out_of_phase = self.most_left(&compared.refitted_on_all) > OUT_OF_PHASE;
        let is_loud = is_out_of_phase || square > FAR_FROM_NOISE * stack.present() as f64;
        is_loud && square > STILL_THERE * before.sum_of_squares
    }
}

/// Guesses that were not made, and what is said where they are right; none where the model says what its
/// input does.
pub(crate) fn others_between(study: &Study, model: &Model) -> Vec<(BetweenSamples, &'static str)> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::compare;
    use crate::noise::NoiseFloor;
    use crate::two_bodies::{driven, slide, swept};
    use stillbeam_plant::Physics;

    /// Noise that is known from the refit alone is as loud as what a sensor that loses the sign leaves of it.
    #[test]
    fn another_guess_of_the_input_is_not_refitted_where_the_refit_is_out_of_phase() {
        let lost = |column: &str| {
            let law = Physics::new("rectification", "sensor").with("share", 1.0);
            Physics { column: Some(column.to_owned()), ..law }
        };
        let truth = slide(17_000.0, &[lost("motor_m"), lost("load_m")]);
        let given = slide(20_000.0, &[]);
        let run = |amplitude_n: f64, seed: u64| driven(&truth, &swept(amplitude_n), None, seed);
        let mut study = Study::new(&given, &[run(40.0, 1), run(120.0, 2)], &[run(80.0, 3)]).unwrap();
        let drawn = Hypothesis::given(&given);
        let compared = compare(&mut study, &drawn).unwrap();
        let louder = |floor: &Option<NoiseFloor>| {
            let floor = floor.clone()?;
            Some(NoiseFloor { rms: 1e3 * floor.rms, ..floor })
        };
        let floors = compared.floors.iter().map(louder).collect();
        let compared = settle(&mut study, &drawn, &compared.refitted, floors).unwrap();
        let tangents = compared.refitted.sensitivities(&study.stack(Role::Train));
        assert!(study.most_left(&compared.refitted_on_all) > OUT_OF_PHASE);
        for (between, _) in others_between(&study, &given) {
            let guess = study.between(between, &given).unwrap();
            assert!(guess.promises_little(&compared, &tangents), "{between:?}");
        }
    }
}
