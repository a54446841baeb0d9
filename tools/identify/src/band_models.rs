//! What else than one decaying oscillation a narrow band may hold: two of them, or one that bends.
//!
//! The amplitude z(t) of a band is complex. A linear mode is c exp(λ t); two close modes are the sum of two
//! of these and beat; a mode whose frequency and damping go with its amplitude is c exp(a smooth curve) and
//! does not: a curve of time, its square, and the first two powers of the decaying amplitude. The bent mode
//! has a few free numbers more than the pair, so that a pair which leaves far less is one.

use nalgebra::{DMatrix, SymmetricEigen};
use rustfft::num_complex::Complex64;

use crate::column::Column;
use crate::levenberg_marquardt::Parameter;
use crate::separable::{Separable, fit};

/// Terms of a mode that bends.
const TERMS: usize = 4;
/// Rows of the matrix that a pair is read off, at most.
const ROWS: usize = 64;
/// An amplitude less than this many times the floor is near it.
const NEAR_FLOOR: f64 = 3.0;
/// Fewest values of a band that a pair can be told from.
const FEWEST: usize = 12;

/// Amplitudes at even times.
#[derive(Clone, Copy)]
pub(crate) struct Values<'v> {
    pub(crate) time_s: &'v [f64],
    pub(crate) amplitude: &'v [Complex64],
}

/// Two decaying oscillations.
#[derive(Debug, Clone)]
pub(crate) struct Pair {
    /// Rates, 1/s (the real part is minus the decay), about the band's centre.
    pub(crate) rates: [Complex64; 2],
    /// Sizes at the first of the times.
    pub(crate) sizes: [f64; 2],
    pub(crate) sum_of_squares: f64,
}

