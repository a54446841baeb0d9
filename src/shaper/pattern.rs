//! The types of shapers without damping: amplitudes at equal distances.
//!
//! Every type is one list of numbers u_i and one distance σ in half periods. On an undamped mode the u_i
//! are the amplitudes; on a damped one each is scaled by the decay until its time (`design`). Sources:
//! Singer and Seering 1990 for the binomials; Singhose, Derezinski and Singer 1996 (AIAA) for the
//! extra-insensitive (EI) family, whose closed forms hold for any tolerance V; MZV has the single zero of
//! ZV, with three impulses at distances of 3/4 of a half period.
//!
//! | type | u | σ | half periods |
//! |---|---|---|---|
//! | ZV … ZVDDD | binomial coefficients of n = 1 … 4 | 1 | n |
//! | EI | (1 + V)/4, (1 − V)/2, (1 + V)/4 | 1 | 2 |
//! | EI2 | a, 1/2 − a, 1/2 − a, a, a = (3X² + 2X + 3V²)/(16X), X = ∛(V²(√(1 − V²) + 1)) | 1 | 3 |
//! | EI3 | a, b, 1 − 2(a + b), b, a, a = (1 + 3V + 2√(2(V² + V)))/16, b = (1 − V)/4 | 1 | 4 |
//! | MZV | 1, √2, 1 | 3/4 | 1.5 |

use heapless::Vec;

use super::mode::ShaperType;
use crate::elementary::cube_root;

/// The largest residual vibration that the EI family leaves within its band, as a fraction: 5 %, the value
/// that published tables are made for.
pub const TOLERANCE: f64 = 0.05;

/// The most impulses of one mode's shaper.
pub const MAX_IMPULSES: usize = 5;

/// The amplitudes of a type on an undamped mode, up to a common factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    undamped: Vec<f64, MAX_IMPULSES>,
    spacing_half_periods: f64,
}

impl Pattern {
    /// The pattern of a type.
    pub fn of(shaper: ShaperType) -> Self {
        const V: f64 = TOLERANCE;
        match shaper {
            ShaperType::Zv => Self::every_half_period(&[1.0, 1.0]),
            ShaperType::Zvd => Self::every_half_period(&[1.0, 2.0, 1.0]),
            ShaperType::Zvdd => Self::every_half_period(&[1.0, 3.0, 3.0, 1.0]),
            ShaperType::Zvddd => Self::every_half_period(&[1.0, 4.0, 6.0, 4.0, 1.0]),
            ShaperType::Ei => {
                let outer = (1.0 + V) / 4.0;
                Self::every_half_period(&[outer, (1.0 - V) / 2.0, outer])
            }
            ShaperType::Ei2 => {
                let x = cube_root(V * V * (libm::sqrt(1.0 - V * V) + 1.0));
                let outer = (3.0 * x * x + 2.0 * x + 3.0 * V * V) / (16.0 * x);
                Self::every_half_period(&[outer, 0.5 - outer, 0.5 - outer, outer])
            }
            ShaperType::Ei3 => {
                let outer = (1.0 + 3.0 * V + 2.0 * libm::sqrt(2.0 * (V * V + V))) / 16.0;
                let inner = (1.0 - V) / 4.0;
                Self::every_half_period(&[outer, inner, 1.0 - 2.0 * (outer + inner), inner, outer])
            }
            ShaperType::Mzv => {
                let undamped = Vec::from_iter([1.0, core::f64::consts::SQRT_2, 1.0]);
                Self { undamped, spacing_half_periods: 0.75 }
            }
        }
    }

    /// The amplitudes in order of time; all positive, their sum is not one in general.
    pub fn undamped(&self) -> &Vec<f64, MAX_IMPULSES> {
        &self.undamped
    }

    /// From one impulse to the next, in half damped periods.
    pub fn spacing_half_periods(&self) -> f64 {
        self.spacing_half_periods
    }

    /// From the first impulse to the last, in half damped periods.
    pub fn half_periods(&self) -> f64 {
        (self.undamped.len() - 1) as f64 * self.spacing_half_periods
    }

    fn every_half_period(undamped: &[f64]) -> Self {
        Self { undamped: undamped.iter().copied().collect(), spacing_half_periods: 1.0 }
    }
}
