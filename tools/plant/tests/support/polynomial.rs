//! Polynomials, differentiated and integrated without error: shapes on which an equation can be tried.

/// Coefficients by rising power.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial(pub Vec<f64>);

impl Polynomial {
    pub fn at(&self, x: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
    }

    /// Derivative of the given order.
    pub fn derivative(&self, order: usize) -> Self {
        let mut result = self.clone();
        for _ in 0..order {
            let powers = result.0.iter().enumerate().skip(1);
            result = Self(powers.map(|(power, coefficient)| power as f64 * coefficient).collect());
        }
        result
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut product = vec![0.0; (self.0.len() + other.0.len()).saturating_sub(1)];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in other.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self(product)
    }

    /// Integral from 0 to `end`.
    pub fn integral(&self, end: f64) -> f64 {
        let powers = (1..).zip(&self.0);
        powers.map(|(power, coefficient)| coefficient * end.powi(power) / f64::from(power)).sum()
    }
}