impl Values<'_> {
    /// Sum of squares.
    pub(crate) fn energy(&self) -> f64 {
        self.amplitude.iter().map(Complex64::norm_sqr).sum()
    }

    /// What one decaying oscillation leaves, and what one leaves whose rate bends over time.
    pub(crate) fn straight_and_bent(&self, rate: Complex64) -> Option<[f64; 2]> {
        let length_s = self.time_s.last()? - self.time_s.first()?;
        let course = |terms| Bent { values: *self, length_s, decay_per_s: (-rate.re).max(0.0), terms };
        let (straight, found) = self.bent(&course(1), &[rate * length_s])?;
        let bent = course(TERMS);
        let mut start = found;
        start.resize(TERMS, Complex64::new(0.0, 0.0));
        // From the straight one, and from what the amplitude's logarithm says: phases that bend by turns have
        // many minima.
        let starts = [Some(start), self.above_noise().read_off(&bent)];
        let least =
            starts.into_iter().flatten().filter_map(|start| self.bent(&bent, &start)).map(|one| one.0);
        Some([straight, least.fold(straight, f64::min)])
    }

    /// Fits c exp(the terms); the sum of squares and the factors of the terms.
    fn bent(&self, course: &Bent<'_>, start: &[Complex64]) -> Option<(f64, Vec<Complex64>)> {
        let turns = std::f64::consts::PI * self.time_s.len() as f64;
        let reach = |from: f64, most: f64| Parameter {
            start: from,
            lower: from - most,
            upper: from + most,
            max_step: 0.1 * most,
        };
        let parameters: Vec<Parameter> =
            start.iter().flat_map(|c| [reach(c.re, 60.0), reach(c.im, turns)]).collect();
        let found = fit(course, &parameters)?;
        let factors = found.parameters.chunks(2).map(|pair| Complex64::new(pair[0], pair[1])).collect();
        Some((found.sum_of_squares, factors))
    }

    /// The values before the amplitude first comes near the floor that the last tenth holds: beyond it phases
    /// turn at random. All of them where few would be left.
    fn above_noise(&self) -> Values<'_> {
        let size: Vec<f64> = self.amplitude.iter().map(|z| z.norm()).collect();
        let mut last = size[size.len() - size.len().div_ceil(10)..].to_vec();
        last.sort_by(f64::total_cmp);
        let floor = last[last.len() / 2];
        let loudest = (0..size.len()).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        let end = (loudest..size.len()).find(|k| size[*k] < NEAR_FLOOR * floor).unwrap_or(size.len());
        let end = if end < FEWEST { size.len() } else { end };
        Values { time_s: &self.time_s[..end], amplitude: &self.amplitude[..end] }
    }

    /// The factors of the terms by least squares on the logarithm, every value weighted by its power.
    fn read_off(&self, course: &Bent<'_>) -> Option<Vec<Complex64>> {
        let mut turned = 0.0;
        let mut before: Option<f64> = None;
        let logs: Vec<Complex64> = self
            .amplitude
            .iter()
            .map(|z| {
                if let Some(last) = before {
                    turned -= std::f64::consts::TAU * ((z.arg() - last) / std::f64::consts::TAU).round();
                }
                before = Some(z.arg());
                Complex64::new(z.norm().max(f64::MIN_POSITIVE).ln(), z.arg() + turned)
            })
            .collect();
        let columns = course.terms + 1;
        let row = |k: usize, column: usize| {
            let weight = self.amplitude[k].norm();
            weight * if column == 0 { 1.0 } else { course.term(column - 1, self.time_s[k]) }
        };
        let rows = DMatrix::from_fn(logs.len(), columns, row);
        let side = |part: fn(&Complex64) -> f64| {
            let right =
                nalgebra::DVector::from_fn(logs.len(), |k, _| self.amplitude[k].norm() * part(&logs[k]));
            (rows.transpose() * &rows).lu().solve(&(rows.transpose() * right))
        };
        let (real, turn) = (side(|z| z.re)?, side(|z| z.im)?);
        let factors: Vec<Complex64> = (1..columns).map(|k| Complex64::new(real[k], turn[k])).collect();
        factors.iter().all(|c| c.re.is_finite() && c.im.is_finite()).then_some(factors)
    }

    /// The two oscillations that explain most, from the invariance of the amplitude's Hankel matrix under a
    /// shift.
    pub(crate) fn pair(&self) -> Option<Pair> {
        let count = self.amplitude.len();
        if count < FEWEST {
            return None;
        }
        let step_s = self.time_s[1] - self.time_s[0];
        let rows = (count / 2).min(ROWS);
        let columns = count - rows + 1;
        let square = DMatrix::from_fn(rows, rows, |i, j| {
            (0..columns).map(|k| self.amplitude[i + k] * self.amplitude[j + k].conj()).sum::<Complex64>()
        });
        let eigen = SymmetricEigen::try_new(square, 1e-14, 1000)?;
        let mut order: Vec<usize> = (0..rows).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let signal = eigen.eigenvectors.select_columns(&order[..2]);
        let upper = signal.rows(0, rows - 1).into_owned();
        let lower = signal.rows(1, rows - 1).into_owned();
        let shift = (upper.adjoint() * &upper).lu().solve(&(upper.adjoint() * lower))?;
        let (trace, det) =
            (shift[(0, 0)] + shift[(1, 1)], shift[(0, 0)] * shift[(1, 1)] - shift[(0, 1)] * shift[(1, 0)]);
        let root = (trace * trace / 4.0 - det).sqrt();
        let rates = [trace / 2.0 + root, trace / 2.0 - root].map(|z| z.ln() / step_s);
        if rates.iter().any(|rate| !(rate.re.is_finite() && rate.im.is_finite())) {
            return None;
        }
        self.refined(rates, step_s)
    }

    fn refined(&self, rates: [Complex64; 2], step_s: f64) -> Option<Pair> {
        let nyquist = std::f64::consts::PI / step_s;
        let parameter = |start: f64, lower: f64, upper: f64| Parameter {
            start: start.clamp(lower, upper),
            lower,
            upper,
            max_step: 0.1 * nyquist,
        };
        let parameters: Vec<Parameter> = rates
            .iter()
            .flat_map(|rate| {
                [parameter(rate.re, -nyquist, 0.2 * nyquist), parameter(rate.im, -nyquist, nyquist)]
            })
            .collect();
        let found = fit(&Sum { values: *self }, &parameters)?;
        let p = &found.parameters;
        let c = &found.point.coefficients;
        Some(Pair {
            rates: [Complex64::new(p[0], p[1]), Complex64::new(p[2], p[3])],
            sizes: [c[0].hypot(c[1]), c[2].hypot(c[3])],
            sum_of_squares: found.sum_of_squares,
        })
    }
}

/// Evidence (twice the logarithm of the ratio of likelihoods) from which a band holds two modes and not one
/// that bends.
const TWO: f64 = 20.0;
/// Share of the larger one's energy that the smaller one has at least.
const SMALLEST: f64 = 0.005;
/// How far apart the two are, in their mean decay rate: closer ones are one mode with another course of its
/// damping.
const APART: f64 = 0.5;
/// Steps of the band over which either decays at least, or it is the beginning of the record and no mode.
const LASTS: f64 = 3.0;

impl Pair {
    /// Whether both decay, last, and are apart and large enough to be two modes of a record.
    fn is_possible(&self, values: &Values<'_>) -> bool {
        let step_s = values.time_s[1] - values.time_s[0];
        let length_s = step_s * values.time_s.len() as f64;
        let [a, b] = self.rates;
        let lasts = self.rates.iter().all(|rate| rate.re < 0.0 && -rate.re * step_s * LASTS < 1.0);
        let apart = (a.im - b.im).abs() > -0.5 * APART * (a.re + b.re);
        let energies: Vec<f64> = self
            .rates
            .iter()
            .zip(self.sizes)
            .map(|(rate, size)| size * size / (2.0 / length_s - rate.re))
            .collect();
        lasts && apart && energies[0].min(energies[1]) > SMALLEST * energies[0].max(energies[1])
    }
}

