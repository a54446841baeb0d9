//! A wave along the travel, begun where the machine was seen to go.
//!
//! A body that nothing holds adds up what pushes it: simulated without the wave, or with another one, it
//! comes to lie elsewhere on the true wave than the machine did, and the fit of a period has as many valleys
//! as that. Where an encoder shows the place, the wave's force is a sine of what was recorded, whatever the
//! model makes of it, and what it does to the outputs is a straight line in its two amplitudes: every period
//! is tried in turn, the other parameters following along straight lines. (The regressor is the recorded
//! place instead of the simulated one, an equation error: the encoder's noise weakens a wave of `P` by
//! `exp(−2 (π σ/P)²)`, which only says where a fit by simulation begins.)

use std::f64::consts::FRAC_PI_2;

use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};
use stillbeam_plant::catalogue::Trial;
use stillbeam_plant::{Motion, Physics, StateSpace, force_along};
use stillbeam_recording::Role;

use super::lines_over_position::{frequencies_along, of_both, tops};
use super::other_valleys::is_held;
use super::selection::Search;
use super::sets::Member;
use super::trials::Candidate;
use crate::effort::Effort;
use crate::fit::{Fitted, Others};
use crate::parameters::FreeParameter;
use crate::record::Record;
use crate::simulation::{Hypothesis, first_effect, motion};
use crate::stacking::Stack;

/// Lines are fitted from that have at least this share of the power of what is left without the wave, ...
const STANDS_OUT: f64 = 0.3;
/// ... these many, the highest first.
const FITTED: usize = 2;
/// Straight lines along which the other parameters follow, one after another, ...
const FOLLOWED: usize = 4;
/// ... none by more than this, in search coordinates.
const LONGEST: f64 = 0.5;
/// Periods on either side that are tried again then.
const NEARBY: i32 = 8;

/// A wave, by how much its amplitude is to be multiplied, and the share of what is left that it takes away.
struct Line {
    wave: Trial,
    factor: f64,
    share: f64,
}

/// A model without the wave, the machine's travel as it was recorded, and what the other parameters could
/// absorb.
struct Travelled<'t> {
    stack: &'t Stack<'t>,
    without: Fitted,
    /// Where the wave acts.
    point: usize,
    travels: Vec<Motion>,
    residuals: Vec<f64>,
    absorbing: Orthonormal,
}

impl Search<'_> {
    /// The set with its waves as the recorded travel shows them, or as they are where that fits better;
    /// `None` where no travel was recorded or no wave stands out.
    pub(super) fn waves_as_recorded(&self, member: &Member) -> Option<Member> {
        let mut best: Option<Member> = None;
        for candidate in member.laws.clone() {
            let from = best.as_ref().unwrap_or(member);
            best = self.wave_as_recorded(from, candidate).or(best);
        }
        best
    }

    fn wave_as_recorded(&self, member: &Member, law: usize) -> Option<Member> {
        let place = member.laws.iter().position(|other| *other == law)?;
        let (hypothesis, free, values) = self.lacking(member, place);
        let stack = self.study.stack(Role::Train);
        let without = reckoned(&stack, &hypothesis, &free, &values, &member.fitted.initial_states())?;
        let others = member.laws.iter().copied().filter(|other| *other != law).collect();
        let found =
            self.wave_read_off(&Member { laws: others, fitted: without, held_out: Vec::new() }, law)?;
        let is_better = found.fitted.sum_of_squares < member.fitted.sum_of_squares;
        Some(if is_better { found } else { member.clone() })
    }

    /// The fit of a set with a wave besides, begun so where nothing holds the machine: without the wave it
    /// went elsewhere, and what the screen saw of one there says little.
    pub(super) fn wave_where_it_went(&self, without: &Member, law: usize) -> Option<Fitted> {
        let drifts = || !is_held(&without.fitted.hypothesis.model);
        (self.is_wave(law) && drifts()).then(|| self.wave_read_off(without, law))?.map(|set| set.fitted)
    }

    /// A set with a wave besides, as the recorded travel shows it; `None` where that was not recorded or no
    /// wave stands out.
    pub(super) fn wave_read_off(&self, without: &Member, law: usize) -> Option<Member> {
        let candidate = &self.candidates[law];
        let wave = candidate.trials.iter().find(|trial| trial.period().is_some())?;
        let stack = self.study.stack(Role::Train);
        let travelled = Travelled::new(&stack, &candidate.physics(wave, 1.0), without.fitted.clone())?;
        let places = || travelled.travels.iter().flat_map(|travel| travel.points[travelled.point][0].iter());
        let frequencies = frequencies_along(candidate, || places().copied());
        let line = |per_unit: f64| travelled.line(candidate, &wave.with_period(per_unit.recip())?);
        let mut lines = tops(&frequencies, STANDS_OUT, line, |line| line.share);
        lines.sort_by(|a, b| b.share.total_cmp(&a.share));
        lines.truncate(FITTED);
        let finer = frequencies.get(1)? - frequencies.first()?;
        let fitted = lines.into_iter().filter_map(|line| {
            let (without_it, line) = travelled.followed(candidate, line, finer);
            let without_it = Member { fitted: without_it, ..without.clone() };
            let physics = candidate.physics(&line.wave, line.factor);
            let number = self.given_laws + without.laws.len() + 1;
            let amplitudes = candidate.amplitude_names();
            let begun = self.extended(&without_it, law, &physics, number, &amplitudes, Others::Searched)?;
            let fitted = self.fitted_on(&begun, Effort::TRIAL).unwrap_or(begun);
            self.member([&without.laws[..], &[law]].concat(), fitted)
        });
        fitted.min_by(|a, b| a.fitted.sum_of_squares.total_cmp(&b.fitted.sum_of_squares))
    }
}

