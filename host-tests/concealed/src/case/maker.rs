//! From a seed and a number to a sealed case: drawn, sized, measured, and drawn again until it is of its
//! kind.

use thiserror::Error;

use super::achievable::achievable;
use super::draw_machine::{Family, frequencies_hz, nominal};
use super::draw_runs::runs;
use super::{Channel, Concealment, Measured, Role, RunPlan, Truth};
use crate::random::Random;
use crate::refit::{Observed, Refit, refit};
use crate::truth::devices::Device;
use crate::truth::law::Physics;
use crate::truth::plant::InputKind;
use crate::truth::run::{Kind, Outcome, Rig};

/// Drawings before a case is given up.
const MOST_DRAWINGS: usize = 90;
/// Drawings of the family that a case's number asks for. Some kinds do not occur in some families (hardly a
/// law of a slide in a position loop hides from a refit of one recording: the loop makes all amplitudes
/// alike), and then any family will do.
const OF_ITS_FAMILY: usize = 15;
/// Readings per second.
pub(super) const RATE_HZ: f64 = 100.0;
/// What a linear refit may leave of a truth without left-out physics, in units of the noise. With a few
/// thousand readings a systematic 3 % of the noise stays within three of its standard errors.
const GOOD_ENOUGH: f64 = 0.03;
/// How far a machine has to move in its training recordings, and in its held-out ones, in units of the noise:
/// a lab whose friction holds the machine fast drives it harder before it asks anybody what is missing.
const LEAST_MOTION: f64 = 10.0;

/// A case that could not be drawn.
#[derive(Debug, Error)]
#[error("case {number}: no drawing out of {MOST_DRAWINGS} was {kind:?}; use another seed")]
pub struct MakeError {
    /// Which case.
    pub number: usize,
    /// What it should have been.
    pub kind: Concealment,
}

/// One recording as a lab has it, and what it would be without noise.
#[derive(Debug, Clone, PartialEq)]
pub struct MadeRun {
    /// What was planned.
    pub plan: RunPlan,
    /// Stamps, seconds.
    pub time_s: Vec<f64>,
    /// Columns of input and reference and what is recorded of them; none of a free decay.
    pub inputs: Vec<(String, Vec<f64>)>,
    /// Recorded readings per channel.
    pub recorded: Vec<Vec<f64>>,
    /// The same without noise.
    pub noise_free: Vec<Vec<f64>>,
}

/// A case with everything that a lab has, and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What is sealed.
    pub truth: Truth,
    /// The lab's model.
    pub nominal: Kind,
    /// The recordings.
    pub runs: Vec<MadeRun>,
}

/// Makes case `number` of a seed.
///
/// # Errors
/// [`MakeError`] when no drawing fits the kind.
pub fn make(seed: u64, number: usize) -> Result<Case, MakeError> {
    let kind = Concealment::of_case(number);
    let mut random = Random::new(seed, number as u64 + 1);
    (0..MOST_DRAWINGS)
        .find_map(|redrawn| {
            let family = Family::of_case(number).filter(|_| redrawn < OF_ITS_FAMILY);
            Bench::draw(kind, family, &mut random)?.case(seed, number, redrawn, &mut random)
        })
        .ok_or(MakeError { number, kind })
}

/// A machine with its excitations and devices, before a law is chosen.
pub(super) struct Bench {
    pub(super) concealment: Concealment,
    pub(super) family: Family,
    pub(super) kind: Kind,
    pub(super) modes: usize,
    pub(super) plans: Vec<RunPlan>,
    pub(super) channels: Vec<Channel>,
    pub(super) without_encoder: bool,
    /// Training runs without left-out physics.
    pub(super) plain: Vec<Outcome>,
    pub(super) null_over_noise: f64,
}

/// Physics of a case with what was measured of it.
pub(super) struct Concealed {
    pub(super) physics: Vec<Physics>,
    pub(super) outside: Vec<Physics>,
    pub(super) measured: Measured,
}

impl Bench {
    fn draw(concealment: Concealment, family: Option<Family>, random: &mut Random) -> Option<Self> {
        const FAMILIES: [Family; 8] = [
            Family::MovedBeam,
            Family::MovedBeam,
            Family::CommandedBeam,
            Family::ServoBeam,
            Family::PushedBeam,
            Family::PushedBeam,
            Family::Stage,
            Family::TwoBodies,
        ];
        let family = match family {
            Some(family) => family,
            None => *random.pick(&FAMILIES)?,
        };
        let kind = family.draw(random);
        let plans = runs(&kind, frequencies_hz(&kind)?, random);
        let rig = Rig::new(&kind, &[])?;
        let plain: Vec<Outcome> =
            training(&plans).map(|plan| rig.run(&plan.excitation, RATE_HZ, 1)).collect::<Option<_>>()?;
        let can_hide = matches!(family, Family::CommandedBeam | Family::ServoBeam | Family::PushedBeam);
        let without_encoder =
            can_hide && random.chance(if concealment == Concealment::Masked { 0.6 } else { 0.15 });
        let channels = channels(family, &rig, &plain, without_encoder, random);
        let mut bench = Self {
            concealment,
            family,
            kind,
            modes: 0,
            plans,
            channels,
            without_encoder,
            plain,
            null_over_noise: 0.0,
        };
        // As many modes as it takes for the nominal model to be good enough.
        for modes in 2..=5 {
            bench.modes = modes;
            bench.null_over_noise = pooled(&bench.left(&bench.plain.clone())?);
            if bench.null_over_noise < GOOD_ENOUGH {
                return Some(bench);
            }
        }
        None
    }

