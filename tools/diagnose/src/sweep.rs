//! A sweep that the board would make: what it asks of the machine, and the line that asks for it.

use std::f64::consts::TAU;

use crate::options::MachineLimits;

/// The longest fade at either end; of short sweeps it is this share.
const FADE_S: f64 = 0.5;
const FADE_SHARE: f64 = 0.1;

/// A run of the machine that has not been made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Whether the frequency changes by equal ratios instead of equal steps.
    pub exponential: bool,
    /// First frequency, Hz.
    pub from_hz: f64,
    /// Last frequency, Hz; another than the first.
    pub to_hz: f64,
    /// Seconds.
    pub duration_s: f64,
    /// In the input's unit.
    pub amplitude: f64,
}

impl Sweep {
    /// The input at a time, in its unit.
    pub fn at(&self, t_s: f64) -> f64 {
        let phase = if self.exponential {
            let rate = (self.to_hz / self.from_hz).ln() / self.duration_s;
            TAU * self.from_hz * ((rate * t_s).exp() - 1.0) / rate
        } else {
            TAU * (self.from_hz * t_s + 0.5 * (self.to_hz - self.from_hz) / self.duration_s * t_s * t_s)
        };
        let fade_s = self.fade_s();
        let fade = (t_s / fade_s).min((self.duration_s - t_s) / fade_s).clamp(0.0, 1.0);
        self.amplitude * fade * phase.sin()
    }

    fn fade_s(&self) -> f64 {
        FADE_S.min(FADE_SHARE * self.duration_s)
    }

    /// The largest amplitude, in the input's unit, that the board takes; `mass_kg` is what a force moves,
    /// `None` where the input is a motion.
    pub fn most_within(&self, limits: &MachineLimits, mass_kg: Option<f64>) -> f64 {
        let MachineLimits { half_travel_m, velocity_m_s, acceleration_m_s2, jerk_m_s3 } = *limits;
        // What the bounds grow with is largest at one of the ends.
        let ends = [self.from_hz, self.to_hz].map(|hz| {
            // A force makes a position that falls with the square of the frequency.
            let per_metre = mass_kg.map_or(1.0, |mass_kg| mass_kg * (TAU * hz).powi(2));
            let [velocity, acceleration, jerk] = self.derivatives(hz, mass_kg.is_some());
            let metres = half_travel_m
                .min(velocity_m_s / velocity)
                .min(acceleration_m_s2 / acceleration)
                .min(jerk_m_s3 / jerk);
            per_metre * metres
        });
        ends[0].min(ends[1])
    }

    /// Bounds of velocity, acceleration and jerk of E sin φ at this frequency, by metre of amplitude: the
    /// envelope E fades by the board's smooth step of the fifth degree and, of a force, falls with the square
    /// of the frequency (docs/derivations/motions.md, "Sweeps").
    fn derivatives(&self, hz: f64, falls_with_square: bool) -> [f64; 3] {
        let omega = TAU * hz;
        let growth = if self.exponential {
            (self.to_hz / self.from_hz).ln().abs() / self.duration_s
        } else {
            (self.to_hz - self.from_hz).abs() / (hz * self.duration_s)
        };
        let per_s = 1.0 / self.fade_s();
        let fade = [15.0 / 8.0 * per_s, 10.0 / 3f64.sqrt() * per_s.powi(2), 60.0 * per_s.powi(3)];
        let square = if falls_with_square { [2.0, 8.0, 24.0] } else { [0.0; 3] };
        let fall = [square[0] * growth, square[1] * growth.powi(2), square[2] * growth.powi(3)];
        let envelope = [
            fade[0] + fall[0],
            fade[1] + 2.0 * fade[0] * fall[0] + fall[1],
            fade[2] + 3.0 * fade[1] * fall[0] + 3.0 * fade[0] * fall[1] + fall[2],
        ];
        let chirp = growth * omega;
        [
            envelope[0].hypot(omega),
            (envelope[1] + omega.powi(2)).hypot(2.0 * envelope[0] * omega + chirp),
            (envelope[2] + 3.0 * envelope[0] * omega.powi(2) + 3.0 * omega * chirp).hypot(
                3.0 * envelope[1] * omega + 3.0 * envelope[0] * chirp + growth * chirp + omega.powi(3),
            ),
        ]
    }

    /// The line for the board's console; `motion`: whether the input is one, in metres, or a force.
    pub fn command(&self, motion: bool) -> String {
        let kind = if self.exponential { "exponential" } else { "linear" };
        let (size, unit) = if motion { (1e3 * self.amplitude, "mm") } else { (self.amplitude, "N") };
        format!(
            "sweep {kind} {} {} {:.0}s {}{unit}",
            rounded(self.from_hz),
            rounded(self.to_hz),
            self.duration_s,
            rounded(size)
        )
    }
}

/// To three digits.
pub(crate) fn rounded(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let power = 10f64.powi(2 - value.abs().log10().floor() as i32);
    (value * power).round() / power
}
