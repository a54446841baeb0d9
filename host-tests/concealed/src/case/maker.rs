//! From a seed and a number to a sealed case: drawn, sized, measured, and drawn again until it is of its kind.

use thiserror::Error;

use super::draw_machine::{Family, frequencies_hz, nominal};
use super::draw_runs::runs;
use super::menu::{Dish, Sizes, menu, outside};
use super::{Channel, Concealment, Measured, Role, RunPlan, Truth};
use crate::random::Random;
use crate::refit::{Observed, refit};
use crate::truth::devices::Device;
use crate::truth::law::Physics;
use crate::truth::plant::InputKind;
use crate::truth::run::{Kind, Outcome, Rig};

/// Drawings before a case is given up.
const MOST_DRAWINGS: usize = 60;
/// Readings per second.
const RATE_HZ: f64 = 100.0;
/// What a linear refit may leave of a truth without left-out physics, in units of the noise. With a few thousand readings a
/// systematic 3 % of the noise stays within three of its standard errors.
const GOOD_ENOUGH: f64 = 0.03;
/// Halvings of the search for a size.
const SIZINGS: usize = 9;
/// A refit of one recording that hides at least this share of an effect absorbs it.
const ABSORBED: f64 = 0.7;
/// Laws tried on one machine before another is drawn.
const DISHES: usize = 6;
/// Share of the greatest strength at which absorption is looked at first.
const FIRST_LOOK: f64 = 0.03;

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
    /// Input column and what is recorded of it.
    pub input: (String, Vec<f64>),
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
        .find_map(|redrawn| Bench::draw(kind, &mut random)?.case(seed, number, redrawn, &mut random))
        .ok_or(MakeError { number, kind })
}

/// A machine with its excitations and devices, before a law is chosen.
struct Bench {
    concealment: Concealment,
    family: Family,
    kind: Kind,
    modes: usize,
    plans: Vec<RunPlan>,
    channels: Vec<Channel>,
    without_encoder: bool,
    /// Training runs without left-out physics.
    plain: Vec<Outcome>,
    null_over_noise: f64,
}

/// Physics of a case with what was measured of it.
struct Concealed {
    physics: Vec<Physics>,
    outside: Vec<Physics>,
    measured: Measured,
}

