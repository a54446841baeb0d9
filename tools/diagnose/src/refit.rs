//! Refit of a model within its own parameters: which of them are free, and where their search starts.

use stillbeam_identify::tall::dot;

use crate::determined::Determined;
use crate::effort::Effort;
use crate::error::DiagnoseError;
use crate::fit::{Fitted, fit};
use crate::frequency_scan::{IN_STEP, SCAN_REACHES, WIDE_SCAN_REACHES, largest_share, scanned};
use crate::parameters::{FreeParameter, free_parameters};
use crate::record::Record;
use crate::simulation::{Hypothesis, frequency_range_hz};
use crate::stacking::{RecordFit, Stack};

/// A refit, and the paths of the parameters that the recordings could not tell apart.
type Refitted = Result<(Fitted, Vec<String>), DiagnoseError>;

/// Refits the model within its own parameters.
///
/// Parameters that the recordings cannot tell apart from those before them in the list stay as given, or
/// where an earlier fit took them where those others cannot make up for the way back; their paths are
/// returned too.
pub(crate) fn refit(stack: &Stack<'_>, given: &Hypothesis, candidates: &[FreeParameter]) -> Refitted {
    let in_its_valley = |stack: &Stack<'_>, effort| refit_in_its_valley(stack, given, candidates, effort);
    with_some_samples_first(stack, given, candidates, &in_its_valley)
}

