//! Stamps that say less about the time than the samples: coarser than the sampling, or one for a whole
//! packet.

/// Stamps coarser than this share of the interval are laid on their grid; finer ones are left as they are.
const COARSE: f64 = 0.02;
/// Intervals below this number say nothing about a grid.
const FEWEST: usize = 20;
/// Share of the intervals that rounding an even grid explains, at least; the others are gaps.
const ORDINARY: f64 = 0.9;
/// Rounding to a quantum leaves 1 of it from the lowest to the highest and 0.29 rms; a little jitter of the
/// recorder is added.
const SPREAD: f64 = 1.3;
const RMS: f64 = 0.36;

/// Stamps laid on an even grid, and what to say about it.
pub(crate) struct Laid {
    pub(crate) time_s: Vec<f64>,
    pub(crate) remark: String,
}

/// A place on the grid for every stamp.
struct Places {
    places: Vec<f64>,
    /// Index before each gap, and the samples missing there.
    gaps: Vec<(usize, f64)>,
}

/// Unit of the last decimal place that numbers use; 0 where they use more than nine.
pub(crate) fn last_decimal_place(numbers: &[f64]) -> f64 {
    let whole = |unit: f64| numbers.iter().all(|t| (t / unit - (t / unit).round()).abs() < 1e-3);
    (0..=9).map(|digits| 10_f64.powi(-digits)).find(|unit| whole(*unit)).unwrap_or(0.0)
}

/// Lays stamps on the even grid of which they are a rounding, or of which only one per packet was stamped.
/// `quantum_s` is the unit of their last place, s.
pub(crate) fn lay(time_s: &[f64], quantum_s: f64) -> Option<Laid> {
    if time_s.len() <= FEWEST || time_s.windows(2).any(|pair| !matches!(pair, [a, b] if b >= a)) {
        return None;
    }
    let intervals: Vec<f64> =
        time_s.windows(2).map(|pair| pair.last().unwrap_or(&0.0) - pair.first().unwrap_or(&0.0)).collect();
    rounded(time_s, &intervals, quantum_s)
        .or_else(|| rounded(time_s, &intervals, common_step(&intervals)))
        .or_else(|| packets(time_s, &intervals))
}

/// The smallest step, if all are multiples of it: the tick of a clock that is none of decimals.
fn common_step(intervals: &[f64]) -> f64 {
    let smallest = intervals.iter().copied().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let multiple = |step: &f64| (step / smallest - (step / smallest).round()).abs() < 0.02;
    if smallest.is_finite() && intervals.iter().all(multiple) { smallest } else { 0.0 }
}

/// An even grid rounded to a quantum: its intervals are one of two neighbouring multiples.
fn rounded(time_s: &[f64], intervals: &[f64], quantum_s: f64) -> Option<Laid> {
    if quantum_s <= 0.0 {
        return None;
    }
    let steps: Vec<f64> = intervals.iter().map(|interval| (interval / quantum_s).round()).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let count = |step: f64| sorted.partition_point(|s| *s <= step) - sorted.partition_point(|s| *s < step);
    let middle = sorted.get(sorted.len() / 2).copied()?;
    let low = if count(middle - 1.0) > count(middle + 1.0) { middle - 1.0 } else { middle };
    let (lower, upper) = (count(low), count(low + 1.0));
    let ordinary = lower + upper;
    if lower == 0 || upper == 0 || (ordinary as f64) < ORDINARY * steps.len() as f64 {
        return None;
    }
    let interval_s = quantum_s * (low + upper as f64 / ordinary as f64);
    if quantum_s < COARSE * interval_s {
        return None;
    }
    let is_gap = |step: f64| step < low - 0.5 || step > low + 1.5;
    let found = places(time_s, interval_s, |index| steps.get(index).is_some_and(|step| is_gap(*step)));
    let (interval_s, residuals) = line(&found.places, time_s);
    let (least, most, rms) = spread(&residuals);
    if most - least > SPREAD * quantum_s || rms > RMS * quantum_s {
        return None;
    }
    let what = format!("the time stamps are an even grid rounded to {} s", short(quantum_s));
    Some(laid(time_s, &found, interval_s, &what))
}

/// Counts the places of stamps on a grid: one after the other, except where a gap is known to be. What lies
/// beyond it is placed by the mean of the stamps before it, which rounding moves less than a single one.
fn places(time_s: &[f64], interval_s: f64, is_gap: impl Fn(usize) -> bool) -> Places {
    /// Stamps that the mean goes over, about.
    const REMEMBERED: f64 = 64.0;
    let mut found = Places { places: Vec::with_capacity(time_s.len()), gaps: Vec::new() };
    let (mut place, mut start_s, mut count) = (0.0, 0.0, 0.0_f64);
    for (index, stamp) in time_s.iter().enumerate() {
        if let Some(before) = index.checked_sub(1) {
            let missing = if is_gap(before) {
                ((stamp - start_s) / interval_s - place - 1.0).round().max(0.0)
            } else {
                0.0
            };
            if missing > 0.0 {
                found.gaps.push((before, missing));
            }
            place += 1.0 + missing;
        }
        count = (count + 1.0).min(REMEMBERED);
        start_s += (stamp - place * interval_s - start_s) / count;
        found.places.push(place);
    }
    found
}