impl Bench {
    fn draw(concealment: Concealment, random: &mut Random) -> Option<Self> {
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
        let family = *random.pick(&FAMILIES)?;
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
    fn start(&self) -> Kind {
        nominal(&self.kind, self.modes, 0.0, &mut Random::new(0, 0))
    }

    fn observed(&self, plan: &RunPlan, outcome: &Outcome) -> Observed {
        let readings =
            |channel: &Channel| (channel.output, outcome.shown(channel.output), channel.device.noise_rms);
        Observed {
            excitation: plan.excitation.clone(),
            outputs: self.channels.iter().map(readings).collect(),
        }
    }

    /// What a linear refit of all training runs leaves, per run.
    fn left(&self, outcomes: &[Outcome]) -> Option<Vec<f64>> {
        let observed: Vec<Observed> =
            training(&self.plans).zip(outcomes).map(|(plan, outcome)| self.observed(plan, outcome)).collect();
        Some(refit(&self.start(), &observed, RATE_HZ)?.left)
    }

    fn outcomes(&self, physics: &[Physics]) -> Option<Vec<Outcome>> {
        let rig = Rig::new(&self.kind, physics)?;
        let outcomes: Vec<Outcome> =
            training(&self.plans).map(|plan| rig.run(&plan.excitation, RATE_HZ, 1)).collect::<Option<_>>()?;
        let finite = outcomes.iter().all(|outcome| outcome.outputs.iter().flatten().all(|y| y.is_finite()));
        finite.then_some(outcomes)
    }

    /// The size at which a law, beside others, leaves this much after a refit.
    fn sized(&self, dish: &Dish, beside: &[Physics], target: f64) -> Option<Physics> {
        let sizes = self.sizes(dish.location)?;
        let mut all = beside.to_vec();
        let mut left_at = |strength: f64| -> Option<f64> {
            all.truncate(beside.len());
            all.push(dish.at(strength, &sizes));
            Some(pooled(&self.left(&self.outcomes(&all)?)?))
        };
        let (mut low, mut high) = (1e-4 * dish.most(), dish.most());
        if left_at(high)? < target {
            return None;
        }
        for _ in 0..SIZINGS {
            let middle = (low * high).sqrt();
            let left = left_at(middle)?;
            if (left / target).ln().abs() < 0.08 {
                return Some(dish.at(middle, &sizes));
            }
            if left < target { low = middle } else { high = middle }
        }
        Some(dish.at(high, &sizes))
    }

    fn sizes(&self, location: &str) -> Option<Sizes> {
        let plant = self.kind.plant()?;
        let loudest = self.plain.get(1)?;
        let point = plant.point(location).unwrap_or(0);
        let (z, v) = *loudest.reach.get(point)?;
        let command = loudest.command.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        let reading = loudest.outputs.first()?.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        let [first_hz, second_hz] = frequencies_hz(&self.kind)?;
        let (force, clamp, beam_kg) = match &self.kind {
            Kind::Beam(beam) => {
                let modes = beam.strip.modes(1)?;
                let bending = (modes.omega_rad_s[0] / modes.tip[0]).powi(2) * z;
                let on_beam = !(location == "base" || location == "drive");
                let of_servo = beam
                    .servo
                    .map(|servo| (beam.base_mass_kg + modes.mass_kg) * servo.omega_rad_s.powi(2) * command);
                let on_base = of_servo.unwrap_or(command);
                let ei =
                    beam.strip.young_pa * beam.strip.width_m[0] * beam.strip.thickness_m[0].powi(3) / 12.0;
                (if on_beam { bending } else { on_base }, ei / beam.strip.length_m, modes.mass_kg)
            }
            Kind::Slide(slide) if location.contains('-') => (slide.coupling[0] * z, 1.0, 1.0),
            Kind::Slide(_) => (command, 1.0, 1.0),
        };
        Some(Sizes {
            z,
            v,
            force,
            command,
            reading,
            frequency_hz: (first_hz * second_hz.max(2.0 * first_hz)).sqrt(),
            clamp,
            beam_kg,
        })
    }

    fn dish(&self, of: &[(&'static str, &'static str)], random: &mut Random) -> Option<Dish> {
        let (id, location) = *random.pick(of)?;
        Some(Dish::draw(id, location, random))
    }

    /// A law that a refit of the first recording alone hides, at a first look.
    fn absorbed_dish(&self, menu: &[(&'static str, &'static str)], random: &mut Random) -> Option<Dish> {
        let (plan, plain) = (self.plans.first()?, self.plain.first()?);
        (0..DISHES).find_map(|_| {
            let dish = self.dish(menu, random)?;
            let law = dish.at(FIRST_LOOK * dish.most(), &self.sizes(dish.location)?);
            let outcome = Rig::new(&self.kind, &[law])?.run(&plan.excitation, RATE_HZ, 1)?;
            let alone = refit(&self.start(), &[self.observed(plan, &outcome)], RATE_HZ)?;
            let effect = self.effect(&outcome, plain);
            (alone.left.first()? < &((1.0 - ABSORBED) * effect)).then_some(dish)
        })
    }

    /// Chooses and sizes what is left out; `None` if it does not come out as the kind demands.
    fn conceal(&self, random: &mut Random) -> Option<Concealed> {
        let menu = menu(self.family);
        let nothing = Concealed { physics: Vec::new(), outside: Vec::new(), measured: Measured::default() };
        let concealed = match self.concealment {
            Concealment::Null | Concealment::Decoy => {
                let measured = Measured { null_over_noise: self.null_over_noise, ..Measured::default() };
                return Some(Concealed { measured, ..nothing });
            }
            Concealment::Outside => {
                let dish = self.dish(&outside(self.family), random)?;
                let law = self.sized(&dish, &[], random.log_between(3.0, 15.0))?;
                Concealed { outside: vec![law], ..nothing }
            }
            Concealment::Visible | Concealment::Absorbed | Concealment::Buried => {
                let target = match self.concealment {
                    Concealment::Visible => random.log_between(4.0, 25.0),
                    Concealment::Absorbed => random.log_between(2.5, 10.0),
                    _ => random.between(0.65, 1.7),
                };
                let dish = match self.concealment {
                    Concealment::Absorbed => self.absorbed_dish(&menu, random)?,
                    _ => self.dish(&menu, random)?,
                };
                let law = self.sized(&dish, &[], target)?;
                Concealed { physics: vec![law], ..nothing }
            }
            Concealment::Masked => {
                let law = self.sized(&self.dish(&menu, random)?, &[], random.log_between(4.0, 15.0))?;
                let second_target = random.log_between(1.5, 5.0);
                if self.without_encoder && random.chance(0.5) {
                    Concealed { physics: vec![law], ..nothing }
                } else if random.chance(0.4) {
                    let dish =
                        Dish::draw("outside:random_telegraph", outside(self.family).first()?.1, random);
                    let disturbance = self.sized(&dish, &[], second_target)?;
                    Concealed { physics: vec![law], outside: vec![disturbance], ..nothing }
                } else {
                    let others: Vec<_> = menu.into_iter().filter(|(id, _)| *id != law.id).collect();
                    let second = self.sized(&self.dish(&others, random)?, &[], second_target)?;
                    Concealed { physics: vec![law, second], ..nothing }
                }
            }
        };
        let measured = self.measure(&concealed)?;
        let absorbed = measured.hidden_share.iter().all(|share| *share >= ABSORBED);
        let fits = match self.concealment {
            Concealment::Visible => measured.left_over_noise >= 3.0 && !absorbed,
            Concealment::Absorbed => absorbed && measured.left_over_noise >= 2.0,
            Concealment::Buried => (0.5..=2.0).contains(&measured.left_over_noise),
            Concealment::Masked => {
                measured.left_over_noise >= 3.0 && (measured.mask_over_noise >= 1.0 || self.without_encoder)
            }
            _ => measured.left_over_noise >= 2.0,
        };
        fits.then_some(Concealed { measured, ..concealed })
    }

    fn measure(&self, concealed: &Concealed) -> Option<Measured> {
        let all: Vec<Physics> = concealed.physics.iter().chain(&concealed.outside).cloned().collect();
        let outcomes = self.outcomes(&all)?;
        let left = self.left(&outcomes)?;
        let mut hidden_share = Vec::new();
        let mut effects = Vec::new();
        for ((plan, outcome), plain) in training(&self.plans).zip(&outcomes).zip(&self.plain) {
            let effect = self.effect(outcome, plain);
            let alone = refit(&self.start(), &[self.observed(plan, outcome)], RATE_HZ)?;
            // A law that this recording does not reach (a limit, a stop) has nothing to hide there.
            hidden_share.push(if effect > 0.0 { 1.0 - alone.left.first()? / effect } else { 0.0 });
            effects.push(effect);
        }
        let second = all.get(1).map(|second| -> Option<f64> {
            Some(pooled(&self.left(&self.outcomes(std::slice::from_ref(second))?)?))
        });
        Some(Measured {
            effect_over_noise: pooled(&effects),
            left_over_noise: pooled(&left),
            hidden_share,
            null_over_noise: self.null_over_noise,
            mask_over_noise: match second {
                Some(left) => left?,
                None => 0.0,
            },
        })
    }

    fn effect(&self, with: &Outcome, without: &Outcome) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for channel in &self.channels {
            let (with, without) = (with.shown(channel.output), without.shown(channel.output));
            count += with.len();
            let differ = with.iter().zip(&without).map(|(a, b)| ((a - b) / channel.device.noise_rms).powi(2));
            sum += differ.sum::<f64>();
        }
        (sum / f64::from(u32::try_from(count.max(1)).unwrap_or(u32::MAX))).sqrt()
    }

