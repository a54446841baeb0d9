//! The controlled stop: the command comes to rest from whatever velocity and acceleration it has, the
//! quickest way that the limits permit.
//!
//! With a limit of acceleration only, the velocity runs down by equal steps. With a limit j of jerk the
//! acceleration moves by j per tick at most: each tick the hardest braking is chosen from which braking can
//! still be taken back, in steps of j, before the velocity has changed its sign. Accelerations are i j + ρ
//! with whole i and a ρ ≤ j left over from where the stop began, so the velocity lost while taking back is a
//! sum of such terms, kept up to date by additions. Velocity that would be left over goes into ρ. What is
//! left of the velocity at the end is less than one step and dropped, which is no more than j of jerk either.

use super::boxes::PerTick;
use super::fine::FinePosition;
use super::{MoveLimits, Profile};
use crate::units::TickRate;

/// Velocities and accelerations have these more fractional bits than positions: 10 mm/s³ at 20 kHz is then
/// still 10⁻⁴ accurate.
const EXTRA_BITS: u32 = 8;
/// The fractional bits of velocities and accelerations, in nanometres per tick and tick².
const UNIT_BITS: u32 = FinePosition::FRACTION_BITS + EXTRA_BITS;

/// How strongly a stop brakes: computed outside the interrupt, from the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Braking {
    /// Largest change of velocity per tick, in nanometres with [`UNIT_BITS`].
    deceleration: i64,
    jerk: Option<JerkLimit>,
}

/// The limit of jerk, in two forms.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JerkLimit {
    /// Largest change of acceleration per tick, in nanometres with [`UNIT_BITS`].
    per_tick: i64,
    /// Its reciprocal, for accelerations less [`Self::shift`] bits.
    inverse: f32,
    /// What brings accelerations up to sixty times the limit into 32 bits, which the core can turn into
    /// floats.
    shift: u32,
    /// How many whole steps are in the full deceleration.
    full_steps: i32,
    /// And what is left of it.
    full_rest: i64,
    /// The velocity lost while taking the full deceleration back.
    full_loss: i64,
}

impl Braking {
    /// Braking at the limits; of jerk too, where the profile has one.
    pub fn new(limits: &MoveLimits, profile: Profile, rate: TickRate) -> Self {
        let PerTick { acceleration, jerk, .. } = limits.per_tick(rate);
        // At least one unit, so that a stop always ends.
        let units = |nanometres: f64| (libm::scalbn(nanometres, UNIT_BITS as i32) as i64).max(1);
        let deceleration = units(acceleration);
        // Where one tick reaches the full deceleration, jerk is no limit.
        let per_tick = units(jerk);
        if !profile.limits_jerk() || per_tick >= deceleration {
            return Self { deceleration, jerk: None };
        }
        let shift = 40_u32.saturating_sub(deceleration.leading_zeros());
        let inverse = libm::scalbn(1.0 / per_tick as f64, shift as i32) as f32;
        let full_steps = deceleration / per_tick;
        let full_rest = deceleration - full_steps * per_tick;
        let full_loss =
            (full_steps - 1).saturating_mul(deceleration - full_rest) / 2 + full_steps * full_rest;
        let full_steps = full_steps.min(i64::from(i32::MAX)) as i32;
        Self {
            deceleration,
            jerk: Some(JerkLimit { per_tick, inverse, shift, full_steps, full_rest, full_loss }),
        }
    }
}

impl Braking {
    /// The same without a limit of jerk: the shortest stop within the limit of acceleration, which never goes
    /// back.
    #[inline]
    #[must_use]
    pub fn hardest(self) -> Self {
        Self { jerk: None, ..self }
    }
}

/// A stop in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct StopPlan {
    position: i64,
    /// Per tick, positive in the direction of travel.
    velocity: i64,
    forward: bool,
    deceleration: i64,
    taking_back: Option<TakingBack>,
}

/// The state of a stop with limited jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TakingBack {
    limit: JerkLimit,
    /// Deceleration in this tick: i j + ρ, below zero while still accelerating.
    level: i64,
    /// i.
    steps: i32,
    /// ρ, at most j.
    rest: i64,
    /// The velocity that will be lost while the deceleration is taken back to ρ and then to zero.
    loss: i64,
}