/// Packets: samples share a stamp, which is that of the packet.
fn packets(time_s: &[f64], intervals: &[f64]) -> Option<Laid> {
    let repeated = intervals.iter().filter(|interval| **interval == 0.0).count();
    // Where each packet ends.
    let ends: Vec<usize> = (0..time_s.len())
        .filter(|k| time_s.get(k + 1).is_none_or(|next| Some(next) != time_s.get(*k)))
        .collect();
    if 3 * repeated < time_s.len() || ends.len() < FEWEST / 2 {
        return None;
    }
    let stamps: Vec<f64> = ends.iter().filter_map(|k| time_s.get(*k).copied()).collect();
    let mut places: Vec<f64> = ends.iter().map(|k| *k as f64).collect();
    let usual = time_s.len() as f64 / ends.len() as f64;
    let mut interval_s = robust_interval(&places, &stamps)?;
    let mut gaps = Vec::new();
    // A packet that is late is followed by one that is not; after a gap all are later.
    for _ in 0..2 {
        let late: Vec<f64> = places.iter().zip(&stamps).map(|(k, t)| t - interval_s * k).collect();
        let mut shift = 0.0;
        for packet in 1..late.len() {
            let window =
                |from: usize, to: usize| late.get(from..to.min(late.len())).unwrap_or(&[]).iter().copied();
            let before = window(packet.saturating_sub(4), packet).fold(f64::NEG_INFINITY, f64::max);
            let after = window(packet, packet + 4).fold(f64::INFINITY, f64::min);
            let missing = ((after - before) / interval_s).round();
            if missing > 0.5 * usual && missing.is_finite() {
                shift += missing;
                gaps.push((*ends.get(packet - 1)?, missing));
            }
            if let Some(place) = places.get_mut(packet) {
                *place += shift;
            }
        }
        interval_s = line(&places, &stamps).0;
        if shift == 0.0 {
            break;
        }
    }
    let (_, _, rms) = spread(&line(&places, &stamps).1);
    if interval_s <= 0.0 || rms > usual * interval_s {
        return None;
    }
    let mut missing = gaps.clone();
    missing.sort_by_key(|(index, _)| *index);
    let mut at = missing.iter().peekable();
    let mut shift = 0.0;
    let mut all = Vec::with_capacity(time_s.len());
    for k in 0..time_s.len() {
        all.push(k as f64 + shift);
        while let Some((_, lost)) = at.next_if(|(index, _)| *index == k) {
            shift += lost;
        }
    }
    let what = format!("about {} samples share each time stamp", short(usual));
    Some(laid(time_s, &Places { places: all, gaps: missing }, interval_s, &what))
}

/// Seconds per sample, little moved by gaps and late packets: the median over runs of packets.
fn robust_interval(places: &[f64], stamps: &[f64]) -> Option<f64> {
    let lag = 8.min(places.len() / 2).max(1);
    let mut slopes: Vec<f64> = (lag..places.len())
        .filter_map(|k| {
            let before = k - lag;
            Some((stamps.get(k)? - stamps.get(before)?) / (places.get(k)? - places.get(before)?))
        })
        .collect();
    let middle = slopes.len() / 2;
    if slopes.is_empty() {
        return None;
    }
    let interval_s = *slopes.select_nth_unstable_by(middle, f64::total_cmp).1;
    (interval_s > 0.0).then_some(interval_s)
}

/// Slope of the straight line of stamps over places, and the distances from it.
fn line(places: &[f64], stamps: &[f64]) -> (f64, Vec<f64>) {
    let count = places.len().max(1) as f64;
    let (mean_place, mean_s) = (places.iter().sum::<f64>() / count, stamps.iter().sum::<f64>() / count);
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (place, stamp) in places.iter().zip(stamps) {
        covariance += (place - mean_place) * (stamp - mean_s);
        variance += (place - mean_place).powi(2);
    }
    let slope = if variance > 0.0 { covariance / variance } else { 0.0 };
    let residuals = places.iter().zip(stamps).map(|(k, t)| t - mean_s - slope * (k - mean_place)).collect();
    (slope, residuals)
}

fn spread(residuals: &[f64]) -> (f64, f64, f64) {
    let least = residuals.iter().copied().fold(f64::INFINITY, f64::min);
    let most = residuals.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64).sqrt();
    (least, most, rms)
}