/// A refit that is begun with some of the samples, where looking at all of them is much work, and goes on
/// with all from there. Where more is missing than noise hides, how well the rest is known hangs on that, and
/// it goes on for a few steps only.
fn with_some_samples_first(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    refit: &dyn Fn(&Stack<'_>, Effort) -> Refitted,
) -> Refitted {
    let Some(thin) = thinned(stack, given, candidates) else { return refit(stack, Effort::FULL) };
    let thin = Stack { records: thin.iter().collect(), ..stack.clone() };
    let (begun, _) = refit(&thin, Effort::FULL.to_within(TO_BEGIN_WITH))?;
    let is_loud = begun.sum_of_squares > LOUDLY * thin.present() as f64;
    let effort = if is_loud { Effort::BEGIN } else { Effort::FULL };
    refit_at(stack, given, candidates, started_from(candidates, &begun), &[], effort)
}

/// The recordings with as many of their samples as are enough to begin with, where looking at all of them is
/// much work; `None` where all are looked at.
fn thinned(stack: &Stack<'_>, given: &Hypothesis, candidates: &[FreeParameter]) -> Option<Vec<Record>> {
    let is_driven = stack.records.iter().all(|record| record.input.is_some());
    if stack.present() * candidates.len() < MUCH_TO_FIT || !is_driven || !stack.is_even() {
        return None;
    }
    let (_, fastest_hz) = frequency_range_hz(&given.model).ok()?;
    let fastest_hz = fastest_hz.filter(|hz| *hz > 0.0)?;
    let rate_hz = stack.records.iter().map(|record| record.rate_hz(0)).fold(f64::INFINITY, f64::min);
    let nth = rate_hz / (ENOUGH_IN_A_PERIOD * fastest_hz);
    (nth >= 2.0).then(|| stack.records.iter().map(|record| record.thinned(nth as usize)).collect())
}

/// Samples times parameters from which a refit begins with some of the samples ...
const MUCH_TO_FIT: usize = 1_500_000;
/// ... in every period of the model's fastest motion, ...
const ENOUGH_IN_A_PERIOD: f64 = 4.0;
/// ... as long as a step gains this share of what is left.
const TO_BEGIN_WITH: f64 = 1e-4;
/// More is missing than noise hides where so many times the noise's power is left.
const LOUDLY: f64 = 4.0;

/// Looks for the frequencies first, then fits everything.
fn refit_in_its_valley(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    effort: Effort,
) -> Refitted {
    let drawn = given_values(candidates);
    let from = |start: &[f64], effort| refit_at(stack, given, candidates, start.to_vec(), &[], effort);
    let near = scanned(stack, given, candidates, &drawn, &SCAN_REACHES);
    let fitted = from(&near, effort);
    let is_driven = stack.records.iter().all(|record| record.input.is_some());
    let fits_well = |(fitted, _): &(Fitted, _)| largest_share(stack, &fitted.records) < WELL_FITTED;
    if !is_driven || fitted.as_ref().is_ok_and(fits_well) || stack.is_over() {
        return fitted;
    }
    // A valley beside the right one may look like it before everything is fitted in it.
    let wide = scanned(stack, given, candidates, &drawn, &WIDE_SCAN_REACHES);
    if near.iter().zip(&wide).all(|(near, wide)| (wide / near).ln().abs() <= SAME_VALLEY) {
        return fitted;
    }
    // A machine that far from the drawing has to explain what it was made for; of an output that a sensor or
    // a drive spoils any machine explains a little more than the right one.
    let least = fitted.as_ref().map_or(f64::INFINITY, |(fitted, _)| fitted.sum_of_squares);
    let explains = |(far, _): &(Fitted, _)| {
        far.sum_of_squares < LESS * least && largest_share(stack, &far.records) < IN_STEP
    };
    match from(&wide, Effort::BEGIN) {
        Ok(far) if explains(&far) => from(&started_from(candidates, &far.0), effort).or(fitted),
        _ => fitted,
    }
}

/// A refit that leaves less than this share of every output, root mean square, is in the right valley, ...
const WELL_FITTED: f64 = 0.03;
/// ... and starts whose parameters differ by no more than this, in logarithms, are in the same one.
const SAME_VALLEY: f64 = 0.02;

/// The same from where an earlier refit ended.
pub(crate) fn refit_from(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    before: &Fitted,
) -> Refitted {
    let start = started_from(candidates, before);
    let from_start =
        |stack: &Stack<'_>, effort| refit_at(stack, given, candidates, start.clone(), &[], effort);
    with_some_samples_first(stack, given, candidates, &from_start)
}

/// A set of laws fitted again with the model's own parameters, which of those are free decided anew; those
/// that are not are at their given values, which `hypothesis` has. Not to the end: the search goes on from
/// here, and what it chooses is finished then.
pub(crate) fn refit_beside_laws(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    before: &Fitted,
) -> Option<Fitted> {
    let there = refit_from_there(stack, hypothesis, before);
    // No other start leaves less than noise.
    let noise = NOISE * stack.present() as f64;
    if stack.is_over() || there.as_ref().is_some_and(|there| there.sum_of_squares < noise) {
        return there;
    }
    // Without the laws the model's own parameters may have gone far to make up for them; the drawing may be
    // nearer.
    let drawn = refit_from_drawing(stack, hypothesis, before, Effort::TRIAL);
    there.into_iter().chain(drawn).min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares))
}

/// The same from where an earlier fit of these laws ended, and from nowhere else.
pub(crate) fn refit_from_there(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    before: &Fitted,
) -> Option<Fitted> {
    let candidates = beside_laws(hypothesis, before);
    let start = started_from(&candidates, before);
    let states = before.initial_states();
    refit_at(stack, hypothesis, &candidates, start, &states, Effort::TRIAL).ok().map(|(fitted, _)| fitted)
}

/// The parameters of the laws of a fit, and all of the model's own.
fn beside_laws(hypothesis: &Hypothesis, before: &Fitted) -> Vec<FreeParameter> {
    let laws = before.free.iter().filter(|parameter| parameter.is_added).cloned();
    laws.chain(free_parameters(hypothesis)).collect()
}

/// A set of laws fitted again, the model's own parameters from the drawing, which of them are free decided
/// anew.
pub(crate) fn refit_from_drawing(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    before: &Fitted,
    effort: Effort,
) -> Option<Fitted> {
    let candidates = beside_laws(hypothesis, before);
    let there = started_from(&candidates, before).into_iter().zip(&candidates);
    let start = there.map(|(value, parameter)| if parameter.is_added { value } else { parameter.given });
    let mut start: Vec<f64> = start.collect();
    if is_far_anywhere(before) {
        start = scanned(stack, hypothesis, &candidates, &start, &SCAN_REACHES);
    }
    refit_at(stack, hypothesis, &candidates, start, &[], effort).ok().map(|(fitted, _)| fitted)
}

