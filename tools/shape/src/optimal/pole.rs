//! A mode's pole, and what a tap does to the mode.

use std::ops::{Add, AddAssign, Mul};

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Complex {
    pub(crate) re: f64,
    pub(crate) im: f64,
}

impl Complex {
    pub(crate) fn from_polar(magnitude: f64, angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Self { re: magnitude * cosine, im: magnitude * sine }
    }

    pub(crate) fn magnitude(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// The real part of the product with the other's conjugate.
    pub(crate) fn along(self, other: Self) -> f64 {
        self.re * other.re + self.im * other.im
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { re: factor * self.re, im: factor * self.im }
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

/// A mode's pole: −`decay_per_s` ± j`omega_damped`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pole {
    pub(crate) decay_per_s: f64,
    pub(crate) omega_damped: f64,
}

impl Pole {
    pub(crate) fn new(frequency_hz: f64, damping_ratio: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency_hz;
        Self {
            decay_per_s: damping_ratio * omega,
            omega_damped: omega * (1.0 - damping_ratio * damping_ratio).sqrt(),
        }
    }

    /// What is left at `end_s` of the ringing that a unit impulse at `time_s` starts, with its phase.
    pub(crate) fn ringing(&self, time_s: f64, end_s: f64) -> Complex {
        Complex::from_polar((self.decay_per_s * (time_s - end_s)).exp(), self.omega_damped * time_s)
    }

    /// The factor between the ringing of an impulse and of one `step_s` later.
    pub(crate) fn step(&self, step_s: f64) -> Complex {
        Complex::from_polar((self.decay_per_s * step_s).exp(), self.omega_damped * step_s)
    }
}
