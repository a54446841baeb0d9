//! The plain impulse form of the shapers in `f64`: the reference that the integer cascade is held to.
//!
//! With K = exp(−ζπ/√(1−ζ²)), the half period T = π/ω_d and a type's undamped amplitudes u_i at distances
//! of σ half periods ([`Pattern`]), its impulses on a damped mode are
//!
//! > A_i = u_i K^(σi) / Σ_k u_k K^(σk)  at  t_i = σ i T.
//!
//! An impulse at t_i then rings at every later time exactly as u_i would without damping, times the common
//! decay. For binomial u_i these are eqs. (30)–(32) of the paper.
//!
//! Several modes are shaped by the convolution of their shapers: amplitudes multiply, times add.

use super::mode::Mode;
use super::pattern::Pattern;

/// One impulse of a shaper in continuous time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// Dimensionless; the amplitudes of a shaper sum to one.
    pub amplitude: f64,
    /// Seconds after the first impulse.
    pub time_s: f64,
}

/// The impulses of one mode's shaper, in order of time.
pub fn single_mode(mode: &Mode) -> impl Iterator<Item = Impulse> + Clone + use<> {
    let pattern = Pattern::of(mode.shaper());
    let spacing = pattern.spacing_half_periods();
    let spacing_s = spacing * mode.half_period_s();
    let mut amplitudes = pattern.undamped().clone();
    for (amplitude, i) in amplitudes.iter_mut().zip(0..) {
        *amplitude *= mode.decay_over(f64::from(i) * spacing);
    }
    let sum: f64 = amplitudes.iter().sum();
    amplitudes
        .into_iter()
        .zip(0..)
        .map(move |(amplitude, i)| Impulse { amplitude: amplitude / sum, time_s: f64::from(i) * spacing_s })
}

/// The impulses of the convolution of all modes' shapers, the last mode's running fastest. They are
/// not sorted by time when the modes' durations overlap. No modes give the identity.
pub fn convolved(modes: &[Mode]) -> impl Iterator<Item = Impulse> + Clone + '_ {
    let impulses_of = |mode: &Mode| Pattern::of(mode.shaper()).undamped().len();
    let count: usize = modes.iter().map(impulses_of).product();
    (0..count).map(move |index| {
        // `index` in the mixed radix of the modes' impulse counts names one impulse of each mode.
        let mut rest = index;
        let mut product = Impulse { amplitude: 1.0, time_s: 0.0 };
        for mode in modes.iter().rev() {
            let impulses = impulses_of(mode);
            if let Some(impulse) = single_mode(mode).nth(rest % impulses) {
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
    modes.iter().map(|mode| Pattern::of(mode.shaper()).half_periods() * mode.half_period_s()).sum()
}

/// The centroid of the convolution in seconds: how far the shaped command lags behind on a ramp.
pub fn delay_s(modes: &[Mode]) -> f64 {
    modes
        .iter()
        .map(|mode| single_mode(mode).map(|impulse| impulse.amplitude * impulse.time_s).sum::<f64>())
        .sum()
}