    fn case(&self, seed: u64, number: usize, redrawn: usize, random: &mut Random) -> Option<Case> {
        let concealed = self.conceal(random)?;
        let all: Vec<Physics> = concealed.physics.iter().chain(&concealed.outside).cloned().collect();
        let rig = Rig::new(&self.kind, &all)?;
        let runs: Vec<MadeRun> =
            self.plans.iter().map(|plan| self.recorded(&rig, plan, random)).collect::<Option<_>>()?;
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
                held_out_floor: floors(&runs, self.channels.len()),
                runs: self.plans.clone(),
                measured: concealed.measured,
                redrawn,
            },
            nominal: nominal(&self.kind, self.modes, wrong, random),
            runs,
        })
    }

    fn recorded(&self, rig: &Rig, plan: &RunPlan, random: &mut Random) -> Option<MadeRun> {
        let outcome = rig.run(&plan.excitation, RATE_HZ, 1)?;
        if outcome.outputs.iter().flatten().any(|y| !y.is_finite()) {
            return None;
        }
        let column = input_column(&self.kind).to_owned();
        // A measured motion comes from an encoder of a micrometre.
        let encoder = |y: &f64| (y / 1e-6).round() * 1e-6;
        let command = match self.family {
            Family::MovedBeam => outcome.command.iter().map(encoder).collect(),
            _ => outcome.command.clone(),
        };
        let recorded = self.channels.iter().map(|channel| {
            let laws: &[_] = if channel.output == 0 { &outcome.sensors } else { &[] };
            channel.device.recorded(&outcome.outputs[channel.output], laws, random)
        });
        Some(MadeRun {
            plan: plan.clone(),
            recorded: recorded.collect(),
            noise_free: self.channels.iter().map(|channel| outcome.shown(channel.output)).collect(),
            input: (column, command),
            time_s: outcome.time_s,
        })
    }
}

/// The column that drives a machine.
pub fn input_column(kind: &Kind) -> &'static str {
    match kind {
        Kind::Slide(_) => "motor_force_N",
        Kind::Beam(beam) => match beam.input {
            InputKind::Force => "force_N",
            InputKind::BasePosition => "base_position_m",
            InputKind::Setpoint => "setpoint_m",
        },
    }
}

fn training(plans: &[RunPlan]) -> impl Iterator<Item = &RunPlan> {
    plans.iter().filter(|plan| plan.role == Role::Train)
}

/// Root mean square of root mean squares.
fn pooled(parts: &[f64]) -> f64 {
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

fn floors(runs: &[MadeRun], channels: usize) -> Vec<f64> {
    let floor = |channel: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        for run in runs.iter().filter(|run| run.plan.role == Role::HeldOut) {
            for (recorded, free) in run.recorded[channel].iter().zip(&run.noise_free[channel]) {
                sum += (recorded - free).powi(2);
                count += 1.0;
            }
        }
        (sum / f64::max(count, 1.0)).sqrt()
    };
    (0..channels).map(floor).collect()
}
