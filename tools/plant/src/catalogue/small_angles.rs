//! Sines of small angles by their series, to a few roundings: steps along a wave are short, and laws ask for
//! them again and again.

/// Angles up to this have series of few terms; beyond, the sine itself is asked.
const SMALL: f64 = 0.25;

/// Sine and cosine of an angle, mostly small.
pub(super) fn sine_and_cosine(angle: f64) -> (f64, f64) {
    if angle.abs() > SMALL {
        return angle.sin_cos();
    }
    (angle * sine_over(angle * angle), cosine(angle * angle))
}

/// `sin(x)/x`: the mean of a sine over a stretch of half-width `x` is this times the sine at its middle.
pub(super) fn sine_over_angle(angle: f64) -> f64 {
    if angle.abs() > SMALL { angle.sin() / angle } else { sine_over(angle * angle) }
}

/// To x¹²: the next term is below 1e-20.
fn sine_over(squared: f64) -> f64 {
    const TERMS: [f64; 6] =
        [1.0 / 6_227_020_800.0, -1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0];
    TERMS.iter().fold(0.0, |sum, term| sum * squared + term) * squared + 1.0
}

/// To x¹²: the next term is below 1e-19.
fn cosine(squared: f64) -> f64 {
    const TERMS: [f64; 6] =
        [1.0 / 479_001_600.0, -1.0 / 3_628_800.0, 1.0 / 40_320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5];
    TERMS.iter().fold(0.0, |sum, term| sum * squared + term) * squared + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_the_sines_to_a_few_roundings_on_either_side_of_where_they_end() {
        for k in -4000..=4000 {
            let angle = 1e-4 * f64::from(k) + 1e-9;
            let (sine, cosine) = sine_and_cosine(angle);
            assert!((sine - angle.sin()).abs() <= 4.5e-16 * angle.abs(), "{angle}");
            assert!((cosine - angle.cos()).abs() <= 2.3e-16, "{angle}");
            assert!((sine_over_angle(angle) - angle.sin() / angle).abs() <= 2.3e-16, "{angle}");
        }
        assert_eq!(sine_over_angle(0.0), 1.0);
    }
}
