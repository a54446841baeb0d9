//! The unit in which an output counts in a fit: its noise, or its noise with the colour taken out.
//!
//! Where a force from outside shakes the machine all the time, what is left rings with the machine, and
//! squares of it count the same ringing again and again: a fit pulls at the resonance, and all a law does
//! elsewhere hardly weighs. Innovations, what of the rest its own past does not foretell, count everything by
//! what is known there (generalised least squares, A. Aitken, Proc. R. Soc. Edinburgh 55 (1935) 42). The
//! weighting is a triangular matrix with an inverse: nothing is lost by it, and a residual can be had back in
//! its unit.

use std::sync::Arc;

use stillbeam_identify::tall::dot;

/// How an output's samples are weighted.
#[derive(Debug, Clone)]
pub(crate) enum Weighting {
    /// Every sample times this, per unit of the output.
    Even(f64),
    /// By what its past does not foretell; and every sample's weight where it is asked for evenly.
    Innovations(Arc<Colour>, f64),
}

impl Weighting {
    /// A series in the unit of its noise.
    pub(crate) fn applied(&self, series: &[f64]) -> Vec<f64> {
        match self {
            Self::Even(weight) => series.iter().map(|value| weight * value).collect(),
            Self::Innovations(colour, _) => colour.innovations(series),
        }
    }

    /// The series that was weighted, in the output's unit.
    pub(crate) fn undone(&self, weighted: &[f64]) -> Vec<f64> {
        match self {
            Self::Even(weight) => weighted.iter().map(|value| value / weight).collect(),
            Self::Innovations(colour, _) => colour.series(weighted),
        }
    }

    /// The sum of squares of a weighted series had its samples been weighted evenly.
    pub(crate) fn even_square(&self, weighted: &[f64]) -> f64 {
        match self {
            Self::Even(_) => dot(weighted, weighted),
            Self::Innovations(colour, weight) => {
                let series = colour.series(weighted);
                weight * weight * dot(&series, &series)
            }
        }
    }
}

/// The colour of what is left of an output.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Colour {
    /// By the number of samples that came before; the last one where all it looks back at are there.
    predictors: Vec<Predictor>,
}

/// What a sample is likely to be after some others.
#[derive(Debug, Clone, PartialEq)]
struct Predictor {
    /// One per sample back.
    coefficients: Vec<f64>,
    /// Standard deviation of what it leaves.
    deviation: f64,
}

/// The most samples that a predictor looks back at.
const MOST_LAGS: usize = 24;
/// A colour is not asked of fewer samples than this many times as many.
const FEW: usize = 4;

impl Colour {
    /// The colour of some series of one output, in its unit, by the recursion of J. Burg (Maximum entropy
    /// spectral analysis, Stanford University 1975), which does not blur a sharp resonance as autocovariances
    /// of a short series do; the number of lags minimises the information criterion of Schwarz. `None` where
    /// nothing is left of the series, or they are too short.
    pub(crate) fn of(series: &[&[f64]]) -> Option<Self> {
        let samples: usize = series.iter().map(|series| series.len()).sum();
        let square: f64 = series.iter().map(|series| dot(series, series)).sum();
        if samples < FEW * MOST_LAGS || !(square.is_finite() && square > 0.0) {
            return None;
        }
        let count = samples as f64;
        let mut variance = square / count;
        let mut predictors = vec![Predictor { coefficients: Vec::new(), deviation: variance.sqrt() }];
        let mut best = (count * variance.ln(), 1);
        let mut errors: Vec<Errors> = series.iter().map(|series| Errors::new(series)).collect();
        for order in 1..=MOST_LAGS {
            let (both, squares) = errors
                .iter()
                .map(Errors::products)
                .fold((0.0, 0.0), |sum, (both, squares)| (sum.0 + both, sum.1 + squares));
            let reflection = 2.0 * both / squares;
            variance *= 1.0 - reflection * reflection;
            if !(variance.is_finite() && variance > 0.0) {
                break;
            }
            errors.iter_mut().for_each(|errors| errors.reflect(reflection));
            let shorter = &predictors[order - 1].coefficients;
            let mirrored = shorter.iter().zip(shorter.iter().rev());
            let coefficients =
                mirrored.map(|(a, b)| a - reflection * b).chain(std::iter::once(reflection)).collect();
            predictors.push(Predictor { coefficients, deviation: variance.sqrt() });
            let score = count * variance.ln() + order as f64 * count.ln();
            if score < best.0 {
                best = (score, order + 1);
            }
        }
        predictors.truncate(best.1);
        Some(Self { predictors })
    }

