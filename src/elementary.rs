//! Sine and cube root over the arguments that the firmware has, as near as libm's and in a tenth of its code:
//! libm reduces angles of any size, and carries two numbers for one. `golden_mathematics` measures both.

use core::f64::consts::{FRAC_PI_2, PI};

/// What π has beyond its `f64`.
const PI_REST: f64 = 1.224_646_799_147_353_2e-16;

/// The sine of an angle from zero to a half turn, in radians.
pub fn sine_in_half_turn(angle: f64) -> f64 {
    let angle = if angle > FRAC_PI_2 { (PI - angle) + PI_REST } else { angle };
    let square = angle * angle;
    // Taylor's series to the 21st power; what is left out is below 10⁻¹⁷ at the right angle.
    let series = (1..=10).rev().fold(0.0, |series, term| {
        let factors = f64::from(2 * term * (2 * term + 1));
        square / factors * -(1.0 + series)
    });
    angle + angle * series
}

/// The cube root of a number that is not negative, from 10⁻¹⁰⁰ to 10¹⁰⁰ or zero.
pub fn cube_root(number: f64) -> f64 {
    // Of 24 bits, so that its square is exact; one step of Halley's makes it 53.
    let guess = f64::from(libm::exp(libm::log(number) / 3.0) as f32);
    if guess == 0.0 {
        return 0.0;
    }
    let other = number / (guess * guess);
    guess + guess * (other - guess) / (2.0 * guess + other)
}