/// A hypothesis with these values on the training recordings.
fn reckoned(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    free: &[FreeParameter],
    values: &[f64],
    starts: &[Vec<f64>],
) -> Option<Fitted> {
    let hypothesis = hypothesis.with_values(free, values)?;
    let records = stack.evaluate(&hypothesis, starts)?;
    let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
    Some(Fitted { hypothesis, free: free.to_vec(), values: values.to_vec(), records, sum_of_squares })
}

impl<'t> Travelled<'t> {
    /// `None` where the place of the law was not recorded on every recording.
    fn new(stack: &'t Stack<'t>, law: &Physics, without: Fitted) -> Option<Self> {
        let fits = without.records.iter().zip(&stack.records);
        let moved = fits.map(|(fit, record)| motion(&without.hypothesis, record, &fit.initial));
        let mut travels = moved.collect::<Option<Vec<Motion>>>()?;
        let forces = force_along(&without.hypothesis.model, law, travels.first()?).ok()?;
        let point = forces.first()?.point;
        let output = output_of(&without, point)?;
        for (travel, record) in travels.iter_mut().zip(&stack.records) {
            travel.points[point][0] = as_recorded(record, output, &travel.points[point][0])?;
        }
        let mut absorbing = Orthonormal::default();
        without.rough_sensitivities(stack).into_iter().for_each(|column| absorbing.push(column));
        let mut residuals = without.residuals();
        absorbing.remove_from(&mut residuals);
        Some(Self { stack, without, point, travels, residuals, absorbing })
    }

    /// The other parameters where they follow to, and the wave beside them: straight lines again and again.
    fn followed(&self, candidate: &Candidate, line: Line, finer: f64) -> (Fitted, Line) {
        let mut reached = (self.without.clone(), line);
        let mut here: Option<Self> = None;
        for _ in 0..FOLLOWED {
            let at = here.as_ref().unwrap_or(self);
            let Some((next, line)) = at.step(candidate, &reached.1, finer) else { break };
            reached = (next.without.clone(), line);
            here = Some(next);
        }
        reached
    }

    /// One such line.
    fn step(&self, candidate: &Candidate, line: &Line, finer: f64) -> Option<(Self, Line)> {
        let mut rest = self.without.residuals();
        add_scaled(&mut rest, -line.factor, &self.bare_effect(candidate, &line.wave)?);
        let by = self.absorbing.coefficients(&self.absorbing.remove_from(&mut rest));
        let rows = self.without.free.iter().zip(&self.without.values).zip(by);
        let moved = rows.map(|((free, value), by)| {
            let by = by.clamp(-LONGEST, LONGEST);
            free.to_value(free.to_search(*value) + by).max(free.lower).min(free.upper)
        });
        let moved: Vec<f64> = moved.collect();
        let Fitted { hypothesis, free, .. } = &self.without;
        let without = reckoned(self.stack, hypothesis, free, &moved, &self.without.initial_states())?;
        let next = Self::new(self.stack, &candidate.physics(&line.wave, 1.0), without)?;
        let here = line.wave.period()?.recip();
        let around = (-NEARBY..=NEARBY).map(|k| here + finer * f64::from(k) / f64::from(NEARBY));
        let lines =
            around.filter_map(|per_unit| next.line(candidate, &line.wave.with_period(per_unit.recip())?));
        let line = lines.max_by(|a, b| a.share.total_cmp(&b.share))?;
        Some((next, line))
    }
}

