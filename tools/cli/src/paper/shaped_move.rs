//! Moves of other profiles and durations than the board's, shaped in continuous time, for the search of the
//! paper's.

use stillbeam_firmware::shaper::Mode;
use stillbeam_firmware::shaper::design::{Impulse, convolved};

/// Setpoints per second.
pub const RATE_HZ: f64 = 1000.0;

/// The move's length in metres.
pub const LENGTH_M: f64 = 0.05;

/// How the position rises from start to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Constant velocity.
    Ramp,
    /// Constant acceleration, then as much deceleration: the quickest within an acceleration.
    Triangle,
    /// A polynomial of the fifth degree without jumps of the acceleration.
    Smooth,
}

impl Profile {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Ramp, Self::Triangle, Self::Smooth];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ramp => "constant velocity",
            Self::Triangle => "triangular velocity",
            Self::Smooth => "fifth-degree polynomial",
        }
    }

    /// Share of the way at a share of the time; 0 before the start and 1 after the end.
    pub fn position(self, time: f64) -> f64 {
        let s = time.clamp(0.0, 1.0);
        match self {
            Self::Ramp => s,
            Self::Triangle if s < 0.5 => 2.0 * s * s,
            Self::Triangle => 1.0 - 2.0 * (1.0 - s) * (1.0 - s),
            Self::Smooth => s * s * s * (10.0 - 15.0 * s + 6.0 * s * s),
        }
    }
}

/// Setpoints in metres of the move of `duration_s` seconds, shaped for `modes`, at [`RATE_HZ`] from rest to
/// rest.
pub fn setpoints_m(profile: Profile, duration_s: f64, modes: &[Mode]) -> Vec<f64> {
    let impulses: Vec<Impulse> = convolved(modes).collect();
    let samples = (length_s(duration_s, modes) * RATE_HZ).ceil() as usize + 1;
    let position = |time_s: f64| {
        let parts = impulses
            .iter()
            .map(|impulse| impulse.amplitude * profile.position((time_s - impulse.time_s) / duration_s));
        LENGTH_M * parts.sum::<f64>()
    };
    (0..=samples).map(|sample| position(sample as f64 / RATE_HZ)).collect()
}

/// Seconds from the move's start to the end of its last impulse.
pub fn length_s(duration_s: f64, modes: &[Mode]) -> f64 {
    duration_s + convolved(modes).map(|impulse| impulse.time_s).fold(0.0, f64::max)
}