    /// Right parameters, as few modes as the nominal model.
    pub(super) fn start(&self) -> Kind {
        nominal(&self.kind, self.modes, 0.0, &mut Random::new(0, 0))
    }

    pub(super) fn observed(&self, plan: &RunPlan, outcome: &Outcome) -> Observed {
        let readings =
            |channel: &Channel| (channel.output, outcome.shown(channel.output), channel.device.noise_rms);
        Observed {
            excitation: plan.excitation.clone(),
            outputs: self.channels.iter().map(readings).collect(),
        }
    }

    /// What a linear refit of all training runs leaves, per run.
    pub(super) fn left(&self, outcomes: &[Outcome]) -> Option<Vec<f64>> {
        Some(self.refitted(outcomes)?.left)
    }

    /// A linear refit of all training runs.
    pub(super) fn refitted(&self, outcomes: &[Outcome]) -> Option<Refit> {
        let observed: Vec<Observed> =
            training(&self.plans).zip(outcomes).map(|(plan, outcome)| self.observed(plan, outcome)).collect();
        refit(&self.start(), &observed, RATE_HZ)
    }

    pub(super) fn outcomes(&self, physics: &[Physics]) -> Option<Vec<Outcome>> {
        let rig = Rig::new(&self.kind, physics)?;
        let outcomes: Vec<Outcome> =
            training(&self.plans).map(|plan| rig.run(&plan.excitation, RATE_HZ, 1)).collect::<Option<_>>()?;
        let finite = outcomes.iter().all(|outcome| outcome.outputs.iter().flatten().all(|y| y.is_finite()));
        finite.then_some(outcomes)
    }

    fn case(&self, seed: u64, number: usize, redrawn: usize, random: &mut Random) -> Option<Case> {
        let concealed = self.conceal(random)?;
        let all: Vec<Physics> = concealed.physics.iter().chain(&concealed.outside).cloned().collect();
        let rig = Rig::new(&self.kind, &all)?;
        let runs: Vec<MadeRun> =
            self.plans.iter().map(|plan| self.recorded(&rig, plan, random)).collect::<Option<_>>()?;
        if !self.moves(&runs) {
            return None;
        }
        let noise = floors(&runs, &self.knowable(&concealed.physics, &runs)?);
        let held_out_floor = match achievable(self, &concealed.physics, &runs) {
            Some(fitted) => noise.iter().zip(fitted).map(|(noise, fitted)| noise.max(fitted)).collect(),
            None => noise,
        };
        let wrong = match self.concealment {
            Concealment::Null => 0.2,
            Concealment::Decoy => 2.0,
            _ => 1.0,
        };
        Some(Case {
            truth: Truth {
                number,
                seed,
                concealment: self.concealment,
                machine: self.family.words().to_owned(),
                physics: concealed.physics,
                outside: concealed.outside,
                without_encoder: self.without_encoder,
                rate_hz: RATE_HZ,
                channels: self.channels.clone(),
                held_out_floor,
                runs: self.plans.clone(),
                measured: concealed.measured,
                redrawn,
            },
            nominal: nominal(&self.kind, self.modes, wrong, random),
            runs,
        })
    }

    /// Whether every channel has something to show in the recordings of each role.
    fn moves(&self, runs: &[MadeRun]) -> bool {
        [Role::Train, Role::HeldOut].into_iter().all(|role| {
            self.channels.iter().enumerate().all(|(channel, Channel { device, .. })| {
                let swings: Vec<f64> = runs
                    .iter()
                    .filter(|run| run.plan.role == role)
                    .map(|run| swing(&run.noise_free[channel]))
                    .collect();
                pooled(&swings) >= LEAST_MOTION * device.noise_rms
            })
        })
    }

