//! The noise as an autoregression, and the filter that makes it white.
//!
//! Least squares on filtered residuals weighs every frequency by how little noise it holds. The order is
//! chosen by Schwarz's criterion among those of the Levinson recursion; the first rows of every unbroken run
//! are filtered by the predictors of lower order, so that no row is lost.

use std::ops::Range;

use crate::column::Column;
use crate::separable::Separable;
use crate::tall::{add_scaled, dot};

/// The highest order tried.
const MAX_ORDER: usize = 12;
/// Intervals within this share of the usual one belong to an even run.
const EVEN: f64 = 0.05;
/// Rows of an even run from which it is worth filtering.
const SHORTEST_RUN: usize = 4 * MAX_ORDER;

/// Rows at even intervals without a gap, within one record whose rows begin at `first`.
pub(crate) fn even_runs(time_s: &[f64], first: usize) -> Vec<Range<usize>> {
    let mut intervals: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    let Some(middle) = intervals.len().checked_sub(1).map(|last| last / 2) else { return Vec::new() };
    let usual = *intervals.select_nth_unstable_by(middle, f64::total_cmp).1;
    let mut runs = Vec::new();
    let mut start = 0;
    for k in 1..=time_s.len() {
        let broken = time_s.get(k).is_none_or(|t| (t - time_s[k - 1] - usual).abs() > EVEN * usual);
        if broken {
            runs.push(first + start..first + k);
            start = k;
        }
    }
    runs
}

/// A whitening filter.
#[derive(Debug, Clone)]
pub(crate) struct Whitener {
    runs: Vec<Range<usize>>,
    /// Predictors of order 0, 1, .. up to the chosen one.
    predictors: Vec<Vec<f64>>,
    /// Prediction error of each relative to the last one's.
    scale: Vec<f64>,
}

impl Whitener {
    /// The noise model of residuals; `None` where they are white already or their rows are not even.
    pub(crate) fn of(residuals: &[f64], runs: Vec<Range<usize>>) -> Option<Self> {
        let long: usize = runs.iter().map(Range::len).filter(|length| *length >= SHORTEST_RUN).sum();
        if 5 * long < 4 * residuals.len() {
            return None;
        }
        let n = residuals.len() as f64;
        let correlation: Vec<f64> = (0..=MAX_ORDER)
            .map(|lag| {
                let products = runs.iter().filter(|run| run.len() > lag).map(|run| {
                    dot(&residuals[run.start + lag..run.end], &residuals[run.start..run.end - lag])
                });
                products.sum::<f64>() / n
            })
            .collect();
        let (predictors, errors) = levinson(&correlation)?;
        let criterion = |order: &usize| n * errors[*order].ln() + *order as f64 * n.ln();
        let order = (0..predictors.len()).min_by(|a, b| criterion(a).total_cmp(&criterion(b)))?;
        (order > 0).then(|| Self {
            runs,
            scale: errors[..=order].iter().map(|error| (errors[order] / error).sqrt()).collect(),
            predictors: predictors[..=order].to_vec(),
        })
    }

    /// Order of the autoregression.
    pub(crate) fn order(&self) -> usize {
        self.predictors.len() - 1
    }

    /// The filtered column.
    pub(crate) fn filter(&self, column: &Column) -> Column {
        let order = self.order();
        let height = self.runs.last().map_or(0, |run| run.end);
        let (start, end) = (column.start, (column.rows().end + order).min(height));
        let mut padded = column.values.clone();
        padded.resize(end - start, 0.0);
        let mut filtered = padded.clone();
        let coefficients = &self.predictors[order];
        let first = self.runs.partition_point(|run| run.end <= start);
        for run in self.runs[first..].iter().take_while(|run| run.start < end) {
            let (from, to) = (run.start.max(start) - start, run.end.min(end) - start);
            for (lag, coefficient) in (1..).zip(coefficients) {
                if to > from + lag {
                    add_scaled(&mut filtered[from + lag..to], -coefficient, &padded[from..to - lag]);
                }
            }
            // The head of the run, by what came before it in the run.
            if run.start >= start {
                for k in 0..order.min(to - from) {
                    let predicted: f64 =
                        (1..).zip(&self.predictors[k]).map(|(lag, c)| c * padded[from + k - lag]).sum();
                    filtered[from + k] = self.scale[k] * (padded[from + k] - predicted);
                }
            }
        }
        Column { start, values: filtered }
    }
}

