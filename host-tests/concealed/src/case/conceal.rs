//! Choosing what is left out, sizing it, and measuring how well it is concealed.

use super::draw_machine::frequencies_hz;
use super::maker::{Bench, Concealed, RATE_HZ, pooled, training};
use super::menu::{Dish, Sizes, menu, outside};
use super::{Concealment, Measured};
use crate::random::Random;
use crate::refit::refit;
use crate::truth::law::Physics;
use crate::truth::plant::SlideMachine;
use crate::truth::run::{Kind, Outcome, Rig};

/// Halvings of the search for a size.
const SIZINGS: usize = 9;
/// A refit of one recording that hides at least this share of an effect absorbs it.
const ABSORBED: f64 = 0.7;
/// Laws tried on one machine before another is drawn.
const DISHES: usize = 6;
/// Share of the greatest strength at which absorption is looked at first.
const FIRST_LOOK: f64 = 0.03;

impl Bench {
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
        // Of all training recordings: a limit just below what the second one reaches would cut a third of
        // another's signal off.
        let commanded = self.plain.iter().flat_map(|run| &run.command);
        let command = commanded.fold(0.0_f64, |most, u| most.max(u.abs()));
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
            Kind::Slide(slide) if slide.let_go => (slide.ground_stiffness * z, 1.0, 1.0),
            Kind::Slide(SlideMachine { position_loop: Some(_), .. }) => {
                (loudest.acted.iter().fold(0.0_f64, |most, u| most.max(u.abs())), 1.0, 1.0)
            }
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

    /// A law of a menu; `None` where the recordings would not tell it from something else.
    fn dish(&self, of: &[(&'static str, &'static str)], random: &mut Random) -> Option<Dish> {
        let (id, location) = *random.pick(of)?;
        self.may_leave_out(id, location).then(|| Dish::draw(id, location, random))
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
    pub(super) fn conceal(&self, random: &mut Random) -> Option<Concealed> {
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
        // What only a start out of balance shows, no recording shows: a cable beside a spring is a stiffer
        // spring.
        let shown = measured.left_over_noise.min(measured.left_from_any_start);
        let fits = match self.concealment {
            Concealment::Visible => shown >= 3.0 && !absorbed,
            Concealment::Absorbed => absorbed && shown >= 2.0,
            Concealment::Buried => shown >= 0.5 && measured.left_over_noise <= 2.0,
            Concealment::Masked => shown >= 3.0 && (measured.mask_over_noise >= 1.0 || self.without_encoder),
            _ => shown >= 2.0,
        };
        fits.then_some(Concealed { measured, ..concealed })
    }

    fn measure(&self, concealed: &Concealed) -> Option<Measured> {
        let all: Vec<Physics> = concealed.physics.iter().chain(&concealed.outside).cloned().collect();
        let outcomes = self.outcomes(&all)?;
        let refitted = self.refitted(&outcomes)?;
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
            left_over_noise: pooled(&refitted.left),
            left_from_any_start: pooled(&refitted.left_from_any_start),
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
}
