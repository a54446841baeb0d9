//! What a recorded input does while nothing drives the structure: the channel's noise between hammer blows,
//! and the time before the first and after the last sample.

use crate::forced_record::MIN_ROWS;

/// Share of its range within which an input that rests stays for a few samples.
const AT_REST: f64 = 1e-3;
/// Samples at an end that have to rest.
const REST_SAMPLES: usize = 8;
/// A blow tops the channel's noise by this many standard deviations; with less there is no telling it from a
/// random force.
const CLEAR: f64 = 20.0;
/// Standard deviations of the noise, and share of the largest blow, above which a sample belongs to a blow.
const IN_BLOW: f64 = 6.0;
const SHARE_OF_BLOW: f64 = 0.02;
/// Standard deviations below which a blow's flank has ended.
const FLANK: f64 = 2.0;
/// Share of the record that blows may take: more is no impact test.
const MOST: f64 = 0.1;
/// Share of the record between blows that count as two.
const APART: f64 = 0.03;
/// Standard deviations of normal noise per median of its absolute values.
const PER_MEDIAN: f64 = 1.4826;
/// Samples that a record is continued by at most.
const MOST_BEYOND: usize = 65_536;

/// The force of an impact test with nothing between the blows, where the channel only records its own noise.
///
/// `None` where the input is no impact test, or is at exact rest between the blows already.
pub(crate) fn blows_alone(values: &[f64]) -> Option<Vec<f64>> {
    let level = median(values.to_vec())?;
    let sizes: Vec<f64> = values.iter().map(|value| (value - level).abs()).collect();
    let noise = PER_MEDIAN * median(sizes.clone())?;
    let largest = sizes.iter().fold(0.0_f64, |top, size| top.max(*size));
    if noise == 0.0 || largest < CLEAR * noise {
        return None;
    }
    let is_blow = |size: f64| size > (IN_BLOW * noise).max(SHARE_OF_BLOW * largest);
    let mut inside: Vec<bool> = sizes.iter().map(|size| is_blow(*size)).collect();
    for index in 1..inside.len() {
        inside[index] |= inside[index - 1] && sizes[index] > FLANK * noise;
    }
    for index in (1..inside.len()).rev() {
        inside[index - 1] |= inside[index] && sizes[index - 1] > FLANK * noise;
    }
    let count = inside.iter().filter(|inside| **inside).count();
    if count as f64 > MOST * values.len() as f64 {
        return None;
    }
    Some(values.iter().zip(inside).map(|(value, inside)| if inside { *value } else { level }).collect())
}

/// Where the blows of an impact test begin, double hits as one; none of any other input.
pub(crate) fn blow_starts(input: &[f64]) -> Vec<usize> {
    let largest = input.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
    let struck: Vec<usize> = (0..input.len()).filter(|k| input[*k].abs() > SHARE_OF_BLOW * largest).collect();
    if struck.len() as f64 > MOST * input.len() as f64 {
        return Vec::new();
    }
    let apart = (APART * input.len() as f64) as usize;
    let mut starts: Vec<usize> = Vec::new();
    let mut last = None;
    for k in struck {
        if last.is_none_or(|last| k > last + apart) {
            starts.push(k);
        }
        last = Some(k);
    }
    starts
}

/// Samples that the usual blow of an impact test lasts; `None` of any other input.
pub(crate) fn samples_of_a_blow(input: &[f64]) -> Option<usize> {
    let mut starts = blow_starts(input);
    let ends: Vec<usize> = starts.iter().skip(1).copied().chain([input.len()]).collect();
    let mut lengths: Vec<usize> = starts
        .drain(..)
        .zip(ends)
        .map(|(start, end)| {
            let blow = &input[start..end];
            let top = blow.iter().fold(0.0_f64, |top, value| top.max(value.abs()));
            blow.iter().filter(|value| value.abs() > SHARE_OF_LENGTH * top).count()
        })
        .collect();
    let middle = lengths.len() / 2;
    (!lengths.is_empty()).then(|| *lengths.select_nth_unstable(middle).1)
}