/// Whether a parameter of the model is further from its given value than that can be wrong.
pub(crate) fn is_far_anywhere(fitted: &Fitted) -> bool {
    fitted.free.iter().zip(&fitted.values).any(|(parameter, value)| is_far(parameter, *value))
}

fn is_far(parameter: &FreeParameter, value: f64) -> bool {
    let is_known = !parameter.is_added && parameter.given > 0.0 && value > 0.0;
    is_known && (value / parameter.given).ln().abs() > parameter.known_within().ln()
}

/// A sum of squares below this many squares per sample is noise's, where outputs are weighted by their noise.
const NOISE: f64 = 1.05;

/// Where an earlier fit ended: also for parameters that it could not tell apart in the end.
fn started_from(candidates: &[FreeParameter], before: &Fitted) -> Vec<f64> {
    let value = |parameter: &FreeParameter| {
        let there = before.hypothesis.model.parameter(&parameter.path);
        there.filter(|value| value.is_finite()).unwrap_or(parameter.given)
    };
    candidates.iter().map(value).collect()
}

fn refit_at(
    stack: &Stack<'_>,
    given: &Hypothesis,
    candidates: &[FreeParameter],
    start: Vec<f64>,
    states: &[Vec<f64>],
    effort: Effort,
) -> Refitted {
    let diverged = || DiagnoseError::Diverged {
        recording: stack.records.first().map_or_else(String::new, |record| record.name.clone()),
    };
    let moved = given.with_values(candidates, &start).ok_or_else(diverged)?;
    let records = stack.evaluate(&moved, states).ok_or_else(diverged)?;
    let sum_of_squares = sum_of_squares(&records);
    let mut at =
        Fitted { hypothesis: moved, free: candidates.to_vec(), values: start, records, sum_of_squares };
    let mut free_before = Vec::new();
    for _ in 0..MOST_CHOICES {
        let choice = Determined::of(stack, &at);
        let paths = choice.paths_left(candidates);
        if choice.kept == free_before {
            return Ok((freed(at, &choice.kept), paths));
        }
        let (fitted, mut all) = fitted_with(stack, &at, &choice, candidates, effort).ok_or_else(diverged)?;
        let kept = choice.kept;
        let settled = fitted.sum_of_squares > LESS * at.sum_of_squares;
        let hypothesis = fitted.hypothesis.clone();
        kept.iter().zip(&fitted.values).for_each(|(&index, value)| all[index] = *value);
        if settled {
            return Ok((fitted, paths));
        }
        let sum_of_squares = fitted.sum_of_squares;
        at = Fitted {
            hypothesis,
            free: candidates.to_vec(),
            values: all,
            records: fitted.records,
            sum_of_squares,
        };
        free_before = kept;
    }
    let (kept, dropped) = (free_before.clone(), (0..candidates.len()).filter(|i| !free_before.contains(i)));
    let paths = dropped.map(|index| candidates[index].path.clone()).collect();
    Ok((freed(at, &kept), paths))
}

/// The fit of the parameters that were chosen, and the values of all candidates it began with.
fn fitted_with(
    stack: &Stack<'_>,
    at: &Fitted,
    choice: &Determined,
    candidates: &[FreeParameter],
    effort: Effort,
) -> Option<(Fitted, Vec<f64>)> {
    let free: Vec<FreeParameter> = choice.kept.iter().map(|&index| candidates[index].clone()).collect();
    let values: Vec<f64> = choice.kept.iter().map(|&index| at.values[index]).collect();
    let base = at.hypothesis.with_given(&choice.dropped, candidates)?;
    let from = |base: &Hypothesis| fit(stack, base, &free, &values, &at.initial_states(), effort);
    let fitted = from(&base)?;
    // A parameter may have gone far before it turned out that others do its work; at its given value the
    // fit is lost.
    if fitted.sum_of_squares > LOST * at.sum_of_squares {
        return Some((from(&at.hypothesis)?, at.values.clone()));
    }
    Some((fitted, given_values(candidates)))
}

