//! The shaper of one mode as an integer finite impulse response on the tick grid.
//!
//! Rounding half a period to whole ticks would move the zero off the mode. Instead the second impulse
//! of the ZV shaper is split over the two ticks around it. Sampled at the interval T, the mode's pole is
//! p = exp((−ζω + jω_d)T); write ρ = exp(ζωT), θ = ω_d T < π and m = ⌊π/θ⌋. The response
//! b₀ + b₁ z^−m + b₂ z^−(m+1) has a zero at z = p exactly when
//!
//! > b₀ + b₁ ρ^m e^{−jmθ} + b₂ ρ^{m+1} e^{−j(m+1)θ} = 0,
//!
//! whose solution, with ε = π − mθ in 0 ≤ ε < θ, is up to the common factor that makes the sum one
//!
//! > b₀ = ρ^{m+1} sin θ,  b₁ = ρ sin(θ − ε),  b₂ = sin ε,
//!
//! all non-negative. ZVD and ZVDD are the square and the cube of this polynomial: the zero becomes
//! double and triple, which is what makes them robust. The residual of the mode is zero to rounding at
//! every tick rate, and goes to eqs. (30)–(32) as T goes to zero (docs/derivations.md).

use heapless::Vec;

use super::design::Impulse;
use super::mode::{Mode, ModeError};
use crate::units::TickRate;

/// The weight that stands for one: taps are Q30.
pub const WEIGHT_ONE: i32 = 1 << 30;

/// The most taps of a stage: a cubed trinomial has ten terms.
pub const MAX_TAPS: usize = 10;

/// One tap of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tap {
    /// How many ticks ago the sample was taken that this tap weighs.
    pub delay_ticks: u32,
    /// Its weight; [`WEIGHT_ONE`] stands for one.
    pub weight: i32,
}

/// The taps of one mode, delays increasing from zero, weights summing to [`WEIGHT_ONE`] exactly.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    taps: Vec<Tap, MAX_TAPS>,
}

/// Taps with real weights, before they are rounded.
type RealTaps = Vec<(u32, f64), MAX_TAPS>;

impl Stage {
    /// Designs the stage of `mode` for a tick rate.
    ///
    /// # Errors
    /// [`ModeError::AboveNyquist`] when the mode's frequency is not below half the tick rate.
    pub fn design(mode: &Mode, tick_rate: TickRate) -> Result<Self, ModeError> {
        let theta = mode.omega_damped() * tick_rate.period_s();
        // The damped frequency would do for the mathematics; this is the rule that a person can apply.
        if 2.0 * mode.frequency_hz() >= tick_rate.hz() {
            return Err(ModeError::AboveNyquist { frequency_hz: mode.frequency_hz(), tick_rate });
        }
        let zv = split_half_period(mode.damping_ratio() * mode.omega() * tick_rate.period_s(), theta);
        let mut product = zv.clone();
        for _ in 1..mode.shaper().order() {
            product = convolve(&product, &zv);
        }
        Ok(Self { taps: round_to_sum_one(&product) })
    }

    /// The taps, delays increasing.
    pub fn taps(&self) -> &[Tap] {
        &self.taps
    }

    /// The delay of the last tap: for how many ticks the stage remembers.
    pub fn duration_ticks(&self) -> u32 {
        self.taps.last().map_or(0, |tap| tap.delay_ticks)
    }

    /// The centroid of the taps in ticks: how far a ramp is delayed.
    pub fn delay_ticks(&self) -> f64 {
        self.impulses(1.0).map(|impulse| impulse.amplitude * impulse.time_s).sum()
    }

    /// The rounded taps as impulses in continuous time, for [`super::residual`].
    pub fn impulses(&self, tick_period_s: f64) -> impl Iterator<Item = Impulse> + Clone + '_ {
        self.taps.iter().map(move |tap| Impulse {
            amplitude: f64::from(tap.weight) / f64::from(WEIGHT_ONE),
            time_s: f64::from(tap.delay_ticks) * tick_period_s,
        })
    }
}

/// The exact ZV trinomial; `decay` is ζωT and `theta` ω_d T, both per tick.
fn split_half_period(decay: f64, theta: f64) -> RealTaps {
    let ticks = libm::floor(core::f64::consts::PI / theta);
    // Clamped, because the quotient's rounding may put π/θ on the wrong side of a whole number.
    let remainder = (core::f64::consts::PI - ticks * theta).clamp(0.0, theta);
    let growth = libm::exp(decay);
    let first = libm::exp(decay * (ticks + 1.0)) * libm::sin(theta);
    let early = growth * libm::sin(theta - remainder);
    let late = libm::sin(remainder);
    let sum = first + early + late;
    let ticks = ticks as u32;
    RealTaps::from_iter([(0, first / sum), (ticks, early / sum), (ticks + 1, late / sum)])
}

/// The product of two tap polynomials, terms of equal delay merged, delays increasing.
fn convolve(left: &RealTaps, right: &RealTaps) -> RealTaps {
    let mut product = RealTaps::new();
    for (left_delay, left_weight) in left {
        for (right_delay, right_weight) in right {
            let delay = left_delay + right_delay;
            let weight = left_weight * right_weight;
            match product.iter_mut().find(|(known, _)| *known == delay) {
                Some((_, sum)) => *sum += weight,
                None => {
                    let stored = product.push((delay, weight));
                    // Up to the cube of a trinomial there are at most MAX_TAPS different delays.
                    debug_assert!(stored.is_ok());
                }
            }
        }
    }
    product.sort_unstable_by_key(|(delay, _)| *delay);
    product
}

/// Rounds the weights to Q30 and gives what rounding took or added to the largest tap, where it
/// weighs least, so that a constant passes unchanged.
fn round_to_sum_one(real: &RealTaps) -> Vec<Tap, MAX_TAPS> {
    let mut taps: Vec<Tap, MAX_TAPS> = real
        .iter()
        .map(|(delay_ticks, weight)| Tap {
            delay_ticks: *delay_ticks,
            weight: libm::round(weight * f64::from(WEIGHT_ONE)) as i32,
        })
        .collect();
    let excess: i32 = taps.iter().map(|tap| tap.weight).sum::<i32>() - WEIGHT_ONE;
    if let Some(largest) = taps.iter_mut().max_by_key(|tap| tap.weight) {
        largest.weight -= excess;
    }
    taps.retain(|tap| tap.weight != 0);
    taps
}
