//! Eqs. 10 and 11 of the paper, as printed and as they must read: the shapes of a *uniform* beam on a free
//! base.

/// `phi_i(x)` of eq. 10 for any `lambda`, a root of the frequency equation or not.
///
/// `a (cos z − 1) + b (cosh z − 1) + c (sin z − sinh z)` with `z = lambda x`, which is eq. 10 with its terms
/// collected.
#[derive(Debug, Clone, Copy)]
pub struct PaperShape {
    pub lambda_per_m: f64,
    a: f64,
    b: f64,
    c: f64,
}

impl PaperShape {
    pub fn new(lambda_l: f64, length_m: f64) -> Self {
        let (sin, cos, sinh, cosh) = (lambda_l.sin(), lambda_l.cos(), lambda_l.sinh(), lambda_l.cosh());
        let p = (1.0 + cos * cosh) / (sin * sinh);
        let q = (cos * sinh + sin * cosh) / (sin * sinh);
        Self { lambda_per_m: lambda_l / length_m, a: 1.0 - p, b: -1.0 - p, c: -q }
    }

    /// Derivative `order` (0 to 4) of `phi` at `x_m`, in 1/m^order.
    pub fn derivative(&self, order: usize, x_m: f64) -> f64 {
        let z = self.lambda_per_m * x_m;
        let Self { a, b, c, .. } = *self;
        let value = match order {
            0 => a * (z.cos() - 1.0) + b * (z.cosh() - 1.0) + c * (z.sin() - z.sinh()),
            1 => -a * z.sin() + b * z.sinh() + c * (z.cos() - z.cosh()),
            2 => -a * z.cos() + b * z.cosh() - c * (z.sin() + z.sinh()),
            3 => a * z.sin() + b * z.sinh() - c * (z.cos() + z.cosh()),
            4 => a * z.cos() + b * z.cosh() + c * (z.sin() - z.sinh()),
            _ => unreachable!("a beam equation has four derivatives"),
        };
        value * self.lambda_per_m.powi(order as i32)
    }

    /// How far the base moves in this mode, in the unit of `phi`: the absolute shape is `base + phi(x)`.
    pub fn base(&self) -> f64 {
        self.a + self.b
    }
}

/// Eq. 10 letter by letter.
pub fn printed_shape(lambda_l: f64, length_m: f64, x_m: f64) -> f64 {
    let (sin, cos, sinh, cosh) = (lambda_l.sin(), lambda_l.cos(), lambda_l.sinh(), lambda_l.cosh());
    let z = lambda_l / length_m * x_m;
    (1.0 + cos * cosh) / (sin * sinh) * (2.0 - z.cos() - z.cosh())
        - (cos * sinh + sin * cosh) / (sin * sinh) * (z.sin() - z.sinh())
        + (z.cos() - z.cosh())
}

/// Left side of eq. 11 as it must read; `mass_ratio` is beam over base.
pub fn corrected_eq_11(lambda_l: f64, mass_ratio: f64) -> f64 {
    let (sin, cos, sinh, cosh) = (lambda_l.sin(), lambda_l.cos(), lambda_l.sinh(), lambda_l.cosh());
    1.0 + cosh * cos + mass_ratio / lambda_l * (sin * cosh + cos * sinh)
}

/// Left side of eq. 11 as printed; `length` in whatever unit, which is the trouble.
pub fn printed_eq_11(lambda_l: f64, mass_ratio: f64, length: f64) -> f64 {
    let (sin, cos, cosh) = (lambda_l.sin(), lambda_l.cos(), lambda_l.cosh());
    1.0 + cosh * cos + mass_ratio / (lambda_l / length) * (sin * cosh + cos * sin)
}

/// The first `count` roots above 0.5 of a frequency equation, each by bisection.
pub fn roots(count: usize, equation: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut found = Vec::with_capacity(count);
    let step = 1e-3;
    let mut low = 0.5;
    while found.len() < count {
        let high = low + step;
        if equation(low).signum() != equation(high).signum() {
            let (mut from, mut to) = (low, high);
            for _ in 0..60 {
                let middle = 0.5 * (from + to);
                if equation(from).signum() == equation(middle).signum() { from = middle } else { to = middle }
            }
            found.push(0.5 * (from + to));
        }
        low = high;
        assert!(low < 100.0, "{found:?}");
    }
    found
}

/// `∫_0^l f dx` by the five-point Gauss rule on `panels` panels.
pub fn integral(length_m: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = length_m / panels as f64;
    let rule = super::finite_elements::RULE;
    (0..panels)
        .flat_map(|panel| rule.iter().map(move |(s, weight)| (h * (panel as f64 + s), weight * h)))
        .map(|(x, weight)| weight * f(x))
        .sum()
}