/// A fit that leaves this many times what was left before it is lost.
const LOST: f64 = 1.5;
/// Which parameters are free is decided at most this often, ...
const MOST_CHOICES: usize = 4;
/// ... anew when a fit has left less than this share: what is left sets what shows.
const LESS: f64 = 0.5;

fn given_values(candidates: &[FreeParameter]) -> Vec<f64> {
    candidates.iter().map(|parameter| parameter.given).collect()
}

/// The same with only these of its parameters free.
fn freed(fitted: Fitted, kept: &[usize]) -> Fitted {
    Fitted {
        free: kept.iter().map(|&index| fitted.free[index].clone()).collect(),
        values: kept.iter().map(|&index| fitted.values[index]).collect(),
        ..fitted
    }
}

fn sum_of_squares(records: &[RecordFit]) -> f64 {
    records.iter().map(|record| dot(&record.residuals, &record.residuals)).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;
    use stillbeam_plant::{Model, simulate};
    use stillbeam_recording::{Recording, Role};

    use super::*;
    use crate::noise::{NoiseFloor, NoiseSource};
    use crate::options::Options;
    use crate::patience::Patience;
    use crate::study::Study;

    /// Six modes under a force, three outputs.
    fn modes(factor: f64) -> Model {
        let mode = |hz: f64| {
            format!(
                "{{ frequency_hz = {}, damping_ratio = 0.02, participation = [0.4, {}, -0.2] }}",
                factor * hz,
                0.1 * hz
            )
        };
        let modes = [2.1, 3.2, 4.4, 5.3, 7.0, 9.0].map(mode).join(", ");
        let text = format!(
            "schema = 1\nkind = \"modal\"\nmode = [{modes}]\ninput = {{ column = \"force_N\" }}\n\
             output = [{{ column = \"a_m\" }}, {{ column = \"b_m\" }}, {{ column = \"c_m\" }}]"
        );
        Model::from_toml("modes.toml", &text).unwrap()
    }

    /// A minute of a sweep at 400 Hz.
    fn swept() -> Recording {
        let time_s: Vec<f64> = (0..24_000).map(|k| 0.0025 * f64::from(k)).collect();
        let force = time_s.iter().map(|t| (TAU * (1.0 * t + 0.09 * t * t)).sin()).collect();
        let run =
            simulate(&modes(1.0), &Recording::new("swept", time_s).with_column("force_N", force)).unwrap();
        let mut noisy = run.clone();
        for (index, column) in noisy.columns.iter_mut().enumerate().filter(|(_, c)| c.name != "force_N") {
            let wave = |k: usize| 1e-5 * (1.7 * ((k * (3 + index)) % 1009) as f64).sin();
            column.samples.iter_mut().enumerate().for_each(|(k, sample)| *sample += wave(k));
        }
        noisy
    }

    #[test]
    fn a_refit_that_begins_with_some_samples_ends_where_one_of_all_does() {
        let given = modes(1.015);
        let study =
            Study::new(&given, std::slice::from_ref(&swept()), std::slice::from_ref(&swept())).unwrap();
        let (stack, given) = (study.stack(Role::Train), Hypothesis::given(&given));
        let candidates = free_parameters(&given);
        let thin = thinned(&stack, &given, &candidates).expect("much work");
        assert!(thin[0].time_s.len() * 5 < stack.records[0].time_s.len());
        let (begun, _) = refit(&stack, &given, &candidates).unwrap();
        let (of_all, _) = refit_in_its_valley(&stack, &given, &candidates, Effort::FULL).unwrap();
        assert!((begun.sum_of_squares / of_all.sum_of_squares - 1.0).abs() < 1e-4);
        for (parameter, (a, b)) in begun.free.iter().zip(begun.values.iter().zip(&of_all.values)) {
            assert!((a / b - 1.0).abs() < 1e-4, "{}: {a} and {b}", parameter.path);
        }
    }

    #[test]
    fn a_refit_ends_where_it_is_when_time_is_spent() {
        let given = modes(1.015);
        let spent = Options { processor_limit_s: Some(-1e6), ..Options::default() };
        let study = Study {
            patience: Some(Patience::new(&spent)),
            ..Study::new(&given, std::slice::from_ref(&swept()), std::slice::from_ref(&swept())).unwrap()
        };
        let given = Hypothesis::given(&given);
        let candidates = free_parameters(&given);
        let (fitted, _) = refit(&study.stack(Role::Train), &given, &candidates).unwrap();
        for (parameter, value) in fitted.free.iter().zip(&fitted.values) {
            assert!((value / parameter.given - 1.0).abs() < 1e-12, "{}", parameter.path);
        }
    }

    /// A loud mode and a faint one, with more keys of the model file.
    fn loud_and_faint(faint_damping_ratio: f64, keys: &str) -> Model {
        let text = format!(
            "schema = 1\nkind = \"modal\"\n\
             mode = [{{ frequency_hz = 1.1, damping_ratio = 0.02, participation = [1.0] }},\n\
             {{ frequency_hz = 6.9, damping_ratio = {faint_damping_ratio}, participation = [0.3] }}]\n\
             output = [{{ column = \"tip_m\" }}]\n{keys}"
        );
        Model::from_toml("loud_and_faint.toml", &text).unwrap()
    }

    /// The faint mode's damping ratio after a refit to 20 s of the free decay of a machine that has this one;
    /// `None` where it stays as given.
    fn refitted_damping_ratio(given: f64, truth: f64, noise_m: f64) -> Option<f64> {
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let let_go = "input = { column = \"force_N\" }\n\
            initial = { \"mode 1\" = { displacement = 0.01 }, \"mode 2\" = { displacement = 0.01 } }";
        let input = Recording::new("decay", time_s.clone()).with_column("force_N", vec![0.0; 2000]);
        let run = simulate(&loud_and_faint(truth, let_go), &input).unwrap();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let readings = run.column("tip_m").unwrap().iter().map(|sample| {
            let normal: f64 = StandardNormal.sample(&mut random);
            sample + noise_m * normal
        });
        let decay = Recording::new("decay", time_s).with_column("tip_m", readings.collect());
        let given = loud_and_faint(given, "");
        let mut study =
            Study::new(&given, std::slice::from_ref(&decay), std::slice::from_ref(&decay)).unwrap();
        let floor = NoiseFloor { rms: noise_m, source: NoiseSource::Repeats, samples: 2000.0 };
        study.weigh_by_floors(&[Some(floor)]);
        let given = Hypothesis::given(&given);
        let (fitted, _) = refit(&study.stack(Role::Train), &given, &free_parameters(&given)).unwrap();
        let place = fitted.free.iter().position(|parameter| parameter.path == "mode.2.damping_ratio")?;
        Some(fitted.values[place])
    }

    #[test]
    fn a_damping_that_is_three_times_the_drawn_one_is_refitted_where_a_twentieth_of_it_would_not_show() {
        for noise_m in [0.8e-3, 1e-3, 1.2e-3] {
            assert_eq!(refitted_damping_ratio(0.005, 0.005, noise_m), None, "it does not show: {noise_m} m");
            let found = refitted_damping_ratio(0.005, 0.015, noise_m).expect("the recording asks for it");
            assert!((found / 0.015 - 1.0).abs() < 0.1, "{found} at {noise_m} m");
        }
    }

    #[test]
    fn a_damping_that_is_ten_times_off_the_drawn_one_is_refitted() {
        for (given, noise_m) in [(0.0015, 0.4e-3), (0.0015, 0.8e-3), (0.16, 0.4e-3), (0.16, 1e-3)] {
            let found = refitted_damping_ratio(given, 0.015, noise_m).expect("the recording asks for it");
            assert!((found / 0.015 - 1.0).abs() < 0.1, "{found} from {given} at {noise_m} m");
        }
    }
}
