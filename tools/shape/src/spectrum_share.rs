//! What a shaper leaves of a measured power spectrum, as controllers of printers count it.
//!
//! People know one number for a shaper from Klipper's calibration: its remaining vibrations. With the power
//! density P(f) of the axis' acceleration and the residual V(f, ζ) (Singer and Seering 1990, eq. 9) it is
//!
//! > max over ζ of  Σ_f max(0, V(f, ζ) P(f) − P_max/20)  /  Σ_f max(0, P(f) − P_max/20),
//!
//! with ζ from a fixed list, since a spectrum of one sweep does not tell damping (Klipper documentation,
//! "Resonance compensation": a twentieth of the largest vibration is taken as harmless). It weighs power, not
//! amplitude, and includes whatever the sweep itself put in, so it is a convention to compare by rather than
//! a forecast.

use stillbeam_firmware::shaper::Mode;
use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::residual::residual_vibration;

/// The damping ratios of the convention.
pub const SHARE_DAMPING_RATIOS: [f64; 3] = [0.075, 0.1, 0.15];
/// The part of the largest density below which vibration is harmless.
const HARMLESS: f64 = 1.0 / 20.0;

/// The share that a shaper leaves of a one-sided power density on an even grid, pairs of hertz and density;
/// `None` where there is no power.
pub fn spectrum_share(shaper: &Mode, spectrum: &[(f64, f64)]) -> Option<f64> {
    let largest = spectrum.iter().map(|(_, density)| *density).fold(0.0, f64::max);
    let threshold = HARMLESS * largest;
    let above = |left: &dyn Fn(f64) -> f64| -> f64 {
        spectrum.iter().map(|(hz, density)| (left(*hz) * density - threshold).max(0.0)).sum()
    };
    let unshaped = above(&|_| 1.0);
    let shares = SHARE_DAMPING_RATIOS.map(|damping_ratio| {
        above(&|hz| residual_vibration(single_mode(shaper), hz, damping_ratio)) / unshaped
    });
    (unshaped > 0.0).then(|| shares.into_iter().fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use stillbeam_firmware::shaper::ShaperType;

    use super::*;

    /// A resonance at 50 Hz over a floor.
    fn spectrum() -> Vec<(f64, f64)> {
        (1..400).map(|step| f64::from(step) * 0.5).map(|hz| (hz, 1.0 / (1.0 + (hz - 50.0).powi(2)))).collect()
    }

    fn share(kind: ShaperType, hz: f64) -> f64 {
        spectrum_share(&Mode::new(hz, 0.1, kind).expect("a mode"), &spectrum()).expect("power")
    }

    #[test]
    fn a_shaper_at_the_resonance_leaves_little_and_one_elsewhere_much() {
        assert!(share(ShaperType::Zv, 50.0) < 0.1, "{}", share(ShaperType::Zv, 50.0));
        assert!(share(ShaperType::Zv, 25.0) > 0.5, "{}", share(ShaperType::Zv, 25.0));
        assert!(share(ShaperType::Zvd, 46.0) < share(ShaperType::Zv, 46.0));
    }

    #[test]
    fn a_spectrum_without_power_has_no_share() {
        let mode = Mode::new(50.0, 0.1, ShaperType::Zv).expect("a mode");
        assert_eq!(spectrum_share(&mode, &[(1.0, 0.0), (2.0, 0.0)]), None);
        assert_eq!(spectrum_share(&mode, &[]), None);
    }
}
