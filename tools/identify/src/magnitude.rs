//! Columns that hold the size of a signal without its sign: an absolute value, the length of a vector.
//!
//! Where the signal passes zero its size turns back sharply. It repeats twice a period, and its edges are
//! harmonics of that: none of its lines is a mode. A signal that is at rest somewhere above zero does not
//! come down to it, and one that just touches it (1 - cos) is as round there as at its tops.

use stillbeam_recording::Recording;

use crate::error::IdentifyError;

/// Share of the largest value above which a stretch is loud enough to look at.
const LOUD: f64 = 0.1;
/// Lowest over highest turning points of the column: a signal at ten samples a period misses its zero by
/// less.
const DOWN_TO_ZERO: f64 = 0.25;
/// How much more sharply it turns below than above.
const SHARPER: f64 = 2.0;
/// Share of the top by which a signal comes back from a turning point.
const BACK: f64 = 0.3;
/// Turning points of either kind at least.
const LEAST: usize = 6;
/// Share of the samples that may be exactly zero: what is cut off at zero stays there.
const AT_ZERO: f64 = 0.2;

/// An error where a column holds a size without a sign.
pub(crate) fn refuse_magnitude(
    recording: &Recording,
    column: &str,
    values: &[f64],
) -> Result<(), IdentifyError> {
    if !is_magnitude(values) {
        return Ok(());
    }
    let others = recording.columns.iter().map(|other| other.name.clone());
    Err(IdentifyError::Magnitude {
        recording: recording.name.clone(),
        column: column.to_owned(),
        others: others.filter(|other| other != column).collect(),
    })
}

fn is_magnitude(values: &[f64]) -> bool {
    let largest = values.iter().fold(0.0_f64, |top, value| top.max(*value));
    let zeros = values.iter().filter(|value| **value == 0.0).count();
    if values.iter().any(|value| *value < 0.0) || zeros as f64 > AT_ZERO * values.len() as f64 {
        return false;
    }
    let turns = turning_points(values, LOUD * largest);
    let (mut tops, mut bottoms) = (Vec::new(), Vec::new());
    for three in turns.windows(3) {
        let [before, here, after] = [three[0], three[1], three[2]];
        let reach = ((after - before) / 12).max(1);
        let Some((left, right)) =
            here.checked_sub(reach).and_then(|k| values.get(k)).zip(values.get(here + reach))
        else {
            continue;
        };
        let bend = (left - 2.0 * values[here] + right).abs();
        let beside = 0.5 * (values[before] + values[after]);
        if values[here] > beside {
            tops.push([1.0, bend]);
        } else {
            bottoms.push([values[here] / beside, bend]);
        }
    }
    if tops.len() < LEAST || bottoms.len() < LEAST {
        return false;
    }
    let middle = |some: &[[f64; 2]], index: usize| {
        let mut sorted: Vec<f64> = some.iter().map(|pair| pair[index]).collect();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    middle(&bottoms, 0) < DOWN_TO_ZERO && middle(&bottoms, 1) > SHARPER * middle(&tops, 1)
}

/// Rows at which a signal turns back by more than noise does, up to where it stays below a level.
fn turning_points(values: &[f64], level: f64) -> Vec<usize> {
    let mut turns = vec![0];
    let (mut extreme, mut rises) = (0, true);
    for k in 1..values.len() {
        let further = if rises { values[k] >= values[extreme] } else { values[k] <= values[extreme] };
        let size = if rises { values[extreme] } else { values[turns[turns.len() - 1]] };
        if further {
            extreme = k;
        } else if size > level && (values[k] - values[extreme]).abs() > BACK * size {
            turns.push(extreme);
            (extreme, rises) = (k, !rises);
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A decay at some samples a period, with a little noise that repeats never.
    fn ringing(samples: f64, k: i32) -> f64 {
        let t = f64::from(k) / samples;
        (-0.05 * t).exp() * (std::f64::consts::TAU * t + 0.4).cos() + 2e-3 * (977.0 * t).sin()
    }

    #[test]
    fn sizes_without_a_sign_are_told_from_signals_that_stay_above_zero() {
        for samples in [11.0, 17.3, 40.0, 133.0] {
            let signal: Vec<f64> = (0..40 * samples as i32).map(|k| ringing(samples, k)).collect();
            let of = |make: &dyn Fn(f64) -> f64| signal.iter().map(|y| make(*y)).collect::<Vec<f64>>();
            assert!(is_magnitude(&of(&f64::abs)), "{samples}");
            assert!(is_magnitude(&of(&|y| y.hypot(0.4 * y + 1e-3))), "{samples}");
            assert!(!is_magnitude(&signal), "{samples}");
            for offset in [1.1, 1.5, 9.81, 2048.0] {
                assert!(!is_magnitude(&of(&|y| offset + y)), "{samples} {offset}");
            }
            assert!(!is_magnitude(&of(&|y| y.max(0.0))), "{samples}");
            let steady: Vec<f64> = (0..4000).map(|k| 1.0 - (f64::from(k) / samples).cos()).collect();
            assert!(!is_magnitude(&steady), "{samples}");
        }
    }
}
