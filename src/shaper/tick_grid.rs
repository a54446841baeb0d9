//! Impulses put on whole ticks so that the mode cannot tell the difference.
//!
//! Sampled at the interval T_s, the mode's pole is p = exp((−ζω + jω_d)T_s); write ρ = exp(ζωT_s) and θ = ω_d
//! T_s < π. An impulse A at the time (k + φ)T_s, k whole and 0 ≤ φ < 1, moves the mode by A p^−(k+φ). Two
//! real weights on the ticks around it do exactly the same when
//!
//! > w₁ p^−k + w₂ p^−(k+1) = A p^−(k+φ)
//!
//! which is one complex equation for two reals. Divided by p^−k its imaginary part gives w₂, its real part
//! w₁:
//!
//! > w₁ = A ρ^φ sin((1 − φ)θ) / sin θ,  w₂ = A ρ^(φ−1) sin(φθ) / sin θ.
//!
//! Both are non-negative. Their sum is A at φ = 0 and above A in between, so scaling all weights to the sum
//! one leaves a little less of the mode than the impulses do, and nothing where they leave nothing. The
//! proofs and bounds are in docs/derivations/shapers.md.
//!
//! ZV is the split of its two impulses too: a trinomial with a zero at p. Its powers are what ZVD, ZVDD and
//! ZVDDD become, rather than the split of their own impulses: the zero then is double, triple and quadruple,
//! which is what makes them robust.

use heapless::Vec;

use super::design::Impulse;
use super::mode::Mode;
use super::stage::MAX_TAPS;
use crate::elementary::sine_in_half_turn;
use crate::units::TickRate;

/// Taps with real weights: delay in ticks, weight. Delays increase.
pub(super) type RealTaps = Vec<(u32, f64), MAX_TAPS>;

/// A mode's pole at a tick rate.
#[derive(Clone, Copy)]
pub(super) struct SampledPole {
    /// ζωT_s, the decay per tick.
    decay: f64,
    /// ω_d T_s, the angle per tick, below π.
    theta: f64,
    tick_rate_hz: f64,
}

impl SampledPole {
    /// The pole of a mode below half the tick rate.
    pub(super) fn new(mode: &Mode, tick_rate: TickRate) -> Self {
        let period_s = tick_rate.period_s();
        Self {
            decay: mode.damping_ratio() * mode.omega() * period_s,
            theta: mode.omega_damped() * period_s,
            tick_rate_hz: tick_rate.hz(),
        }
    }

    /// The ZV shaper of a mode to a power of 1 to 4, weights summing to one.
    pub(super) fn power_of_zv(self, mode: &Mode, power: u32) -> RealTaps {
        let half_period_s = mode.half_period_s();
        let second = Impulse { amplitude: mode.decay_per_half_period(), time_s: half_period_s };
        let zv = self.split([Impulse { amplitude: 1.0, time_s: 0.0 }, second].into_iter());
        (1..power).fold(zv.clone(), |product, _| convolve(&product, &zv))
    }

    /// Each impulse on the two ticks around it, the first on tick zero, weights scaled to the sum one.
    pub(super) fn split(self, impulses: impl Iterator<Item = Impulse>) -> RealTaps {
        let mut taps = RealTaps::new();
        for Impulse { amplitude, time_s } in impulses {
            let time_ticks = time_s * self.tick_rate_hz;
            let tick = libm::floor(time_ticks);
            let fraction = time_ticks - tick;
            let scale = amplitude / sine_in_half_turn(self.theta);
            let early = libm::exp(self.decay * fraction) * sine_in_half_turn((1.0 - fraction) * self.theta);
            let late = libm::exp(self.decay * (fraction - 1.0)) * sine_in_half_turn(fraction * self.theta);
            add(&mut taps, tick as u32, scale * early);
            // An impulse on a tick needs no other, and powers have no room for terms of zero.
            if late > 0.0 {
                add(&mut taps, tick as u32 + 1, scale * late);
            }
        }
        let sum: f64 = taps.iter().map(|(_, weight)| weight).sum();
        for (_, weight) in &mut taps {
            *weight /= sum;
        }
        taps
    }
}

/// The product of two tap polynomials.
fn convolve(left: &RealTaps, right: &RealTaps) -> RealTaps {
    let mut product = RealTaps::new();
    for (left_delay, left_weight) in left {
        for (right_delay, right_weight) in right {
            add(&mut product, left_delay + right_delay, left_weight * right_weight);
        }
    }
    product.sort_unstable_by_key(|(delay, _)| *delay);
    product
}

/// Adds a term, merging it with one of equal delay.
fn add(taps: &mut RealTaps, delay_ticks: u32, weight: f64) {
    match taps.iter_mut().find(|(known, _)| *known == delay_ticks) {
        Some((_, sum)) => *sum += weight,
        None => {
            let stored = taps.push((delay_ticks, weight));
            // The fourth power of a trinomial has 15 different delays, five impulses have at most ten.
            debug_assert!(stored.is_ok());
        }
    }
}