/// Share of its top above which a sample belongs to a blow.
const SHARE_OF_LENGTH: f64 = 0.1;

/// Whether an input is at rest at its first and at its last samples: then it is known beyond them.
pub(crate) fn rests_at_ends(values: &[f64]) -> [bool; 2] {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    let rests = |end: &mut dyn Iterator<Item = &f64>, level: f64| {
        values.len() > MIN_ROWS
            && end.take(REST_SAMPLES).all(|value| (value - level).abs() <= AT_REST * (high - low))
    };
    match (values.first(), values.last()) {
        (Some(first), Some(last)) => {
            [rests(&mut values.iter(), *first), rests(&mut values.iter().rev(), *last)]
        }
        _ => [false; 2],
    }
}

/// An input continued at its end values by a time, s, at the ends where it rests.
pub(crate) fn continued(
    mut time_s: Vec<f64>,
    mut values: Vec<f64>,
    by_s: f64,
    at_ends: [bool; 2],
) -> (Vec<f64>, Vec<f64>) {
    let count = time_s.len();
    if by_s <= 0.0 || count < 2 {
        return (time_s, values);
    }
    let interval_s = (time_s[count - 1] - time_s[0]) / (count - 1) as f64;
    let steps = ((by_s / interval_s).ceil() as usize + 1).min(MOST_BEYOND);
    let interval_s = interval_s.max(by_s / (steps.max(2) - 1) as f64);
    if at_ends[1] {
        let (last_s, level) = (time_s[count - 1], values[count - 1]);
        time_s.extend((1..=steps).map(|k| last_s + k as f64 * interval_s));
        values.resize(count + steps, level);
    }
    if at_ends[0] {
        let (first_s, level) = (time_s[0], values[0]);
        let before = (1..=steps).rev().map(|k| first_s - k as f64 * interval_s);
        time_s = before.chain(time_s).collect();
        values = std::iter::repeat_n(level, steps).chain(values).collect();
    }
    (time_s, values)
}

/// The middle one.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> f64 {
        let mut z = (k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((z ^ (z >> 27)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    #[test]
    fn between_blows_the_force_is_set_to_its_level_and_blows_stay_as_recorded() {
        let blow = |k: usize, at: usize| {
            if (at..at + 12).contains(&k) { ((k - at) as f64 * 0.26).sin() } else { 0.0 }
        };
        let force: Vec<f64> =
            (0..2000).map(|k| 3.0 + 80.0 * blow(k, 200) + 60.0 * blow(k, 215) + noise(k)).collect();
        let quiet = blows_alone(&force).unwrap();
        assert!(quiet[202..210].iter().zip(&force[202..210]).all(|(a, b)| a == b));
        let level = quiet[0];
        assert!((level - 3.0).abs() < 0.1, "{level}");
        assert!(quiet[..195].iter().chain(&quiet[232..]).all(|value| *value == level));
    }

    #[test]
    fn sweeps_and_random_forces_are_no_blows() {
        let sweep: Vec<f64> = (0..4000).map(|k| (1e-5 * (k * k) as f64).sin()).collect();
        let random: Vec<f64> = (0..4000).map(noise).collect();
        assert!(blows_alone(&sweep).is_none() && blows_alone(&random).is_none());
        assert_eq!(rests_at_ends(&random), [false, false]);
    }

    #[test]
    fn an_input_is_continued_only_where_it_rests() {
        let values: Vec<f64> = (0..100).map(|k| f64::from((k - 50_i32).max(0))).collect();
        let time_s: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        let ends = rests_at_ends(&values);
        assert_eq!(ends, [true, false]);
        let (longer_s, longer) = continued(time_s, values, 1.0, ends);
        assert!(longer_s[0] <= -1.0 && (longer_s[longer_s.len() - 1] - 9.9).abs() < 1e-9);
        assert!(longer_s.windows(2).all(|pair| pair[1] > pair[0]) && longer[0] == 0.0);
    }
}