fn laid(time_s: &[f64], found: &Places, interval_s: f64, what: &str) -> Laid {
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let stamps: Vec<f64> = found.places.iter().map(|place| start_s + place * interval_s).collect();
    let mut remark = format!("{what}; the samples were laid on a grid of {} Hz", short(1.0 / interval_s));
    if let Some((index, most)) = found.gaps.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
        let all: f64 = found.gaps.iter().map(|(_, missing)| missing).sum();
        let at_s = stamps.get(*index).copied().unwrap_or(0.0);
        remark.push_str(&format!(
            ", where about {all:.0} samples are missing in {} gaps, {most:.0} of them after {} s",
            found.gaps.len(),
            short(at_s)
        ));
    }
    Laid { time_s: stamps, remark }
}

/// Four significant digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(rate_hz: f64, count: u32, quantum_s: f64, round: fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|k| round((0.3 + f64::from(k) / rate_hz) / quantum_s) * quantum_s).collect()
    }

    /// The largest distance from the true grid, in intervals, the sub-quantum start set aside.
    fn worst(laid: &Laid, rate_hz: f64, lost: impl Fn(usize) -> f64) -> f64 {
        let start = laid.time_s[0];
        let off = |(k, t): (usize, &f64)| ((t - start) * rate_hz - k as f64 - lost(k)).abs();
        laid.time_s.iter().enumerate().map(off).fold(0.0, f64::max)
    }

    #[test]
    fn an_even_grid_is_found_under_stamps_of_any_coarseness() {
        for rate_hz in [800.0, 1651.613, 3200.0, 333.0, 97.3, 26_667.0] {
            for quantum_s in [1e-2, 1e-3, 1e-4, 0.015_625] {
                for round in [f64::round, f64::floor] {
                    let stamps = grid(rate_hz, 4000, quantum_s, round);
                    if rate_hz * quantum_s < 0.02
                        || (rate_hz * quantum_s).fract() == 0.0 && rate_hz * quantum_s < 2.0
                    {
                        continue;
                    }
                    let laid =
                        lay(&stamps, quantum_s).unwrap_or_else(|| panic!("{rate_hz} Hz, {quantum_s} s"));
                    // The slope of 4000 rounded stamps is known to a fraction of a quantum over the record.
                    let allowed = 0.02 + 0.1 * rate_hz * quantum_s;
                    assert!(worst(&laid, rate_hz, |_| 0.0) < allowed, "{rate_hz} Hz, {quantum_s} s");
                    assert!(!laid.remark.contains("missing"), "{}", laid.remark);
                }
            }
        }
    }

    #[test]
    fn gaps_stay_gaps_and_are_counted() {
        let mut stamps = grid(800.0, 4000, 1e-3, f64::round);
        stamps.drain(1000..1007);
        stamps.drain(3000..3002);
        let laid = lay(&stamps, 1e-3).unwrap();
        let lost = |k: usize| {
            if k >= 3000 {
                9.0
            } else if k >= 1000 {
                7.0
            } else {
                0.0
            }
        };
        assert!(worst(&laid, 800.0, lost) < 0.1);
        assert!(laid.remark.contains("9 samples are missing in 2 gaps, 7 of them"), "{}", laid.remark);
    }

    #[test]
    fn packets_are_laid_out_even_when_they_arrive_late_or_are_lost() {
        // 32 samples a packet at 3200 Hz, each stamped when it arrived, up to 6 ms late; three packets lost.
        let late = |packet: u32| 0.003 * (1.0 + (f64::from(packet * packet)).sin());
        let packets = (0..400_u32).filter(|packet| !(200..203).contains(packet));
        let stamps: Vec<f64> =
            packets.flat_map(|p| std::iter::repeat_n(0.01 * f64::from(p) + late(p), 32)).collect();
        let laid = lay(&stamps, 1e-6).unwrap();
        let lost = |k: usize| if k >= 200 * 32 { 96.0 } else { 0.0 };
        // Lateness moves the count of the lost by a few samples, never the rate.
        assert!(worst(&laid, 3200.0, lost) < 24.0, "{}", worst(&laid, 3200.0, lost));
        assert!(
            laid.remark.contains("share each time stamp") && laid.remark.contains("missing"),
            "{}",
            laid.remark
        );
    }

    #[test]
    fn what_is_no_rounded_grid_is_left_alone() {
        let even: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        assert!(lay(&even, 0.01).is_none());
        let fine: Vec<f64> = (0..1000).map(|k| (f64::from(k) / 3212.0 * 1e6).round() / 1e6).collect();
        assert!(lay(&fine, 1e-6).is_none());
        let jitter: Vec<f64> =
            even.iter().map(|t| ((t + 0.003 * (t * 1e4).sin()) * 1e3).round() / 1e3).collect();
        assert!(lay(&jitter, 1e-3).is_none());
        let missing: Vec<f64> =
            even.iter().enumerate().filter(|(k, _)| k * 7919 % 1009 % 7 != 3).map(|(_, t)| *t).collect();
        assert!(lay(&missing, 0.01).is_none());
        let mut back = even.clone();
        back.swap(500, 501);
        assert!(lay(&back, 0.01).is_none() && lay(&even[..10], 0.01).is_none());
    }
}