impl StopPlan {
    /// Stops a command that was at these positions in three successive ticks, the newest last.
    #[inline]
    pub fn new([first, before, now]: [FinePosition; 3], braking: Braking) -> Self {
        let velocity = (now - before).0 << EXTRA_BITS;
        let acceleration = velocity - ((before - first).0 << EXTRA_BITS);
        let Braking { deceleration, jerk } = braking;
        let Some(limit) = jerk else {
            let forward = velocity >= 0;
            let velocity = if forward { velocity } else { -velocity };
            return Self { position: now.0, velocity, forward, deceleration, taking_back: None };
        };
        // Where the velocity would end if the acceleration were taken back at once decides which way to
        // brake.
        let outward = TakingBack::new(-acceleration, limit);
        let forward = velocity >= outward.loss;
        let (velocity, taking_back) =
            if forward { (velocity, outward) } else { (-velocity, TakingBack::new(acceleration, limit)) };
        Self { position: now.0, velocity, forward, deceleration, taking_back: Some(taking_back) }
    }

    /// The position of the next tick; `None` once at rest.
    #[inline]
    pub fn step(&mut self) -> Option<FinePosition> {
        match &mut self.taking_back {
            None if self.velocity == 0 => return None,
            None => self.velocity = (self.velocity - self.deceleration).max(0),
            Some(state) => {
                if self.velocity == 0 && state.level == 0 {
                    return None;
                }
                state.step(self.velocity, self.deceleration);
                self.velocity -= state.level;
                if state.level == 0 && self.velocity < state.limit.per_tick {
                    self.velocity = 0;
                }
            }
        }
        let step = self.velocity >> EXTRA_BITS;
        self.position += if self.forward { step } else { -step };
        Some(FinePosition(self.position))
    }
}

impl TakingBack {
    fn new(level: i64, limit: JerkLimit) -> Self {
        let JerkLimit { per_tick: jerk, .. } = limit;
        // The second time for what rounding left of large numbers; then ρ is off by one step at most.
        let mut steps = limit.steps_in(level);
        steps += limit.steps_in(level - i64::from(steps) * jerk);
        let mut rest = level - i64::from(steps) * jerk;
        if rest < 0 {
            steps -= 1;
            rest += jerk;
        } else if rest >= jerk {
            steps += 1;
            rest -= jerk;
        }
        // The sum of the levels on the way: 0 j + ρ … (i − 1) j + ρ, or (i + 1) j + ρ … 0 j + ρ.
        let count = i64::from(steps);
        let loss = if count >= 0 {
            (count * (count - 1) / 2).wrapping_mul(jerk).wrapping_add(count * rest)
        } else {
            (count * (count + 1) / -2).wrapping_mul(jerk).wrapping_sub(count * rest)
        };
        Self { limit, level, steps, rest, loss }
    }

    /// Chooses the deceleration of the next tick at this velocity.
    #[inline]
    fn step(&mut self, velocity: i64, deceleration: i64) {
        let JerkLimit { per_tick, full_steps, full_rest, full_loss, .. } = self.limit;
        let harder = self.level + per_tick;
        if self.steps == -1 && (0..harder).contains(&velocity) {
            // Less than ρ is enough.
            self.steps = 0;
            self.level = velocity;
            self.rest = velocity;
            self.loss = 0;
        } else if self.steps < 0 {
            self.steps += 1;
            self.level = harder;
            self.loss -= harder;
        } else if harder <= deceleration && velocity - harder >= self.loss + self.level {
            self.steps += 1;
            self.loss += self.level;
            self.level = harder;
        } else if harder > deceleration && self.level < deceleration && velocity - deceleration >= full_loss {
            // Less than a whole step to the full deceleration, which has a ρ of its own.
            self.steps = full_steps;
            self.rest = full_rest;
            self.loss = full_loss;
            self.level = deceleration;
        } else if self.steps == 0 {
            // A ρ close to zero would take its time.
            self.level = 0;
            self.rest = 0;
        } else if self.level > deceleration || velocity - self.level < self.loss {
            self.ease(velocity - self.loss);
        }
    }

    /// Takes back a step less what the velocity that is left over after all steps allows: a larger ρ, which
    /// acts in each of them.
    #[inline]
    fn ease(&mut self, left_over: i64) {
        let JerkLimit { per_tick, .. } = self.limit;
        let steps = i64::from(self.steps);
        let mut more = per_tick - self.rest;
        for _ in 0..4 {
            if steps * more > left_over {
                more >>= 1;
            }
        }
        if steps * more > left_over {
            more = 0;
        }
        self.level -= per_tick;
        self.loss += (steps - 1) * more - self.level;
        self.level += more;
        self.rest += more;
        self.steps -= 1;
    }
}

impl JerkLimit {
    /// How many steps make this acceleration, about.
    #[inline]
    fn steps_in(self, level: i64) -> i32 {
        let most = i64::from(i32::MAX);
        let coarse = (level >> self.shift).clamp(-most, most) as i32;
        (coarse as f32 * self.inverse) as i32
    }
}
