//! The diagnosis tried on itself: on this very experiment, with a truth that is known.
//!
//! * **Null**: what the best model simulates without the laws that were named, with what was left over drawn
//!   anew in blocks. Nothing is missing, so nothing may be named. (Where laws were named the refit without
//!   them is another machine, bent to make up for them.)
//! * **Positive**: what the extended model simulated, with new noise. The same laws have to be named.
//! * **Truth left out**: the recordings themselves, the laws that were named struck from the catalogue. No
//!   other law may be named with confidence.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::Serialize;
use stillbeam_plant::Model;
use stillbeam_recording::Recording;

use crate::diagnosis::{Progress, diagnose};
use crate::error::DiagnoseError;
use crate::options::Options;
use crate::result::{Diagnosis, Overlay, RecordRole, Verdict};

/// Seconds of one block of noise.
const BLOCK_S: f64 = 2.0;

/// What the controls found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Controls {
    /// Runs with nothing missing.
    pub null_runs: usize,
    /// In how many of them something was named all the same.
    pub null_named: usize,
    /// How each of them ended.
    pub null_outcomes: Vec<Outcome>,
    /// The rate of false names that 95 % of such outcomes would leave below: `1 − 0.05^(1/n)` when none was
    /// named.
    pub false_name_rate_below: f64,
    /// Runs with the named laws present, as large as they were found; 0 when nothing was named.
    pub positive_runs: usize,
    /// In how many of them exactly they were named.
    pub positive_named: usize,
    /// The verdict with the named laws struck from the catalogue; `None` when nothing was named.
    pub without_truth: Option<Verdict>,
    /// What was named then.
    pub named_without_truth: Vec<String>,
}

/// How one run of a control ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Its verdict.
    pub verdict: Verdict,
    /// What was named, as `law at location`.
    pub named: Vec<String>,
}

impl Outcome {
    fn of(found: &Diagnosis) -> Self {
        Self { verdict: found.verdict, named: names(found) }
    }
}

fn names(found: &Diagnosis) -> Vec<String> {
    found.effects.iter().map(|effect| format!("{} at {}", effect.id, effect.location)).collect()
}

impl Controls {
    /// The outcome in words.
    pub fn sentence(&self) -> String {
        let mut said = format!(
            "Controls: with nothing missing something was named in {} of {} runs (the true rate is below {:.0} % with 95 % confidence).",
            self.null_named,
            self.null_runs,
            100.0 * self.false_name_rate_below
        );
        let named = self.null_outcomes.iter().filter(|outcome| !outcome.named.is_empty());
        let named: Vec<String> = named.map(|outcome| outcome.named.join(" with ")).collect();
        if !named.is_empty() {
            said.push_str(&format!(" Named there: {}.", named.join("; ")));
        }
        let unexplained =
            self.null_outcomes.iter().filter(|outcome| outcome.verdict == Verdict::Unexplained).count();
        if unexplained > 0 {
            said.push_str(&format!(
                " In {unexplained} of them something was held to be missing and not named: an unexplained rest says little on this experiment."
            ));
        }
        if self.positive_runs > 0 {
            said.push_str(&format!(
                " With the physics found built in, exactly that was named in {} of {} runs.",
                self.positive_named, self.positive_runs
            ));
        }
        match &self.without_truth {
            Some(_) if self.named_without_truth.is_empty() => {
                said.push_str(" Struck from the catalogue, nothing else is named in its place.");
            }
            Some(_) => said.push_str(&format!(
                " Struck from the catalogue, {} takes its place: what is named is an effective description.",
                self.named_without_truth.join(" with ")
            )),
            None => {}
        }
        said
    }
}

/// Runs the controls; `runs` is the number of null runs, and half as many positive ones are made.
///
/// # Errors
/// [`DiagnoseError`] as of the diagnosis itself.
pub fn controls(
    model: &Model,
    recordings: &[Recording],
    held_out: &[Recording],
    options: &Options,
    found: &Diagnosis,
    runs: usize,
    progress: &mut dyn FnMut(&Progress),
) -> Result<Controls, DiagnoseError> {
    let named = names(found);
    let positive_runs = if named.is_empty() { 0 } else { runs.div_ceil(2) };
    let all = (runs + positive_runs + usize::from(!named.is_empty())).max(1);
    let mut done = 0;
    let mut say = |what: &str| {
        progress(&Progress {
            step: format!("control {} of {all}: {what}", done + 1),
            done: done as f64 / all as f64,
        });
        done += 1;
    };
    let mut quiet = |_: &Progress| {};
    let mut null_outcomes = Vec::new();
    for run in 0..runs {
        say("nothing is missing");
        let (train, held) = remake(found, recordings, held_out, without_effects, 1 + run as u64);
        null_outcomes.push(Outcome::of(&diagnose(model, &train, &held, options, &mut quiet)?));
    }
    let mut positive_named = 0;
    for run in 0..positive_runs {
        say("the named physics is there");
        let (train, held) = remake(found, recordings, held_out, as_found, 1001 + run as u64);
        let again = diagnose(model, &train, &held, options, &mut quiet)?;
        let mut found_again = names(&again);
        found_again.sort();
        let mut wanted = named.clone();
        wanted.sort();
        positive_named += usize::from(found_again == wanted);
    }
    let mut without_truth = None;
    let mut named_without_truth = Vec::new();
    if !named.is_empty() {
        say("the named physics is struck from the catalogue");
        let mut struck = options.clone();
        struck.without.extend(found.effects.iter().map(|effect| effect.id.clone()));
        let without = diagnose(model, recordings, held_out, &struck, &mut quiet)?;
        without_truth = Some(without.verdict);
        named_without_truth = names(&without);
    }
    let null_named = null_outcomes.iter().filter(|outcome| !outcome.named.is_empty()).count();
    Ok(Controls {
        null_runs: runs,
        null_named,
        null_outcomes,
        false_name_rate_below: rate_below(null_named, runs),
        positive_runs,
        positive_named,
        without_truth,
        named_without_truth,
    })
}

