//! The colour of noise: an autoregressive model of a stationary series with gaps.

/// `e_t = sum over k of coefficients[k-1] * e_(t-k) + innovation`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Autoregression {
    /// One per lag, from lag 1.
    pub(crate) coefficients: Vec<f64>,
    /// Variance of the innovations.
    pub(crate) innovation_variance: f64,
    /// Variance of the series.
    pub(crate) variance: f64,
}

/// The most lags that are tried.
const MOST_LAGS: usize = 24;

impl Autoregression {
    /// Fitted to a series (NaN where a value is missing) by the recursion of Levinson and Durbin on its
    /// autocovariance; the order minimises the information criterion of Schwarz.
    ///
    /// White noise of the series' variance when it is too short.
    pub(crate) fn fit(series: &[&[f64]]) -> Self {
        let (covariance, count) = autocovariance(series, MOST_LAGS);
        let variance = covariance[0];
        let mut best = Self { coefficients: Vec::new(), innovation_variance: variance, variance };
        if variance <= 0.0 || variance.is_nan() || count < 4 * MOST_LAGS {
            return best;
        }
        let n = count as f64;
        let mut best_score = n * variance.ln();
        let mut coefficients: Vec<f64> = Vec::new();
        let mut innovation = variance;
        for order in 1..=MOST_LAGS {
            let predicted: f64 =
                coefficients.iter().enumerate().map(|(k, a)| a * covariance[order - 1 - k]).sum();
            let reflection = (covariance[order] - predicted) / innovation;
            let before = coefficients.clone();
            for (k, a) in coefficients.iter_mut().enumerate() {
                *a -= reflection * before[order - 2 - k];
            }
            coefficients.push(reflection);
            innovation *= 1.0 - reflection * reflection;
            if innovation <= 1e-12 * variance || innovation.is_nan() {
                break;
            }
            let score = n * innovation.ln() + order as f64 * n.ln();
            if score < best_score {
                best_score = score;
                best = Self { coefficients: coefficients.clone(), innovation_variance: innovation, variance };
            }
        }
        best
    }

    /// The series with its colour taken out: innovations, NaN where any sample they need is missing.
    ///
    /// The first few, which would need samples before the start, take those as zero and are scaled to no
    /// purpose: callers use records much longer than the order.
    pub(crate) fn whiten(&self, series: &[f64]) -> Vec<f64> {
        let at = |t: usize, k: usize| if t > k { series[t - k - 1] } else { 0.0 };
        (0..series.len())
            .map(|t| {
                let past: f64 = self.coefficients.iter().enumerate().map(|(k, a)| a * at(t, k)).sum();
                series[t] - past
            })
            .collect()
    }

    /// Variance of the sum of `weights[t] * e_t`: the weights run through the noise's own filter, backwards
    /// in time. Missing values count as zero weights.
    pub(crate) fn variance_of_sum(&self, weights: &[f64]) -> f64 {
        // e = A⁻¹ w, so weights · e = (A⁻ᵀ weights) · w.
        let mut filtered = vec![0.0; weights.len()];
        for t in (0..weights.len()).rev() {
            let mut value = if weights[t].is_finite() { weights[t] } else { 0.0 };
            for (k, a) in self.coefficients.iter().enumerate() {
                if let Some(later) = filtered.get(t + k + 1) {
                    value += a * later;
                }
            }
            filtered[t] = value;
        }
        self.innovation_variance * filtered.iter().map(|value| value * value).sum::<f64>()
    }

    /// The model's autocorrelation from lag 0 until nothing is left of it, for a series of `count` samples.
    pub(crate) fn autocorrelations(&self, count: usize) -> Vec<f64> {
        let lags = 2000.min(count / 2);
        let mut impulse = vec![0.0; lags + MOST_LAGS];
        impulse[0] = 1.0;
        for t in 1..impulse.len() {
            impulse[t] =
                (0..self.coefficients.len().min(t)).map(|k| self.coefficients[k] * impulse[t - k - 1]).sum();
        }
        let covariance = |lag: usize| -> f64 {
            impulse.iter().zip(impulse.get(lag..).unwrap_or_default()).map(|(a, b)| a * b).sum()
        };
        let power = covariance(0);
        let mut all = vec![1.0];
        // The autocorrelation decays geometrically; beyond ten times its memory nothing is left.
        for lag in 1..lags {
            let rho = covariance(lag) / power;
            all.push(rho);
            if lag > 50 && rho.abs() < 1e-3 {
                break;
            }
        }
        all
    }

    /// By how much the mean square of `count` samples scatters less certainly than that of white noise: the
    /// number of independent samples that would tell the variance as well, `count / (1 + 2 * sum of squared
    /// autocorrelations)` (M. Bartlett, 1946).
    pub(crate) fn effective_count(&self, count: usize) -> f64 {
        let sum: f64 = self.autocorrelations(count).iter().skip(1).map(|rho| rho * rho).sum();
        count as f64 / (1.0 + 2.0 * sum)
    }
}

/// Autocovariance at lags 0..=most over all pairs that are both there, and the number of samples. The mean is
/// taken as zero: residuals have had their offset taken out.
fn autocovariance(series: &[&[f64]], most: usize) -> (Vec<f64>, usize) {
    let present = |series: &[f64]| series.iter().filter(|value| value.is_finite()).count();
    let count: usize = series.iter().map(|series| present(series)).sum();
    let covariance = (0..=most)
        .map(|lag| {
            let sum: f64 = series
                .iter()
                .flat_map(|series| series.iter().zip(series.get(lag..).unwrap_or_default()))
                .map(|(a, b)| a * b)
                .filter(|product| product.is_finite())
                .sum();
            // Divided by the count, not by the pairs: the sequence stays positive definite.
            sum / count.max(1) as f64
        })
        .collect();
    (covariance, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    fn coloured(rho: f64, n: usize, seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut last = 0.0;
        (0..n)
            .map(|_| {
                let innovation: f64 = StandardNormal.sample(&mut random);
                last = rho * last + innovation;
                last
            })
            .collect()
    }

    #[test]
    fn colour_and_its_removal() {
        let e = coloured(0.9, 8000, 3);
        let model = Autoregression::fit(&[&e]);
        assert!((model.coefficients[0] - 0.9).abs() < 0.03, "{model:?}");
        assert!((model.innovation_variance - 1.0).abs() < 0.05, "{model:?}");
        let white = model.whiten(&e);
        let again = Autoregression::fit(&[&white]);
        assert!(again.coefficients.iter().all(|a| a.abs() < 0.06), "{again:?}");
    }

    /// Against the closed form of AR(1): 1 + 2 rho²/(1 − rho²), and scatter of weighted sums.
    #[test]
    fn weighted_sums_scatter_as_predicted() {
        let model =
            Autoregression { coefficients: vec![0.8], innovation_variance: 1.0, variance: 1.0 / 0.36 };
        let expected = 1000.0 / (1.0 + 2.0 * 0.64 / 0.36);
        assert!((model.effective_count(1000) / expected - 1.0).abs() < 0.01);
        let weights: Vec<f64> = (0..500).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let sums: Vec<f64> = (0..400)
            .map(|seed| coloured(0.8, 500, seed).iter().zip(&weights).map(|(e, w)| e * w).sum())
            .collect();
        let scatter = sums.iter().map(|sum: &f64| sum * sum).sum::<f64>() / 400.0;
        let ratio = model.variance_of_sum(&weights) / scatter;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }
}
