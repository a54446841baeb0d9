//! The drive between the setpoint and the base.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use crate::model::InvalidParameter;
use crate::model::positive;

/// A second-order position servo, `[drive]` of a model file: `y'' + 2 zeta omega y' + omega² y = omega²
/// setpoint`, reaction of the beam on the base neglected (a stiff servo).
///
/// | key | meaning | range |
/// |---|---|---|
/// | `bandwidth_hz` | frequency at which the response has fallen by 3 dB | above 0 |
/// | `damping_ratio` | of the servo's pole pair | above 0; 0.7071 if absent |
///
/// The section absent is an ideal drive: the base is where the setpoint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoDrive {
    /// −3 dB bandwidth in hertz, above 0.
    pub bandwidth_hz: f64,
    /// Damping ratio, above 0; may exceed 1.
    pub damping_ratio: f64,
}

impl ServoDrive {
    /// Damping ratio of a drive whose file gives none: the flattest response.
    pub const DEFAULT_DAMPING_RATIO: f64 = FRAC_1_SQRT_2;

    pub(crate) const PARAMETER_PATHS: [&str; 2] = ["drive.bandwidth_hz", "drive.damping_ratio"];

    /// Undamped natural frequency in rad/s, at which a pole pair of this damping has the given bandwidth:
    /// `|H(omega_b)|² = 1/2` solved for `omega`.
    pub fn natural_frequency_rad_s(&self) -> f64 {
        let middle = 1.0 - 2.0 * self.damping_ratio * self.damping_ratio;
        let bandwidth_rad_s = TAU * self.bandwidth_hz;
        // For heavy damping `middle` is large and negative and the plain root would cancel.
        let root = middle.hypot(1.0);
        let ratio_squared = if middle >= 0.0 { middle + root } else { 1.0 / (root - middle) };
        bandwidth_rad_s / ratio_squared.sqrt()
    }

    /// Time in seconds after which a step's error has surely fallen below `fraction` (0 to 1) of the step.
    pub fn settling_time_s(&self, fraction: f64) -> f64 {
        let (omega, zeta) = (self.natural_frequency_rad_s(), self.damping_ratio);
        // Slowest pole; the two-fold pole's extra factor t is covered by the doubled logarithm.
        let decay_per_s =
            if zeta <= 1.0 { zeta * omega } else { omega / (zeta + (zeta * zeta - 1.0).sqrt()) };
        2.0 * (1.0 / fraction).ln().max(0.0) / decay_per_s
    }

    pub(crate) fn check(&self) -> Result<(), InvalidParameter> {
        positive("drive.bandwidth_hz", self.bandwidth_hz)?;
        positive("drive.damping_ratio", self.damping_ratio)
    }
}
