//! A command that is held from one sample to the next.
//!
//! A digital controller puts out a number and holds it until the next. Read as straight lines between its
//! samples such a command comes half a sample late, and a law that is late, or a clock that runs wrong, makes
//! up for that: no physics. The model file may say what is the case (`hold` in `[input]`). Where it does not,
//! and a late law was named or nothing was found under a command that goes in steps, the whole diagnosis is
//! made again with the command held, and the one that needs fewer laws, and explains no less, is the answer.

use stillbeam_plant::{Model, catalogue};
use stillbeam_recording::Recording;

use crate::result::{Diagnosis, Verdict};

/// Steps: at least this share of a command's samples are what the one before was.
const REPEATED: f64 = 0.5;
/// With a held command the recordings may be explained worse by this factor where it needs fewer
/// laws, ...
const NO_WORSE: f64 = 1.05;
/// ... and have to be explained better by this one where it does not.
const BETTER: f64 = 0.9;

/// Whether the diagnosis of a model is to be made again with its command held between samples.
pub(crate) fn may_be_held(model: &Model, recordings: &[Recording], found: &Diagnosis) -> bool {
    let Some(input) = model.input() else { return false };
    let is_open = input.hold.is_none() && !model.input_is_motion() && model.setup().controller.is_none();
    if !is_open || found.verdict == Verdict::Adequate {
        return false;
    }
    let of_effects = found.effects.iter().map(|effect| effect.id.as_str());
    // A tie's candidates are named with their places.
    let of_ties = found.ties.iter().flat_map(|tie| tie.candidates.iter().flatten());
    let of_ties = of_ties.map(|name| name.split(' ').next().unwrap_or_default());
    let is_late = of_effects.chain(of_ties).any(is_late);
    let goes_in_steps =
        || recordings.iter().all(|recording| recording.column(&input.column).is_ok_and(goes_in_steps));
    let leaves_more = found.verdict == Verdict::Improved;
    is_late || leaves_more || (found.verdict == Verdict::Unexplained && goes_in_steps())
}

/// Whether a law, by its id, is one that comes late.
fn is_late(id: &str) -> bool {
    catalogue::laws().iter().any(|law| law.id() == id && law.is_late())
}

/// Whether most samples repeat the one before, as the setpoints of a sequence of levels do.
fn goes_in_steps(samples: &[f64]) -> bool {
    let repeated = samples.windows(2).filter(|pair| pair[0] == pair[1]).count();
    repeated as f64 > REPEATED * samples.len() as f64
}

/// The better of a diagnosis and the one with the command held; what was taken for granted is said.
pub(crate) fn likelier(as_lines: Diagnosis, held: Diagnosis, model: &Model) -> Diagnosis {
    let needs_fewer = laws_needed(&held) < laws_needed(&as_lines);
    let ratio = rms_ratio(&held, &as_lines);
    let is_held = if needs_fewer { ratio < NO_WORSE } else { ratio < BETTER };
    if !is_held {
        return as_lines;
    }
    let column = model.input().map_or_else(String::new, |input| input.column.clone());
    let instead: Vec<String> = as_lines
        .effects
        .iter()
        .filter(|effect| is_late(&effect.id))
        .map(|effect| format!("{} at the {}", effect.id.replace('_', " "), effect.location))
        .collect();
    let instead = if instead.is_empty() {
        "the recordings are explained better so".to_owned()
    } else {
        format!("read as straight lines it needs {} besides", instead.join(" and "))
    };
    let mut held = held;
    held.caps.push(format!(
        "{column} was taken to be held from one sample to the next, as a digital controller holds it: {instead}; \
         say hold = \"zero\" or hold = \"first\" in the model's [input] if it is known"
    ));
    held
}

/// Laws that a diagnosis needs, a finding being worth more than none.
fn laws_needed(found: &Diagnosis) -> usize {
    if found.verdict == Verdict::Unexplained { usize::MAX } else { found.effects.len() }
}

/// Geometric mean over outputs, training and held-out recordings each, of what one diagnosis' model leaves,
/// over what the other's does.
fn rms_ratio(of: &Diagnosis, over: &Diagnosis) -> f64 {
    let left = |found: &Diagnosis| -> Vec<f64> {
        let pooled = found.fit.pooled.iter();
        pooled.map(|pooled| pooled.fits.extended.unwrap_or(pooled.fits.refitted_linear).rms).collect()
    };
    let (of, over) = (left(of), left(over));
    let logarithms = of.iter().zip(&over).map(|(of, over)| (of / over).ln());
    (logarithms.sum::<f64>() / of.len().max(1) as f64).exp()
}