impl Travelled<'_> {
    /// The wave of this trial's period.
    fn line(&self, candidate: &Candidate, wave: &Trial) -> Option<Line> {
        let ahead = wave.turned(FRAC_PI_2)?;
        let [sine, cosine] = [self.effect(candidate, wave)?, self.effect(candidate, &ahead)?];
        let parts = of_both([&sine, &cosine], &self.residuals)?;
        let explained = parts[0] * dot(&sine, &self.residuals) + parts[1] * dot(&cosine, &self.residuals);
        let (wave, factor) = wave.combined(parts, &ahead)?;
        Some(Line { wave, factor, share: explained / dot(&self.residuals, &self.residuals) })
    }

    /// What a wave does to the outputs along the recorded travel, what could be absorbed taken out.
    fn effect(&self, candidate: &Candidate, wave: &Trial) -> Option<Vec<f64>> {
        let mut own = self.bare_effect(candidate, wave)?;
        self.absorbing.remove_from(&mut own);
        Some(own)
    }

    /// The same with what could be absorbed.
    fn bare_effect(&self, candidate: &Candidate, wave: &Trial) -> Option<Vec<f64>> {
        let law = candidate.physics(wave, 1.0);
        let mut whole = Vec::with_capacity(self.residuals.len());
        for (index, travel) in self.travels.iter().enumerate() {
            let record = self.stack.records[index];
            let signals = first_effect(&self.without.hypothesis, record, &law, travel)?;
            let mut own = self.stack.weighted(index, &signals);
            self.without.records[index].nuisances.remove_from(&mut own);
            whole.extend(own);
        }
        Some(whole)
    }
}

/// The output that shows where a point is.
fn output_of(fitted: &Fitted, point: usize) -> Option<usize> {
    let space = StateSpace::new(&fitted.hypothesis.model).ok()?;
    let place = &space.points()[point].displacement;
    space.outputs().iter().position(|output| output.row == *place)
}

