//! Residual vibration of a shaper, as a fraction of what the unshaped command leaves behind.
//!
//! An impulse of amplitude A at time t leaves a mode (ω, ζ) ringing with amplitude
//! A exp(−ζω(t_n − t)) at the later time t_n and phase −ω_d t. The vibration after a sequence,
//! relative to that after one unit impulse at the time of the last one, is
//!
//! > V = exp(−ζω t_n) |Σ A_i exp(ζω t_i) exp(j ω_d t_i)|
//!
//! (Singer and Seering 1990, eq. 9; "percentage vibration" in the paper is 100 V). It holds for taps
//! on the tick grid as for impulses in continuous time, and multiplies over the stages of a cascade.

use super::design::Impulse;

/// V of `impulses` for a mode of undamped frequency `frequency_hz` and `damping_ratio` < 1. The
/// impulses may come in any order.
pub fn residual_vibration(
    impulses: impl Iterator<Item = Impulse> + Clone,
    frequency_hz: f64,
    damping_ratio: f64,
) -> f64 {
    let omega = core::f64::consts::TAU * frequency_hz;
    let decay_rate = damping_ratio * omega;
    let omega_damped = omega * libm::sqrt(1.0 - damping_ratio * damping_ratio);
    let last_s = impulses.clone().fold(0.0, |last: f64, impulse| last.max(impulse.time_s));
    let (cosine, sine) = impulses.fold((0.0, 0.0), |(cosine, sine), impulse| {
        // Weighed relative to the end, so that nothing overflows for long or heavily damped cases.
        let amplitude = impulse.amplitude * libm::exp(decay_rate * (impulse.time_s - last_s));
        let phase = omega_damped * impulse.time_s;
        (cosine + amplitude * libm::cos(phase), sine + amplitude * libm::sin(phase))
    });
    libm::hypot(cosine, sine)
}