impl Values<'_> {
    /// The pair, where it explains the band far better than one mode does, straight or bent.
    pub(crate) fn clear_pair(&self) -> Option<Pair> {
        let pair = self.pair().filter(|pair| pair.is_possible(self))?;
        let stronger = usize::from(pair.sizes[1] > pair.sizes[0]);
        let [_, bent] = self.straight_and_bent(pair.rates[stronger])?;
        let count = 2.0 * self.amplitude.len() as f64;
        let evidence = count * (bent / pair.sum_of_squares.max(f64::MIN_POSITIVE)).ln();
        (evidence > TWO).then_some(pair)
    }

    /// The pair, where both decay and are apart, however much better it is: for a number of modes that was
    /// asked for.
    pub(crate) fn possible_pair(&self) -> Option<Pair> {
        self.pair().filter(|pair| pair.is_possible(self))
    }

    /// How much better one oscillation explains the band if it may bend.
    pub(crate) fn bending(&self, rate: Complex64) -> Option<Bending> {
        if self.amplitude.len() < FEWEST {
            return None;
        }
        let [straight, bent] = self.straight_and_bent(rate)?;
        let evidence = 2.0 * self.amplitude.len() as f64 * (straight / bent.max(f64::MIN_POSITIVE)).ln();
        Some(Bending { evidence, gain: straight - bent })
    }
}

/// A course that bends, beside a straight one.
pub(crate) struct Bending {
    /// Twice the logarithm of the ratio of their likelihoods.
    pub(crate) evidence: f64,
    /// Difference of the sums of squares that they leave.
    pub(crate) gain: f64,
}

fn interleaved(values: impl Iterator<Item = Complex64> + Clone) -> Vec<Column> {
    let real: Vec<f64> = values.clone().flat_map(|z| [z.re, z.im]).collect();
    let turned: Vec<f64> = values.flat_map(|z| [-z.im, z.re]).collect();
    vec![real.into(), turned.into()]
}

/// c exp(sum of factors times terms), the linear number c solved for. Parameters: real and imaginary part of
/// every factor.
struct Bent<'v> {
    values: Values<'v>,
    length_s: f64,
    decay_per_s: f64,
    terms: usize,
}

impl Bent<'_> {
    /// Time, its square, and the first and second power of a decaying amplitude.
    fn term(&self, index: usize, time_s: f64) -> f64 {
        let t = time_s - self.values.time_s[0];
        let x = t / self.length_s;
        match index {
            0 => x,
            1 => x * x,
            power => (-(power as f64 - 1.0) * self.decay_per_s * t).exp() - 1.0,
        }
    }
}

impl Separable for Bent<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.values.amplitude.iter().flat_map(|z| [z.re, z.im]).collect()
    }

    fn blocks(&self) -> usize {
        1
    }

    fn block(&self, _: usize, parameters: &[f64]) -> Vec<Column> {
        let value = |t: &f64| {
            let factors = parameters.chunks(2).map(|c| Complex64::new(c[0], c[1]));
            factors.enumerate().map(|(index, c)| c * self.term(index, *t)).sum::<Complex64>().exp()
        };
        interleaved(self.values.time_s.iter().map(value))
    }

    fn depends(&self, _: usize, _: usize) -> bool {
        true
    }
}

/// The sum of two oscillations. Parameters: real and imaginary part of either rate.
struct Sum<'v> {
    values: Values<'v>,
}

impl Separable for Sum<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.values.amplitude.iter().flat_map(|z| [z.re, z.im]).collect()
    }

    fn blocks(&self) -> usize {
        2
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        let origin = self.values.time_s[0];
        let rate = Complex64::new(parameters[2 * block], parameters[2 * block + 1]);
        interleaved(self.values.time_s.iter().map(|t| (rate * (t - origin)).exp()))
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        parameter / 2 == block
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_told_from_a_mode_that_bends_and_the_other_way_round() {
        let time_s: Vec<f64> = (0..60).map(|k| 0.1 * f64::from(k)).collect();
        let (a, b) = (Complex64::new(-0.5, 1.0), Complex64::new(-0.7, 2.5));
        let beating: Vec<Complex64> = time_s.iter().map(|t| (a * t).exp() + (b * t).exp() * 0.6).collect();
        let values = Values { time_s: &time_s, amplitude: &beating };
        let pair = values.pair().unwrap();
        let [_, bent] = values.straight_and_bent(a).unwrap();
        assert!(pair.sum_of_squares < 1e-9 * values.energy() && bent > 1e-3 * values.energy());
        let mut rates = pair.rates;
        rates.sort_by(|a, b| a.im.total_cmp(&b.im));
        assert!((rates[0] - a).norm() < 1e-5 && (rates[1] - b).norm() < 1e-5, "{rates:?}");

        let bending: Vec<Complex64> = time_s
            .iter()
            .map(|t| (Complex64::new(-0.5, 1.0) * t + Complex64::new(0.01, 0.2) * t * t).exp())
            .collect();
        let values = Values { time_s: &time_s, amplitude: &bending };
        let [straight, bent] = values.straight_and_bent(a).unwrap();
        let pair = values.pair().unwrap();
        assert!(bent < 1e-6 * values.energy() && straight > 1e-2 * values.energy(), "{straight} {bent}");
        assert!(pair.sum_of_squares > 10.0 * bent);
    }
}