    /// Power of the series over that of its innovations: 1 where it is white.
    pub(crate) fn contrast(&self) -> f64 {
        let power = |predictor: Option<&Predictor>| predictor.map_or(1.0, |p| p.deviation * p.deviation);
        power(self.predictors.first()) / power(self.predictors.last())
    }

    fn innovations(&self, series: &[f64]) -> Vec<f64> {
        (0..series.len())
            .map(|t| {
                let predictor = self.predictor(t);
                (series[t] - predictor.foretold(&series[..t])) / predictor.deviation
            })
            .collect()
    }

    fn series(&self, innovations: &[f64]) -> Vec<f64> {
        let mut series = Vec::with_capacity(innovations.len());
        for (t, innovation) in innovations.iter().enumerate() {
            let predictor = self.predictor(t);
            series.push(innovation * predictor.deviation + predictor.foretold(&series));
        }
        series
    }

    fn predictor(&self, before: usize) -> &Predictor {
        &self.predictors[before.min(self.predictors.len() - 1)]
    }
}

/// What is left of a series when every sample is foretold from those before it, and from those after it.
struct Errors {
    forward: Vec<f64>,
    backward: Vec<f64>,
}

impl Errors {
    fn new(series: &[f64]) -> Self {
        // Each as far as there are samples on the other side.
        let (forward, backward) =
            (series.get(1..).unwrap_or_default(), &series[..series.len().saturating_sub(1)]);
        Self { forward: forward.to_vec(), backward: backward.to_vec() }
    }

    /// Sum of the products of both, and sum of their squares.
    fn products(&self) -> (f64, f64) {
        let squares = dot(&self.forward, &self.forward) + dot(&self.backward, &self.backward);
        (dot(&self.forward, &self.backward), squares)
    }

    /// The errors of predictors that look at one sample more.
    fn reflect(&mut self, reflection: f64) {
        for (forward, backward) in self.forward.iter_mut().zip(&mut self.backward) {
            (*forward, *backward) = (*forward - reflection * *backward, *backward - reflection * *forward);
        }
        if !self.forward.is_empty() {
            self.forward.remove(0);
            self.backward.pop();
        }
    }
}

impl Predictor {
    fn foretold(&self, before: &[f64]) -> f64 {
        self.coefficients.iter().zip(before.iter().rev()).map(|(a, past)| a * past).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    /// A resonance that is shaken at random.
    fn ringing(seed: u64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (mut last, mut before) = (0.0, 0.0);
        let mut next = || {
            let push: f64 = StandardNormal.sample(&mut random);
            let now = 1.97 * last - 0.98 * before + push;
            (before, last) = (last, now);
            now
        };
        for _ in 0..1000 {
            next();
        }
        (0..4000).map(|_| 1e-3 * next()).collect()
    }

    #[test]
    fn innovations_are_white_of_unit_size_from_the_first_sample_on() {
        let (a, b) = (ringing(1), ringing(2));
        let colour = Colour::of(&[&a, &b]).expect("they ring");
        let mean_square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        let white = colour.innovations(&a);
        assert!((mean_square(&white) - 1.0).abs() < 0.1, "{}", mean_square(&white));
        assert!(colour.contrast() > 100.0, "{}", colour.contrast());
        let none = Colour::of(&[&white]).expect("noise").contrast();
        assert!(none < 1.1, "{none}");
        let neighbours: f64 = white.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / 4000.0;
        assert!(neighbours.abs() < 0.05, "{neighbours}");
        let firsts: Vec<f64> =
            (0..400).flat_map(|seed| colour.innovations(&ringing(seed + 10)[..4])).collect();
        assert!((mean_square(&firsts) - 1.0).abs() < 0.2, "{}", mean_square(&firsts));
    }

    #[test]
    fn a_series_is_had_back_from_its_innovations() {
        let series = ringing(3);
        let weighting = Weighting::Innovations(Arc::new(Colour::of(&[&series]).expect("it rings")), 2.0);
        let back = weighting.undone(&weighting.applied(&series));
        let worst = back.iter().zip(&series).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-12, "{worst}");
        let evenly = weighting.even_square(&weighting.applied(&series));
        assert!((evenly / (4.0 * dot(&series, &series)) - 1.0).abs() < 1e-9, "{evenly}");
        assert_eq!(Weighting::Even(4.0).undone(&Weighting::Even(4.0).applied(&series)), series);
    }

    #[test]
    fn silence_has_no_colour() {
        assert_eq!(Colour::of(&[&[0.0; 500]]), None);
    }
}