/// Predictors and error powers of all orders; `None` for a silent signal.
fn levinson(correlation: &[f64]) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let mut error = *correlation.first()?;
    if !(error > 0.0 && error.is_finite()) {
        return None;
    }
    let mut predictors = vec![Vec::new()];
    let mut errors = vec![error];
    for order in 1..correlation.len() {
        let last = &predictors[order - 1];
        let known: f64 = last.iter().enumerate().map(|(k, c)| c * correlation[order - 1 - k]).sum();
        let reflection = (correlation[order] - known) / error;
        let mut next: Vec<f64> =
            last.iter().zip(last.iter().rev()).map(|(c, mirrored)| c - reflection * mirrored).collect();
        next.push(reflection);
        error *= 1.0 - reflection * reflection;
        if error <= 1e-12 * errors[0] {
            break;
        }
        predictors.push(next);
        errors.push(error);
    }
    Some((predictors, errors))
}

/// A model seen through a whitening filter.
pub(crate) struct Whitened<'m, M> {
    pub(crate) model: &'m M,
    pub(crate) whitener: &'m Whitener,
}

impl<M: Separable> Separable for Whitened<'_, M> {
    fn target(&self, parameters: &[f64]) -> Vec<f64> {
        let target = Column::from(self.model.target(parameters));
        self.whitener.filter(&target).values
    }

    fn blocks(&self) -> usize {
        self.model.blocks()
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        self.model.block(block, parameters).iter().map(|column| self.whitener.filter(column)).collect()
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        self.model.depends(block, parameter)
    }

    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        _: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        let columns = self.model.block(block, parameters);
        let tangents = self.model.tangents(block, parameters, &columns, coefficients);
        tangents.into_iter().map(|(parameter, tangent)| (parameter, self.whitener.filter(&tangent))).collect()
    }

    fn target_depends(&self, parameter: usize) -> bool {
        self.model.target_depends(parameter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A second-order autoregression with a resonance.
    fn coloured(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut uniform = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut one, mut two) = (0.0, 0.0);
        let mut next = || {
            let innovation = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let value = 1.5 * one - 0.8 * two + innovation;
            (two, one) = (one, value);
            value
        };
        (0..n + 200).map(|_| next()).skip(200).collect()
    }

    fn whole(rows: usize) -> Vec<Range<usize>> {
        std::iter::once(0..rows).collect()
    }

    #[test]
    fn filtered_residuals_are_white_and_of_the_innovations_size() {
        let e = coloured(20_000, 1);
        let whitener = Whitener::of(&e, vec![0..7000, 7000..20_000]).unwrap();
        assert!((2..=4).contains(&whitener.order()));
        let white = whitener.filter(&e.into()).values;
        let power = dot(&white, &white) / 20_000.0;
        assert!((power - 1.0).abs() < 0.05, "{power}");
        for lag in 1..6 {
            let r = dot(&white[lag..], &white[..20_000 - lag]) / 20_000.0;
            assert!(r.abs() < 4.0 / 20_000_f64.sqrt(), "lag {lag}: {r}");
        }
        // The head of a run is scaled to the same size: not the size of the coloured noise, four times it.
        let heads: f64 = (0..200)
            .map(|seed| {
                let e = coloured(400, 10 + seed);
                Whitener { runs: whole(e.len()), ..whitener.clone() }.filter(&e.into()).values[0].powi(2)
            })
            .sum();
        assert!((0.6..1.5).contains(&(heads / 200.0)), "{heads}");
    }

    #[test]
    fn a_column_is_filtered_alike_whether_its_zeros_are_stored_or_not() {
        let whitener = Whitener::of(&coloured(3000, 2), vec![0..1000, 1000..3000]).unwrap();
        for start in [0, 990, 998, 1000, 1003, 2990] {
            let short = Column { start, values: vec![1.0, -2.0, 0.5] };
            let dense = Column::from(short.to_dense(3000));
            assert_eq!(whitener.filter(&short).to_dense(3000), whitener.filter(&dense).values, "{start}");
        }
    }

    #[test]
    fn white_residuals_and_uneven_rows_have_no_filter() {
        let e = coloured(4000, 3);
        let broken: Vec<Range<usize>> = (0..400).map(|k| 10 * k..10 * k + 10).collect();
        assert!(Whitener::of(&e, broken).is_none());
        let white = Whitener::of(&e, whole(4000)).unwrap().filter(&e.into()).values;
        assert!(Whitener::of(&white, whole(4000)).is_none());
        assert_eq!(even_runs(&[0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 6.5], 10), [10..14, 14..16, 16..17]);
    }
}
