//! One step of z' = lambda z + u for a cubic u, exactly.

use rustfft::num_complex::Complex64;

/// What one step of length h does: z becomes exp(lambda h) z plus the integrals of the input's powers.
#[derive(Clone, Copy)]
pub(crate) struct Step {
    length_s: f64,
    pub(crate) decay: Complex64,
    /// Integral over 0..h of exp(lambda (h - t)) t^j, for j = 0..=4.
    moments: [Complex64; 5],
}

impl Step {
    fn new(lambda: Complex64, h: f64) -> Self {
        let x = lambda * h;
        let decay = x.exp();
        let mut moments = [Complex64::default(); 5];
        let powers = [1.0, h, h * h, h.powi(3), h.powi(4)];
        if x.norm() < 1.0 {
            // j = 4 by its series h^5 * sum of x^m 4!/(m+5)!, the others downwards: both are free of
            // cancellation.
            let mut term = Complex64::new(0.2, 0.0);
            let mut sum = term;
            for m in 1..20 {
                term *= x / f64::from(m + 5);
                sum += term;
            }
            moments[4] = sum * powers[4] * h;
            for j in (1..5).rev() {
                moments[j - 1] = (lambda * moments[j] + powers[j]) / j as f64;
            }
        } else {
            moments[0] = (decay - 1.0) / lambda;
            for j in 1..5 {
                moments[j] = (moments[j - 1] * j as f64 - powers[j]) / lambda;
            }
        }
        Self { length_s: h, decay, moments }
    }

    pub(crate) fn advance(&self, state: Complex64, c: &[f64; 4]) -> Complex64 {
        let [m0, m1, m2, m3, _] = self.moments;
        self.decay * state + m0 * c[0] + m1 * c[1] + m2 * c[2] + m3 * c[3]
    }

    /// The derivative of [`Self::advance`] with respect to lambda, that of the state given: the integral of
    /// (h - t) exp(lambda (h - t)) t^j is h times moment j less moment j + 1.
    pub(crate) fn advance_slope(&self, state: Complex64, slope: Complex64, c: &[f64; 4]) -> Complex64 {
        let h = self.length_s;
        let mut next = self.decay * (slope + state * h);
        for (pair, c) in self.moments.windows(2).zip(c) {
            next += (pair[0] * h - pair[1]) * *c;
        }
        next
    }
}

/// The few step lengths that occur again and again in a record, even when its stamps were rounded.
pub(crate) struct StepCache {
    lambda: Complex64,
    steps: Vec<Step>,
    /// The one that the next new length takes the place of.
    oldest: usize,
}

/// How many lengths are remembered.
const REMEMBERED: usize = 4;

/// Steps that differ by less than this share are the same: the stamps' own rounding is of that size.
const SAME_STEP: f64 = 1e-9;

impl StepCache {
    pub(crate) fn new(lambda: Complex64) -> Self {
        Self { lambda, steps: Vec::with_capacity(REMEMBERED), oldest: 0 }
    }

    pub(crate) fn get(&mut self, h: f64) -> &Step {
        let same = |step: &Step| (step.length_s - h).abs() <= SAME_STEP * h.abs();
        let place = match self.steps.iter().position(same) {
            Some(place) => place,
            None => self.remember(Step::new(self.lambda, h)),
        };
        &self.steps[place]
    }

    #[cold]
    fn remember(&mut self, step: Step) -> usize {
        if self.steps.len() < REMEMBERED {
            self.steps.push(step);
            return self.steps.len() - 1;
        }
        let place = self.oldest;
        self.steps[place] = step;
        self.oldest = (place + 1) % REMEMBERED;
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_moments_join_where_the_series_hands_over() {
        for angle in [1.6, 2.0, 2.5, 3.0] {
            let lambda = Complex64::from_polar(7.0, angle);
            let (inside, outside) =
                (Step::new(lambda, (1.0 - 1e-12) / 7.0), Step::new(lambda, (1.0 + 1e-12) / 7.0));
            for (a, b) in inside.moments.iter().zip(outside.moments) {
                assert!((a - b).norm() < 1e-11 * b.norm());
            }
        }
    }
}