/// Upper end of the one-sided 95 % interval of C. Clopper and E. Pearson for a rate, by bisection.
fn rate_below(seen: usize, of: usize) -> f64 {
    if of == 0 || seen >= of {
        return 1.0;
    }
    let at_most = |rate: f64| -> f64 {
        let mut term = (1.0 - rate).powi(i32::try_from(of).unwrap_or(i32::MAX));
        let mut sum = term;
        for k in 0..seen {
            term *= (of - k) as f64 / (k + 1) as f64 * rate / (1.0 - rate);
            sum += term;
        }
        sum
    };
    let (mut low, mut high) = (0.0, 1.0 - 1e-12);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(middle) > 0.05 { low = middle } else { high = middle }
    }
    high
}

/// What the best model leaves over.
fn rest(overlay: &Overlay) -> &[f64] {
    overlay.extended_residual.as_deref().unwrap_or(&overlay.refitted_residual)
}

/// What the best model makes of a recording.
fn as_found(overlay: &Overlay) -> Vec<f64> {
    overlay.recorded.iter().zip(rest(overlay)).map(|(recorded, rest)| recorded - rest).collect()
}

/// The same without the laws that were named.
fn without_effects(overlay: &Overlay) -> Vec<f64> {
    let refitted = || {
        let pairs = overlay.recorded.iter().zip(&overlay.refitted_residual);
        pairs.map(|(recorded, rest)| recorded - rest).collect()
    };
    overlay.without_effects.clone().unwrap_or_else(refitted)
}

/// All recordings with their outputs made anew: `clean`, and noise drawn from the rest of the best model.
fn remake(
    found: &Diagnosis,
    recordings: &[Recording],
    held_out: &[Recording],
    clean: fn(&Overlay) -> Vec<f64>,
    seed: u64,
) -> (Vec<Recording>, Vec<Recording>) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut of = |recording: &Recording, held_out: bool| -> Recording {
        let mut made = recording.clone();
        // A recording cut in two, or held out without having been given as such, is found by its name's
        // beginning.
        let halves = format!("{}, ", recording.name);
        let is_mine = |name: &str| name == recording.name || name.starts_with(&halves);
        let mine = found.overlays.iter().filter(|overlay| is_mine(&overlay.recording));
        for overlay in mine.filter(|overlay| !held_out || overlay.role == RecordRole::HeldOut) {
            let clean = clean(overlay);
            let noise = drawn(rest(overlay), &overlay.time_s, &mut random);
            let Some(column) = made.columns.iter_mut().find(|column| column.name == overlay.output) else {
                continue;
            };
            for (k, time_s) in overlay.time_s.iter().enumerate() {
                let place = recording.time_s.partition_point(|stamp| *stamp < time_s - 1e-9);
                if let Some(sample) = column.samples.get_mut(place) {
                    *sample = clean[k] + noise[k];
                }
            }
        }
        made
    };
    let train = recordings.iter().map(|recording| of(recording, false)).collect();
    let held = held_out.iter().map(|recording| of(recording, true)).collect();
    (train, held)
}

/// As many samples of noise, in blocks from anywhere and of either sign: the colour within a block stays.
fn drawn(noise: &[f64], time_s: &[f64], random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return Vec::new() };
    let rate_hz = (time_s.len() - 1) as f64 / (last - first).max(1e-9);
    let block = ((BLOCK_S * rate_hz) as usize).clamp(1, noise.len().max(1));
    let mut drawn = Vec::with_capacity(noise.len() + block);
    while drawn.len() < noise.len() {
        let word = random.next_u64();
        let start = (word >> 1) as usize % (noise.len() - block + 1);
        let sign = if word & 1 == 0 { 1.0 } else { -1.0 };
        drawn.extend(noise[start..start + block].iter().map(|value| sign * value));
    }
    drawn.truncate(noise.len());
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_with_nothing_missing_say_how_they_ended() {
        let of = |verdict: Verdict, named: &[&str]| Outcome {
            verdict,
            named: named.iter().map(|&name| name.to_owned()).collect(),
        };
        let said = |null_outcomes: Vec<Outcome>| {
            let null_named = null_outcomes.iter().filter(|outcome| !outcome.named.is_empty()).count();
            Controls {
                null_runs: null_outcomes.len(),
                null_named,
                false_name_rate_below: rate_below(null_named, null_outcomes.len()),
                null_outcomes,
                positive_runs: 0,
                positive_named: 0,
                without_truth: None,
                named_without_truth: Vec::new(),
            }
            .sentence()
        };
        let quiet = said(vec![of(Verdict::Adequate, &[]), of(Verdict::Adequate, &[])]);
        assert!(quiet.contains("0 of 2 runs") && !quiet.contains("Named there"), "{quiet}");
        assert!(!quiet.contains("held to be missing"), "{quiet}");
        let loud = said(vec![of(Verdict::Improved, &["delay at drive"]), of(Verdict::Unexplained, &[])]);
        assert!(loud.contains("1 of 2 runs") && loud.contains("Named there: delay at drive."), "{loud}");
        assert!(loud.contains("In 1 of them something was held to be missing and not named"), "{loud}");
    }

    #[test]
    fn a_rate_is_bounded_as_the_books_say() {
        assert!((rate_below(0, 100) - (1.0 - 0.05f64.powf(0.01))).abs() < 1e-9);
        assert!((rate_below(1, 20) - 0.2161).abs() < 1e-3);
        assert!((rate_below(20, 20) - 1.0).abs() < 1e-12);
    }
}
