//! One shaper for an axis, held to what its definition says of random axes.

use proptest::prelude::*;
use stillbeam_firmware::shaper::design::single_mode;
use stillbeam_firmware::shaper::residual::residual_vibration;
use stillbeam_firmware::shaper::{Mode, ShaperType};
use stillbeam_shape::{AxisComparison, AxisMode, AxisRequest, AxisShaper, Corner, ModeBox, ShapeError};

fn mode(hz: f64, zeta: f64, fraction: f64, weight: f64) -> AxisMode {
    AxisMode { area: ModeBox::around(hz, zeta, fraction, 0.0).expect("a box"), weight }
}

fn of_kind(comparison: &AxisComparison, kind: ShaperType) -> AxisShaper {
    *comparison.shapers.iter().find(|shaper| shaper.mode.shaper() == kind).expect("every type")
}

#[test]
fn on_a_mode_that_is_known_exactly_zv_leaves_nothing_and_is_taken() {
    let comparison = AxisComparison::new(&[mode(40.0, 0.05, 0.0, 1.0)], &AxisRequest::default()).unwrap();
    let zv = of_kind(&comparison, ShaperType::Zv);
    assert!(zv.residual < 1e-3 && (zv.mode.frequency_hz() - 40.0).abs() < 0.01, "{zv:?}");
    assert_eq!((comparison.best.mode.shaper(), comparison.within_tolerance), (ShaperType::Zv, true));
}

#[test]
fn wider_boxes_call_for_slower_shapers() {
    let best_of = |fraction| {
        AxisComparison::new(&[mode(40.0, 0.05, fraction, 1.0)], &AxisRequest::default()).unwrap().best
    };
    let fractions = [0.0, 0.05, 0.1, 0.2, 0.3];
    let best = fractions.map(best_of);
    let slower = |pair: &[AxisShaper]| pair[1].largest_acceleration_m_s2 <= pair[0].largest_acceleration_m_s2;
    assert!(best.windows(2).all(slower), "{best:?}");
    assert!(best[4].largest_acceleration_m_s2 < 0.5 * best[0].largest_acceleration_m_s2);
}

/// Klipper's documentation, "Resonance compensation", lists for every type the largest deviation of the
/// frequency that leaves at most 5 % of the vibration, such as ±5 % for ZV and ±20 % for EI.
#[test]
fn types_cover_the_deviations_that_printers_documentation_states() {
    for (kind, fraction) in [(ShaperType::Zv, 0.03), (ShaperType::Ei, 0.2), (ShaperType::Ei2, 0.35)] {
        let comparison =
            AxisComparison::new(&[mode(40.0, 0.1, fraction, 1.0)], &AxisRequest::default()).unwrap();
        let residual = of_kind(&comparison, kind).residual;
        assert!(residual < 0.06, "{kind:?} over ±{fraction}: {residual}");
    }
}

#[test]
fn an_axis_without_modes_or_with_a_weightless_one_is_refused() {
    let request = AxisRequest::default();
    assert_eq!(AxisComparison::new(&[], &request), Err(ShapeError::NoModes));
    let weightless = AxisComparison::new(&[mode(40.0, 0.05, 0.0, 0.0)], &request);
    assert!(matches!(weightless, Err(ShapeError::Weight { .. })), "{weightless:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// No frequency of a fine grid leaves less than the one that was found, and the choice is what its
    /// definition says.
    #[test]
    fn every_type_stands_at_its_best_frequency(
        first_hz in 15.0..60.0_f64, ratio in 1.1..3.0_f64, zeta in 0.01..0.15_f64,
        fraction in 0.0..0.12_f64, weight in 0.05..1.0_f64,
    ) {
        let modes = [mode(first_hz, zeta, fraction, 1.0), mode(first_hz * ratio, zeta, fraction, weight)];
        let comparison = AxisComparison::new(&modes, &AxisRequest::default()).unwrap();
        let left = |shaper: &Mode| -> f64 {
            modes.iter().map(|mode| {
                let [low_hz, high_hz] = mode.area.frequency_hz();
                let worst = (0..=24).map(|step| low_hz + (high_hz - low_hz) * f64::from(step) / 24.0)
                    .map(|hz| residual_vibration(single_mode(shaper), hz, zeta)).fold(0.0, f64::max);
                mode.weight * worst / (1.0 + weight)
            }).sum()
        };
        for shaper in &comparison.shapers {
            prop_assert!((left(&shaper.mode) - shaper.residual).abs() < 1e-12);
            for step in 0..300 {
                let hz = 0.8 * first_hz * (1.5 * ratio).powf(f64::from(step) / 300.0);
                let other = left(&Mode::new(hz, zeta, shaper.mode.shaper()).unwrap());
                prop_assert!(other > shaper.residual - 2e-3, "{hz} Hz leaves {other}, {shaper:?}");
            }
        }
        let best = &comparison.best;
        prop_assert_eq!(best.residual <= 0.05, comparison.within_tolerance);
        for shaper in &comparison.shapers {
            if comparison.within_tolerance {
                let quicker = shaper.largest_acceleration_m_s2 > best.largest_acceleration_m_s2;
                prop_assert!(!(quicker && shaper.residual <= 0.05));
            } else {
                prop_assert!(shaper.residual >= best.residual);
            }
        }
        let deviation_m = best.spread.corner_deviation_m(best.largest_acceleration_m_s2, Corner::default().speed_m_s);
        prop_assert!((deviation_m - Corner::default().deviation_m).abs() < 1e-9);
    }
}