    /// What a model with the laws of the catalogue and every parameter right would compute of each run, per
    /// channel: all but the noise, and beside a law of the catalogue all but what a force that nobody
    /// recorded does. Where no such law acts, there is nothing to name, and all but the noise.
    fn knowable(&self, physics: &[Physics], runs: &[MadeRun]) -> Option<Vec<Vec<Vec<f64>>>> {
        if physics.is_empty() {
            return Some(runs.iter().map(|run| run.noise_free.clone()).collect());
        }
        let rig = Rig::new(&self.kind, physics)?;
        let seen = |run: &MadeRun| {
            let outcome = rig.run(&run.plan.excitation, RATE_HZ, 1)?;
            Some(self.channels.iter().map(|channel| outcome.shown(channel.output)).collect())
        };
        runs.iter().map(seen).collect()
    }

    fn recorded(&self, rig: &Rig, plan: &RunPlan, random: &mut Random) -> Option<MadeRun> {
        let outcome = rig.run(&plan.excitation, RATE_HZ, 1)?;
        if outcome.outputs.iter().flatten().any(|y| !y.is_finite()) {
            return None;
        }
        // A measured motion comes from an encoder of a micrometre.
        let encoder = |y: &f64| (y / 1e-6).round() * 1e-6;
        let command = match self.family {
            Family::MovedBeam => outcome.command.iter().map(encoder).collect(),
            Family::LoopedSlide => outcome.acted.clone(),
            _ => outcome.command.clone(),
        };
        let mut inputs: Vec<_> =
            input_column(&self.kind).map(|column| (column.to_owned(), command)).into_iter().collect();
        if self.family == Family::LoopedSlide {
            inputs.push((REFERENCE.to_owned(), outcome.command.clone()));
        }
        let recorded = self.channels.iter().map(|channel| {
            let laws: &[_] = if channel.output == 0 { &outcome.sensors } else { &[] };
            channel.device.recorded(&outcome.outputs[channel.output], laws, random)
        });
        Some(MadeRun {
            plan: plan.clone(),
            recorded: recorded.collect(),
            noise_free: self.channels.iter().map(|channel| outcome.shown(channel.output)).collect(),
            inputs,
            time_s: outcome.time_s,
        })
    }
}

/// The column that a position loop follows.
pub const REFERENCE: &str = "reference_m";

/// The column that drives a machine; `None` for one that is let go.
pub fn input_column(kind: &Kind) -> Option<&'static str> {
    Some(match kind {
        Kind::Slide(slide) if slide.let_go => return None,
        Kind::Slide(_) => "motor_force_N",
        Kind::Beam(beam) => match beam.input {
            InputKind::Force => "force_N",
            InputKind::BasePosition => "base_position_m",
            InputKind::Setpoint => "setpoint_m",
        },
    })
}

pub(super) fn training(plans: &[RunPlan]) -> impl Iterator<Item = &RunPlan> {
    plans.iter().filter(|plan| plan.role == Role::Train)
}

/// Root mean square about the mean.
fn swing(readings: &[f64]) -> f64 {
    let mean = readings.iter().sum::<f64>() / readings.len().max(1) as f64;
    pooled(&readings.iter().map(|reading| reading - mean).collect::<Vec<_>>())
}

/// Root mean square of root mean squares.
pub(super) fn pooled(parts: &[f64]) -> f64 {
    (parts.iter().map(|part| part * part).sum::<f64>() / parts.len().max(1) as f64).sqrt()
}

fn channels(
    family: Family,
    rig: &Rig,
    plain: &[Outcome],
    without_encoder: bool,
    random: &mut Random,
) -> Vec<Channel> {
    let correlation = if random.chance(0.3) { random.between(0.2, 0.6) } else { 0.0 };
    let mut channels = Vec::new();
    for (output, (column, ..)) in rig.plant().outputs.iter().enumerate() {
        let decibels = if output == 0 { random.between(34.0, 48.0) } else { random.between(46.0, 60.0) };
        let is_base = column == "base_position_m";
        if is_base && (family == Family::MovedBeam || without_encoder) {
            continue;
        }
        let rms: Vec<f64> = plain.iter().map(|outcome| pooled(&outcome.outputs[output])).collect();
        let noise_rms = pooled(&rms) * 10.0_f64.powf(-decibels / 20.0);
        channels.push(Channel {
            output,
            column: column.clone(),
            device: Device {
                rate_hz: RATE_HZ,
                noise_rms,
                noise_correlation: if is_base { 0.0 } else { correlation },
                quantum: 0.1 * noise_rms,
            },
        });
    }
    channels
}

/// What separates held-out readings from what can be known of them, root mean square per channel.
fn floors(runs: &[MadeRun], knowable: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let channels = runs.first().map_or(0, |run| run.recorded.len());
    let floor = |channel: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        for (run, known) in runs.iter().zip(knowable).filter(|(run, _)| run.plan.role == Role::HeldOut) {
            for (recorded, known) in run.recorded[channel].iter().zip(&known[channel]) {
                sum += (recorded - known).powi(2);
                count += 1.0;
            }
        }
        (sum / f64::max(count, 1.0)).sqrt()
    };
    (0..channels).map(floor).collect()
}
