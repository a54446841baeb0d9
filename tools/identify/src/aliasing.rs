//! Whether a mode is what it seems, or the image of one above half the sampling rate.
//!
//! Even samples of a free decay cannot tell: both fit them alike. Uneven stamps can, and so can an input that
//! is known between the output's samples: there the record is fitted with the mode moved to its image, at the
//! same decay.

use crate::forced_model::pole;
use crate::separable::{Separable, sum_of_squares_at};
use crate::tall::dot;

/// What the record says of a mode's image, the frequency mirrored at half the sampling rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Image {
    /// The mode explains the record and its image does not.
    Excluded,
    /// The image explains the record better.
    Likelier,
    /// Both explain it alike.
    Unknown,
}

/// Schwarz's criterion from which one explanation is the better one.
const CLEAR: f64 = 10.0;

/// Compares a fitted mode with its image; the parameters are those of the modes in order.
pub(crate) fn image_of<M: Separable>(
    model: &M,
    parameters: &[f64],
    residuals: &[f64],
    mode: usize,
    nyquist_hz: f64,
) -> Image {
    let here = pole(parameters, mode);
    let image_hz = 2.0 * nyquist_hz - here.frequency_hz;
    if image_hz <= here.frequency_hz {
        return Image::Unknown;
    }
    let mut moved = parameters.to_vec();
    moved[2 * mode] = image_hz.ln();
    moved[2 * mode + 1] = (here.damping_ratio * here.frequency_hz / image_hz).ln();
    let Some(there) = sum_of_squares_at(model, &moved) else { return Image::Excluded };
    let found = dot(residuals, residuals).max(f64::MIN_POSITIVE);
    match residuals.len() as f64 * (there / found).ln() {
        evidence if evidence > CLEAR => Image::Excluded,
        evidence if evidence < -CLEAR => Image::Likelier,
        _ => Image::Unknown,
    }
}
