//! Seeded draws: the same seed gives the same cases on every machine.

use std::f64::consts::TAU;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of draws.
#[derive(Debug, Clone)]
pub struct Random {
    generator: Xoshiro256PlusPlus,
}

impl Random {
    /// The stream number `stream` of a seed; streams do not overlap in practice.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03);
        Self { generator: Xoshiro256PlusPlus::seed_from_u64(mixed) }
    }

    /// Uniform on `0..1`.
    pub fn unit(&mut self) -> f64 {
        // 53 bits, as many as a double holds.
        (self.generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in the logarithm between two positive numbers.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    /// `-1` or `1`.
    pub fn sign(&mut self) -> f64 {
        if self.unit() < 0.5 { -1.0 } else { 1.0 }
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of a list; `None` if the list is empty.
    pub fn pick<'a, T>(&mut self, list: &'a [T]) -> Option<&'a T> {
        list.get((self.unit() * list.len() as f64) as usize)
    }

    /// Normal with mean 0 and variance 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }

    /// Bytes, for the salt of a seal.
    pub fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        self.generator.fill_bytes(&mut bytes);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_repeat_with_the_seed_and_differ_between_streams() {
        let list = |seed, stream| {
            let mut random = Random::new(seed, stream);
            (0..8).map(|_| random.unit()).collect::<Vec<_>>()
        };
        assert_eq!(list(7, 1), list(7, 1));
        assert_ne!(list(7, 1), list(7, 2));
        assert_ne!(list(7, 1), list(8, 1));
    }

    #[test]
    fn moments_are_those_of_the_named_distributions() {
        let mut random = Random::new(1, 1);
        let count = 40_000;
        let normals: Vec<f64> = (0..count).map(|_| random.normal()).collect();
        let mean = normals.iter().sum::<f64>() / f64::from(count);
        let variance = normals.iter().map(|x| x * x).sum::<f64>() / f64::from(count);
        // Five standard errors.
        assert!(mean.abs() < 5.0 / f64::from(count).sqrt(), "{mean}");
        assert!((variance - 1.0).abs() < 5.0 * (2.0 / f64::from(count)).sqrt(), "{variance}");
        let mean = (0..count).map(|_| random.between(2.0, 4.0)).sum::<f64>() / f64::from(count);
        assert!((mean - 3.0).abs() < 5.0 * 0.58 / f64::from(count).sqrt(), "{mean}");
    }
}
