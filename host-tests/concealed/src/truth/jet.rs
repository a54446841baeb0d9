//! A signal's value with its first two time derivatives, carried through arithmetic.

use std::ops::{Add, Mul, Sub};

/// Value, first and second derivative with respect to time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// Its first derivative, per second.
    pub rate: f64,
    /// Its second derivative, per second squared.
    pub bend: f64,
}

impl Jet {
    /// A constant.
    pub const fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, bend: 0.0 }
    }

    /// Time itself.
    pub const fn time(time_s: f64) -> Self {
        Self { value: time_s, rate: 1.0, bend: 0.0 }
    }

    /// A function with its first two derivatives at this value, applied.
    pub fn through(self, value: f64, first: f64, second: f64) -> Self {
        Self { value, rate: first * self.rate, bend: first * self.bend + second * self.rate * self.rate }
    }

    /// Sine.
    pub fn sin(self) -> Self {
        let (sin, cos) = self.value.sin_cos();
        self.through(sin, cos, -sin)
    }

    /// Exponential function.
    pub fn exp(self) -> Self {
        let e = self.value.exp();
        self.through(e, e, e)
    }

    /// Times a number.
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, rate: factor * self.rate, bend: factor * self.bend }
    }

    /// The minimum-jerk step from 0 to 1 while the value goes from 0 to 1: value, slope and curvature
    /// are continuous at both ends.
    pub fn smooth_step(self) -> Self {
        let s = self.value.clamp(0.0, 1.0);
        let inside = (0.0..=1.0).contains(&self.value);
        let value = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        if !inside {
            return Self::constant(value);
        }
        let first = 30.0 * s * s * (1.0 - s) * (1.0 - s);
        let second = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
        self.through(value, first, second)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, rate: self.rate + other.rate, bend: self.bend + other.bend }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other.scaled(-1.0)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            bend: self.bend * other.value + 2.0 * self.rate * other.rate + self.value * other.bend,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        let signal = |t: f64| {
            let t = Jet::time(t);
            t.scaled(0.3).smooth_step() * (t * t + t.scaled(2.0)).sin() - t.scaled(-0.1).exp()
        };
        for t in [0.3, 1.1, 2.9, 3.6] {
            let h = 1e-4;
            let (before, at, after) = (signal(t - h), signal(t), signal(t + h));
            assert!((at.rate - (after.value - before.value) / (2.0 * h)).abs() < 1e-5, "t = {t}");
            assert!((at.bend - (after.rate - before.rate) / (2.0 * h)).abs() < 1e-4, "t = {t}");
        }
    }
}
