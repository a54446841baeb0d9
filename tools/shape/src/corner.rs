//! How far a shaper takes a path off its corners, and the acceleration at which that is as much as may be.
//!
//! A shaper averages the command over its impulses, so the setpoint cuts corners. With the impulses A_i at
//! T_i, their mean time T = Σ A_i T_i, and τ_i = T_i − T, two corners are taken at the instant at which the
//! shaped path is abreast of them:
//!
//! - a reversal, x = ½ a t² about its turning point, is short of it by ½ a Σ A_i τ_i²;
//! - a right angle between two axes shaped alike, each braking from the corner speed v to rest at the corner
//!   or leaving it in the same way: each axis is off by Σ_{τ_i ≥ 0} A_i (v τ_i + ½ a τ_i²), and the path by
//!   √2 of that.
//!
//! The larger of the two is the *corner deviation*. Motion controllers for printers call it smoothing, and
//! what they recommend as the largest acceleration is that with a deviation of 0.12 mm at a corner speed of 5
//! mm/s (Klipper documentation, "Resonance compensation" and "Measuring resonances").

use stillbeam_firmware::shaper::design::Impulse;

/// How corners are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Speed at which a right angle is passed, metres per second.
    pub speed_m_s: f64,
    /// How far the path may be off a corner, metres.
    pub deviation_m: f64,
}

impl Default for Corner {
    /// 5 mm/s and 0.12 mm, as printers' controllers take them.
    fn default() -> Self {
        Self { speed_m_s: 0.005, deviation_m: 0.000_12 }
    }
}

/// Moments of a shaper's impulses about their mean time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpulseSpread {
    /// Σ A τ over the later impulses, seconds.
    later_first_s: f64,
    /// Σ A τ² over the later impulses, seconds squared.
    later_second_s2: f64,
    /// Σ A τ² over all, seconds squared.
    second_s2: f64,
}

impl ImpulseSpread {
    /// Of impulses whose amplitudes sum to 1.
    pub fn of(impulses: impl Iterator<Item = Impulse> + Clone) -> Self {
        let mean_s: f64 = impulses.clone().map(|impulse| impulse.amplitude * impulse.time_s).sum();
        let mut spread = Self { later_first_s: 0.0, later_second_s2: 0.0, second_s2: 0.0 };
        for impulse in impulses {
            let late_s = impulse.time_s - mean_s;
            let second_s2 = impulse.amplitude * late_s * late_s;
            spread.second_s2 += second_s2;
            if late_s >= 0.0 {
                spread.later_first_s += impulse.amplitude * late_s;
                spread.later_second_s2 += second_s2;
            }
        }
        spread
    }

    /// The corner deviation at an acceleration in metres per second squared and a corner speed in metres per
    /// second, in metres.
    pub fn corner_deviation_m(&self, acceleration_m_s2: f64, speed_m_s: f64) -> f64 {
        let reversal_m = 0.5 * acceleration_m_s2 * self.second_s2;
        let one_axis_m = speed_m_s * self.later_first_s + 0.5 * acceleration_m_s2 * self.later_second_s2;
        reversal_m.max(std::f64::consts::SQRT_2 * one_axis_m)
    }

    /// The largest acceleration with which the corner deviation stays within the bound, in metres per second
    /// squared: 0 where the corner speed alone exceeds it, infinite for a single impulse.
    pub fn largest_acceleration_m_s2(&self, corner: &Corner) -> f64 {
        let one_axis_m =
            corner.deviation_m / std::f64::consts::SQRT_2 - corner.speed_m_s * self.later_first_s;
        let at_right_angle = 2.0 * one_axis_m.max(0.0) / self.later_second_s2;
        let at_reversal = 2.0 * corner.deviation_m / self.second_s2;
        // 0 over 0, a single impulse, bounds nothing.
        at_reversal.min(if at_right_angle.is_nan() { f64::INFINITY } else { at_right_angle })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use stillbeam_firmware::shaper::design::single_mode;
    use stillbeam_firmware::shaper::{Mode, ShaperType};

    use super::*;

    fn spread(kind: ShaperType, hz: f64, zeta: f64) -> ImpulseSpread {
        ImpulseSpread::of(single_mode(&Mode::new(hz, zeta, kind).expect("a mode")))
    }

    /// The path that the shaper makes of a corner, by shaping the path itself.
    fn shaped(kind: ShaperType, (hz, zeta): (f64, f64), path_m: impl Fn(f64) -> f64) -> f64 {
        let impulses: Vec<Impulse> = single_mode(&Mode::new(hz, zeta, kind).expect("a mode")).collect();
        let mean_s: f64 = impulses.iter().map(|impulse| impulse.amplitude * impulse.time_s).sum();
        impulses.iter().map(|impulse| impulse.amplitude * path_m(mean_s - impulse.time_s)).sum()
    }

    proptest! {
        #[test]
        fn the_deviation_is_that_of_the_shaped_path(
            hz in 5.0..120.0_f64, zeta in 0.0..0.2_f64, a in 0.1..20.0_f64, v in 0.0..0.02_f64, kind in 0..8_usize,
        ) {
            let kind = ShaperType::ALL[kind];
            let reversal_m = shaped(kind, (hz, zeta), |t| 0.5 * a * t * t);
            let arriving_m = shaped(kind, (hz, zeta), |t| if t < 0.0 { v * t - 0.5 * a * t * t } else { 0.0 });
            let expected_m = reversal_m.max(-std::f64::consts::SQRT_2 * arriving_m);
            let deviation_m = spread(kind, hz, zeta).corner_deviation_m(a, v);
            prop_assert!((deviation_m - expected_m).abs() < 1e-12 + 1e-9 * expected_m);
        }

        #[test]
        fn the_largest_acceleration_uses_up_the_deviation(
            hz in 5.0..120.0_f64, zeta in 0.0..0.2_f64, kind in 0..8_usize, v in 0.0..0.02_f64,
        ) {
            let spread = spread(ShaperType::ALL[kind], hz, zeta);
            let corner = Corner { speed_m_s: v, ..Corner::default() };
            let a = spread.largest_acceleration_m_s2(&corner);
            let deviation_m = spread.corner_deviation_m(a, v);
            if a > 0.0 {
                prop_assert!((deviation_m - corner.deviation_m).abs() < 1e-9 * corner.deviation_m);
            } else {
                prop_assert!(deviation_m >= corner.deviation_m);
            }
        }
    }

    #[test]
    fn a_single_impulse_bounds_no_acceleration() {
        let spread = ImpulseSpread::of([Impulse { amplitude: 1.0, time_s: 0.0 }].into_iter());
        assert_eq!(spread.largest_acceleration_m_s2(&Corner::default()), f64::INFINITY);
        assert_eq!(spread.corner_deviation_m(10.0, 0.005), 0.0);
    }
}
