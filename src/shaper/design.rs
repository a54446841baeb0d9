//! The plain impulse form of the shapers in `f64`: the reference that the integer cascade is held to.
//!
//! Eqs. (30)–(32) of the paper are one formula: with K = exp(−ζπ/√(1−ζ²)) and the half period
//! T = π/ω_d, the shaper of order n has the n + 1 impulses
//!
//! > A_i = C(n, i) K^i / (1 + K)^n at t_i = i T,  i = 0 … n.
//!
//! Several modes are shaped by the convolution of their shapers: amplitudes multiply, times add.

use super::mode::Mode;

/// One impulse of a shaper in continuous time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// Dimensionless; the amplitudes of a shaper sum to one.
    pub amplitude: f64,
    /// Seconds after the first impulse.
    pub time_s: f64,
}

/// The impulses of one mode's shaper, in order of time (eqs. 30–32).
pub fn single_mode(mode: &Mode) -> impl Iterator<Item = Impulse> + Clone + use<> {
    let order = mode.shaper().order();
    let decay = mode.decay_per_half_period();
    let half_period_s = mode.half_period_s();
    (0..=order).map(move |i| Impulse {
        amplitude: binomial(order, i) * libm::pow(decay, f64::from(i))
            / libm::pow(1.0 + decay, f64::from(order)),
        time_s: f64::from(i) * half_period_s,
    })
}

/// The impulses of the convolution of all modes' shapers, the last mode's running fastest. They are
/// not sorted by time when the modes' durations overlap. No modes give the identity.
pub fn convolved(modes: &[Mode]) -> impl Iterator<Item = Impulse> + Clone + '_ {
    let count: u32 = modes.iter().map(|mode| mode.shaper().order() + 1).product();
    (0..count).map(move |index| {
        // `index` in the mixed radix of the modes' impulse counts names one impulse of each mode.
        let mut rest = index;
        let mut product = Impulse { amplitude: 1.0, time_s: 0.0 };
        for mode in modes.iter().rev() {
            let impulses = mode.shaper().order() + 1;
            if let Some(impulse) = single_mode(mode).nth((rest % impulses) as usize) {
                product.amplitude *= impulse.amplitude;
                product.time_s += impulse.time_s;
            }
            rest /= impulses;
        }
        product
    })
}

/// When the last impulse of the convolution comes, in seconds: the sum of the modes' durations.
pub fn duration_s(modes: &[Mode]) -> f64 {
    modes.iter().map(|mode| f64::from(mode.shaper().order()) * mode.half_period_s()).sum()
}

/// The centroid of the convolution in seconds: how far the shaped command lags behind on a ramp.
pub fn delay_s(modes: &[Mode]) -> f64 {
    modes
        .iter()
        .map(|mode| single_mode(mode).map(|impulse| impulse.amplitude * impulse.time_s).sum::<f64>())
        .sum()
}

fn binomial(n: u32, k: u32) -> f64 {
    (0..k).fold(1.0, |product, i| product * f64::from(n - i) / f64::from(i + 1))
}