/// A simulated travel corrected by what was recorded of it; straight lines between samples that are apart. A
/// body that nothing holds is where its encoder says: its place and the encoder's zero are one and the same
/// (see [`Stack`]).
fn as_recorded(record: &Record, output: usize, simulated: &[f64]) -> Option<Vec<f64>> {
    let signal = record.outputs.iter().find(|signal| signal.index == output)?;
    let samples = signal.at.iter().zip(&signal.samples);
    let departures: Vec<f64> = samples.map(|(&k, sample)| sample - simulated[k]).collect();
    let last = signal.at.len().checked_sub(1)?;
    let departure = |k: usize| {
        let after = signal.at.partition_point(|&at| at < k).min(last);
        let before = if signal.at[after] > k { after.saturating_sub(1) } else { after };
        let [from, to] = [signal.at[before], signal.at[after]].map(|at| at as f64);
        let share = if to > from { ((k as f64 - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        departures[before] + share * (departures[after] - departures[before])
    };
    Some(simulated.iter().enumerate().map(|(k, place)| place + departure(k)).collect())
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Model, Physics};
    use stillbeam_recording::{Recording, Role};

    use super::as_recorded;
    use crate::axis_in_loop::{axis, noisy_runs_over};
    use crate::naming::on_a_spring::{fitted_with, noisy_runs, searched_around, unheld};
    use crate::naming::sets::Member;
    use crate::naming::trials::Candidate;
    use crate::record::Record;

    fn wave(period: f64) -> Physics {
        Physics::new("cogging", "mass").with("force", 0.37).with("period", period).with("phase", 0.2)
    }

    /// Fits to the beginnings of the recordings would take the time.
    #[test]
    fn a_wave_is_found_where_the_machine_was_seen_to_go_whatever_period_it_was_fitted_with() {
        let truth = wave(0.047);
        let mut real = unheld();
        real.setup_mut().physics = vec![truth.clone()];
        let train = noisy_runs(&real, &[2.0, 4.0], 1e-4);
        searched_around(&unheld(), &train, &noisy_runs(&real, &[3.0], 1e-4), |search, refitted| {
            let law = |set: &Member| set.fitted.hypothesis.model.setup().physics[0].clone();
            let off = |law: &Physics, name: &str| (law.parameters[name] / truth.parameters[name] - 1.0).abs();
            for period in [0.019, 0.030, 0.085] {
                let stuck = fitted_with(search, &refitted, &wave(period));
                assert!(off(&law(&stuck), "period") > 0.03, "no other valley: {period}");
                let found = law(&search.finished(search.waves_as_recorded(&stuck).unwrap()));
                assert!(off(&found, "period") < 1e-3, "{period}: {found:?}");
                assert!(off(&found, "force") < 1e-2, "{period}: {found:?}");
            }
            let right = fitted_with(search, &refitted, &truth);
            let again = search.waves_as_recorded(&right);
            assert!(again.is_none_or(|again| off(&law(&again), "period") < 1e-3));
        });
    }

    /// A fit from a period far off would take all of the time.
    #[test]
    fn a_motors_ripple_along_the_travel_of_what_nothing_holds_is_read_off() {
        let truth = Physics::new("force_ripple", "drive")
            .with("ripple", 0.3)
            .with("period", 0.047)
            .with("phase", 0.2);
        let mut real = unheld();
        real.setup_mut().physics = vec![truth.clone()];
        let train = noisy_runs(&real, &[2.0, 4.0], 1e-4);
        searched_around(&unheld(), &train, &noisy_runs(&real, &[3.0], 1e-4), |search, refitted| {
            let is_it = |candidate: &Candidate| candidate.law.id() == "force_ripple";
            let law = search.candidates.iter().position(is_it).unwrap();
            let found = search.finished(search.wave_read_off(&refitted, law).unwrap());
            let found = found.fitted.hypothesis.model.setup().physics[0].clone();
            let off = |name: &str| (found.parameters[name] / truth.parameters[name] - 1.0).abs();
            assert!(off("period") < 1e-3 && off("ripple") < 1e-2, "{found:?}");
        });
    }

    /// A wave that is stiffer than the loop holds the slide in its hollows. The refit makes a weight of a
    /// hundredth of it, beside which a wave of half the period is found.
    #[test]
    fn a_wave_from_the_hollows_of_which_a_loop_pulls_a_slide_is_read_off() {
        let mut soft = axis();
        let controller = soft.setup_mut().controller.as_mut().unwrap();
        (controller.kp, controller.kv) = (10.0, 600.0);
        let truth =
            Physics::new("cogging", "slider").with("force", 60.0).with("period", 0.013).with("phase", -1.4);
        let mut real = soft.clone();
        real.setup_mut().physics = vec![truth.clone()];
        let noisy = |travels_m: &[f64]| noisy_runs_over(&real, travels_m, 1e-4);
        searched_around(&soft, &noisy(&[0.02, 0.09]), &noisy(&[0.06]), |search, refitted| {
            let law = search.candidates.iter().position(|candidate| candidate.law.id() == "cogging").unwrap();
            let found = search.finished(search.wave_read_off(&refitted, law).unwrap());
            let found = found.fitted.hypothesis.model.setup().physics[0].clone();
            let off = |name: &str| (found.parameters[name] / truth.parameters[name] - 1.0).abs();
            assert!(off("period") < 1e-3 && off("force") < 1e-2, "{found:?}");
        });
    }

    /// A wave on a body of which another one's place is recorded says nothing of where it went.
    #[test]
    fn where_the_place_was_not_recorded_no_wave_is_read_off() {
        let text = r#"
            schema = 1
            kind = "lumped"
            body = [{ name = "mass", mass = 2.5 }, { name = "load", mass = 0.4 }]
            spring = [{ between = ["mass", "load"], stiffness = 900.0 }]
            damper = [{ between = ["mass", "ground"], damping = 10.0 }, { between = ["mass", "load"], damping = 1.0 }]
            input = { column = "force_N", body = "mass" }
            output = [{ column = "position_m", body = "load" }]
        "#;
        let given = Model::from_toml("two.toml", text).unwrap();
        let mut real = given.clone();
        real.setup_mut().physics = vec![wave(0.047)];
        let train = noisy_runs(&real, &[2.0, 4.0], 1e-4);
        searched_around(&given, &train, &noisy_runs(&real, &[3.0], 1e-4), |search, refitted| {
            let stuck = fitted_with(search, &refitted, &wave(0.030));
            assert!(search.waves_as_recorded(&stuck).is_none());
        });
    }

    /// The encoder is slower than the input and lost samples.
    #[test]
    fn a_travel_is_joined_between_its_samples() {
        let time_s: Vec<f64> = (0..2000).map(|k| 0.01 * f64::from(k)).collect();
        let went = |t: f64| if t < 0.7 { 0.0 } else { 0.02 * (t - 0.7) };
        let read = |k: usize, t: f64| {
            if k.is_multiple_of(3) && !(900..960).contains(&k) { went(t) } else { f64::NAN }
        };
        let recording = Recording::new("slow", time_s.clone())
            .with_column("force_N", time_s.iter().map(|t| (0.3 * t).sin()).collect())
            .with_column("position_m", time_s.iter().enumerate().map(|(k, t)| read(k, *t)).collect());
        let record = Record::new(&recording, Role::Train, &unheld(), None, None).unwrap();
        let simulated: Vec<f64> = time_s.iter().map(|t| 0.8 * went(*t)).collect();
        let travel = as_recorded(&record, 0, &simulated).unwrap();
        let worst = travel.iter().zip(&time_s).map(|(z, t)| (z - went(*t)).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-4, "{worst}");
        assert!(as_recorded(&record, 1, &simulated).is_none());
    }
}
