//! How far libm and micromath are off, in every use that the firmware makes of them and over the arguments
//! that it has there.

use micromath::F32Ext;
use stillbeam_firmware::elementary::{cube_root, sine_in_half_turn};

/// Arguments per range.
const PLACES: u32 = 200_000;
/// Off the platform's own functions, themselves within one, by at most so many units in the last place of an
/// f64: 2.2 × 10⁻¹⁶ each.
const LAST_PLACES: f64 = 1.1;

/// From `low` to `high`, evenly in the logarithm where both are above zero, and at no round number.
fn places(low: f64, high: f64) -> impl Iterator<Item = f64> {
    (0..=PLACES).map(move |place| {
        let part = (f64::from(place) + 0.382 * f64::from(place % 7) / 7.0).min(f64::from(PLACES))
            / f64::from(PLACES);
        if low > 0.0 { low * (high / low).powf(part) } else { low + (high - low) * part }
    })
}

/// The largest distance of two functions, in units of the last place of the second.
fn last_places(low: f64, high: f64, ours: impl Fn(f64) -> f64, theirs: impl Fn(f64) -> f64) -> f64 {
    places(low, high).fold(0.0, |worst: f64, x| {
        let (found, expected) = (ours(x), theirs(x));
        let unit = expected.abs().max(f64::MIN_POSITIVE) * f64::EPSILON / 2.0;
        worst.max((found - expected).abs() / (2.0 * unit))
    })
}

#[test]
fn libm_is_within_a_last_place_wherever_the_firmware_asks_it() {
    use std::f64::consts::PI;
    type Function = fn(f64) -> f64;
    let cases: [(&str, f64, f64, Function, Function); 16] = [
        // Decay in half a period, damping ratios up to 0.9; in a fraction of a tick either way.
        ("exp, a mode's half period", -6.5, 0.0, libm::exp, f64::exp),
        ("exp, a fraction of a tick", -6.5, 6.5, libm::exp, f64::exp),
        ("exp, a residual", -700.0, 0.0, libm::exp, f64::exp),
        // The angle of a tick, up to half a turn, and parts of it.
        ("sine, the angle of a tick", 1e-6, PI / 2.0, sine_in_half_turn, f64::sin),
        ("sine, the angle of a long tick", PI / 2.0, PI - 1e-3, sine_in_half_turn, f64::sin),
        ("sine, half a line between knots", 1e-6, PI / 16.0, sine_in_half_turn, f64::sin),
        ("sin, the phase of an impulse", 0.0, 4e6, libm::sin, f64::sin),
        ("cos, the phase of an impulse", 0.0, 4e6, libm::cos, f64::cos),
        // Ratios of the frequencies of a sweep, and their growth in a tick.
        ("ln, a sweep up", 1.000_001, 1e6, libm::log, f64::ln),
        ("ln, a sweep down", 1e-6, 0.999_999, libm::log, f64::ln),
        ("exp m1, a sweep's growth", 1e-12, 0.2, libm::expm1, f64::exp_m1),
        ("exp m1, a sweep's fall", -0.2, -1e-12, libm::expm1, f64::exp_m1),
        ("cbrt, durations by jerk", 1e-6, 1e24, cube_root, f64::cbrt),
        ("cbrt, humps", 1e-4, 0.1, cube_root, f64::cbrt),
        ("sqrt, durations by acceleration", 1e-12, 1e24, libm::sqrt, f64::sqrt),
        ("hypot of one more, a residual", 1e-9, 1e9, |x| libm::hypot(x, 1.0), |x| x.hypot(1.0)),
    ];
    for (name, low, high, ours, theirs) in cases {
        let worst = last_places(low, high, ours, theirs);
        println!("{name}, {low:e} to {high:e}: {worst:.2} last places");
        assert!(worst <= LAST_PLACES, "{name}: {worst}");
    }
    // Whole numbers of ticks stay whole.
    for root in 0..2000_u32 {
        let root = f64::from(root);
        assert_eq!(cube_root(root * root * root), root);
    }
    // These round correctly or not at all.
    for x in places(1e-9, 1e9).flat_map(|x| [x, -x]) {
        assert_eq!(libm::sqrtf(x.abs() as f32), (x.abs() as f32).sqrt());
        for (ours, theirs) in [
            (libm::floor(x), x.floor()),
            (libm::ceil(x), x.ceil()),
            (libm::trunc(x), x.trunc()),
            (libm::round(x), x.round()),
        ] {
            assert_eq!(ours, theirs, "{x}");
        }
        assert_eq!(libm::scalbn(x, 24), x * 2f64.powi(24));
        assert_eq!(libm::ilogb(x), x.abs().log2().floor() as i32, "{x}");
    }
}

/// 1/f of a sweep in 2⁻³² turns per tick: 0.01 Hz at 20 kHz to an eighth of the tick rate.
#[test]
fn micromaths_reciprocal_is_a_guess_within_an_eighth_that_three_steps_of_newton_make_good() {
    let (mut guess, mut refined): (f64, f64) = (0.0, 0.0);
    for frequency in places(2000.0, 6e8).map(|f| f as f32) {
        let off = |inverse: f32| (f64::from(frequency) * f64::from(inverse) - 1.0).abs();
        let mut inverse = F32Ext::inv(frequency);
        guess = guess.max(off(inverse));
        for _ in 0..3 {
            inverse *= 2.0 - frequency * inverse;
        }
        refined = refined.max(off(inverse));
    }
    println!("guess {guess:.4}, after three steps {refined:.2e}");
    assert!(guess <= 0.125 && guess > 0.05, "{guess}");
    assert!(refined <= 2e-7, "{refined:e}");
}
