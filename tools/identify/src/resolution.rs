//! The least differences that a record can show at all.
//!
//! Without noise standard errors are those of rounding, and two methods, or two records, differ by many of
//! them to no meaning. What a record shows has an end that noise does not set: interpolating the input
//! between its samples leaves some 80 dB below the output, and the order of a model is chosen to no more than
//! that.

use crate::modal_response::Pole;

/// Share of a mode's part in the record below which nothing is told apart.
const TOLD_APART: f64 = 1e-4;

/// Least differences of a mode's frequency (Hz) and of its damping ratio that matter to a record of this
/// length.
///
/// The mode is seen for a time T, the record's length or the decay time if that is shorter. In it a frequency
/// off by df turns the mode's phase by 2 pi df T, and a damping ratio off by dz changes its amplitude by the
/// share omega dz T.
pub fn resolution(frequency_hz: f64, damping_ratio: f64, duration_s: f64) -> [f64; 2] {
    let seen_s = Pole { frequency_hz, damping_ratio }.decay_time_s().min(duration_s);
    let least_hz = TOLD_APART / (std::f64::consts::TAU * seen_s);
    [least_hz, least_hz / frequency_hz]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A decay and the same with frequency or damping off by the resolution: a ten-thousandth apart where
    /// they differ most.
    #[test]
    fn a_mode_off_by_the_resolution_is_off_by_the_share_that_is_told_apart() {
        let decay = |frequency_hz: f64, damping_ratio: f64, t: f64| {
            let w = std::f64::consts::TAU * frequency_hz;
            (-damping_ratio * w * t).exp() * (w * t).sin()
        };
        for (damping_ratio, duration_s) in [(0.003, 80.0), (0.003, 2.0), (0.05, 20.0)] {
            let [least_hz, least_ratio] = resolution(6.9, damping_ratio, duration_s);
            for (df, dz) in [(least_hz, 0.0), (0.0, least_ratio)] {
                let times = (0..(1000.0 * duration_s) as u32).map(|k| 1e-3 * f64::from(k));
                let apart = times
                    .map(|t| (decay(6.9 + df, damping_ratio + dz, t) - decay(6.9, damping_ratio, t)).abs());
                let most = apart.fold(0.0, f64::max);
                // At its largest after one decay time, where a decay has fallen to 1 / e.
                assert!((0.3 * TOLD_APART..1.01 * TOLD_APART).contains(&most), "{damping_ratio} {most}");
            }
        }
    }
}
