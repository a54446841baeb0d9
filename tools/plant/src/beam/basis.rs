//! Clamped-free eigenfunctions of the uniform beam: the basis of eq. 9.

use std::f64::consts::PI;

/// The `i`-th clamped-free eigenfunction of a uniform beam,
/// `phi(x) = cosh z − cos z − sigma (sinh z − sin z)` with `z = beta x`, scaled to `∫ phi² dx = l`.
///
/// Written that way it loses all digits from the fifth function on (`cosh` and `sigma sinh` agree to more
/// and more of them), so it is evaluated as `g e^(z−b) + ½(1+sigma) e^(−z) − cos z + sigma sin z` with
/// `b = beta l`: every term is of order one. Eq. 10 of the paper is the same family for a base of finite
/// mass; these are its limit for a held base and satisfy eqs. 7 and 8 as well, so they are as good a basis,
/// and the coupling to the base comes from eq. 13 either way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BasisFunction {
    beta_per_m: f64,
    beta_l: f64,
    sigma: f64,
    growing: f64,
}

impl BasisFunction {
    /// Function number `index` (0-based) of a beam of `length_m`.
    pub fn new(index: usize, length_m: f64) -> Self {
        let beta_l = frequency_root(index);
        let decayed = (-beta_l).exp();
        // 2 e^(−b) (sinh b + sin b) and its like: hyperbolic functions without their overflow.
        let denominator = 1.0 - decayed * decayed + 2.0 * decayed * beta_l.sin();
        let sigma = (1.0 + decayed * decayed + 2.0 * decayed * beta_l.cos()) / denominator;
        let growing = (beta_l.sin() - beta_l.cos() - decayed) / denominator;
        Self { beta_per_m: beta_l / length_m, beta_l, sigma, growing }
    }

    /// `beta l`, dimensionless: the root of `cos(beta l) cosh(beta l) = −1`.
    pub fn beta_l(&self) -> f64 {
        self.beta_l
    }

    /// `phi(x)`, dimensionless, at `x_m` metres from the clamp.
    pub fn value(&self, x_m: f64) -> f64 {
        let z = self.beta_per_m * x_m;
        self.hyperbolic(z) - z.cos() + self.sigma * z.sin()
    }

    /// `phi''(x)` in 1/m² at `x_m` metres from the clamp.
    pub fn curvature_per_m2(&self, x_m: f64) -> f64 {
        let z = self.beta_per_m * x_m;
        let beta_squared = self.beta_per_m * self.beta_per_m;
        beta_squared * (self.hyperbolic(z) + z.cos() - self.sigma * z.sin())
    }

    /// `cosh z − sigma sinh z`.
    fn hyperbolic(&self, z: f64) -> f64 {
        self.growing * (z - self.beta_l).exp() + 0.5 * (1.0 + self.sigma) * (-z).exp()
    }
}

/// Root number `index` (0-based) of `cos b + sech b = 0`, by Newton's method from its asymptote.
fn frequency_root(index: usize) -> f64 {
    let mut b = (index as f64 + 0.5) * PI;
    // Converges in four steps for the first root and at once for the rest.
    for _ in 0..8 {
        let sech = 1.0 / b.cosh();
        b -= (b.cos() + sech) / (-b.sin() - sech * b.tanh());
    }
    b
}
