//! The step that readings come in, read off the readings themselves.
//!
//! Readings of a rounded output are few values, multiples of one step. They may have been rounded a second
//! time, when they were written down in so many digits or passed a finer converter: then no two neighbours
//! are exactly as far apart as two others, and the step is the slope of the line through all values over
//! their numbers.

/// The step of an output, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReadingStep {
    pub(crate) value: f64,
    /// Standard error.
    pub(crate) stderr: f64,
}

/// A distance of neighbouring values is a multiple of the step when it is off by less than this share of it,
/// ...
const OFF: f64 = 0.05;
/// ... as all but this share of them are.
const STRAY: f64 = 0.1;
/// Numbers themselves are rounded at about this share of a step.
const ROUNDING: f64 = 1e-9;

impl ReadingStep {
    /// From the readings of one recording; `None` where they are no multiples of anything: distinct readings
    /// of an analogue sensor are as many as samples.
    pub(crate) fn of(readings: &[f64]) -> Option<Self> {
        let mut values: Vec<f64> = readings.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if gaps.is_empty() || gaps.len() * 2 > readings.len() {
            return None;
        }
        let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
        // Single steps, of which the smallest is the one that a second rounding took most from.
        let single: Vec<f64> = gaps.iter().copied().filter(|gap| *gap < 1.5 * smallest).collect();
        let step = single.iter().sum::<f64>() / single.len() as f64;
        let stray = gaps.iter().filter(|gap| (**gap / step - (**gap / step).round()).abs() >= OFF).count();
        if stray as f64 >= STRAY * gaps.len() as f64 {
            return None;
        }
        Some(Self::slope(&values, &gaps, step))
    }

    /// The slope of the values over their numbers, counted by steps of about `step`.
    fn slope(values: &[f64], gaps: &[f64], step: f64) -> Self {
        let mut numbers = vec![0.0];
        for gap in gaps {
            numbers.push(numbers[numbers.len() - 1] + (gap / step).round());
        }
        let count = values.len() as f64;
        let mean = |of: &[f64]| of.iter().sum::<f64>() / count;
        let (middle, level) = (mean(&numbers), mean(values));
        let square: f64 = numbers.iter().map(|number| (number - middle).powi(2)).sum();
        let along: f64 = numbers.iter().zip(values).map(|(n, value)| (n - middle) * (value - level)).sum();
        let value = along / square;
        let left: f64 =
            numbers.iter().zip(values).map(|(n, v)| (v - level - value * (n - middle)).powi(2)).sum();
        let scatter = (left / (count - 2.0).max(1.0)).sqrt();
        Self { value, stderr: (scatter / square.sqrt()).max(ROUNDING * value) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion of a few millimetres, read in steps and written down in finer ones.
    fn readings(step: f64, written: f64) -> Vec<f64> {
        let motion = |k: u32| 2e-3 * (0.037 * f64::from(k)).sin() + 7e-4 * (0.101 * f64::from(k)).cos();
        let rounded = |value: f64, to: f64| if to > 0.0 { (value / to).round() * to } else { value };
        (0..2500).map(|k| rounded(rounded(motion(k), step), written)).collect()
    }

    #[test]
    fn a_step_is_read_off_to_rounding() {
        let step = ReadingStep::of(&readings(1.5109e-4, 0.0)).unwrap();
        assert!((step.value / 1.5109e-4 - 1.0).abs() < 1e-9, "{step:?}");
        assert!(step.stderr < 1e-12, "{step:?}");
    }

    #[test]
    fn a_second_rounding_leaves_it_uncertain_by_what_it_scatters() {
        for (true_step, written) in [(1.510_936e-4, 3.3666e-6), (3.5102e-4, 1.1657e-5), (2.9e-4, 1e-6)] {
            let step = ReadingStep::of(&readings(true_step, written)).unwrap();
            assert!((step.value - true_step).abs() < 3.0 * step.stderr, "{step:?} for {true_step}");
            assert!(step.stderr < 0.02 * written, "{step:?}");
        }
    }

    #[test]
    fn an_analogue_sensor_has_no_step() {
        assert_eq!(ReadingStep::of(&readings(0.0, 0.0)), None);
        assert_eq!(ReadingStep::of(&[1.0; 50]), None);
        assert_eq!(ReadingStep::of(&[]), None);
    }
}
