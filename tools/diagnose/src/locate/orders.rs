//! At which multiple of the sweep's frequency: windowed least squares on the sweep's own phase.

use serde::Serialize;
use stillbeam_identify::tall::{Orthonormal, dot};

use super::phase::sweep_phase;
use crate::noise::OutputResidual;

/// Amplitudes of the residual by order and time, for one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OrderMap {
    /// The recording's name.
    pub recording: String,
    /// Middle of every window, seconds.
    pub time_s: Vec<f64>,
    /// The sweep's frequency there, hertz.
    pub frequency_hz: Vec<f64>,
    /// Per window: amplitude of orders 1 to 5 of the residual, in the output's unit.
    pub residual: Vec<[f64; ORDERS]>,
    /// Per window: amplitude of order 1 of the simulated output.
    pub output: Vec<f64>,
    /// Per window: power of the residual that belongs to no order, over all of its power.
    pub rest: Vec<f64>,
}

/// Orders that are looked at.
pub const ORDERS: usize = 5;

/// Seconds and periods that a window must have.
const WINDOW_S: f64 = 2.0;
const PERIODS: f64 = 4.0;

/// The map of one residual; `None` when the input is no sweep.
pub(crate) fn order_map(part: &OutputResidual<'_>, _slowest_hz: Option<f64>) -> Option<OrderMap> {
    let (phase, frequency_hz) = sweep_phase(part.record)?;
    let signal = &part.record.outputs[part.output];
    let times_s = part.record.times_s(part.output);
    let rate_hz = part.record.rate_hz(part.output);
    let mut map = OrderMap {
        recording: part.record.name.clone(),
        time_s: Vec::new(),
        frequency_hz: Vec::new(),
        residual: Vec::new(),
        output: Vec::new(),
        rest: Vec::new(),
    };
    let mut start = 0;
    while start < times_s.len() {
        let hz = frequency_hz[signal.at[start]].max(0.05);
        let seconds = WINDOW_S.max(PERIODS / hz);
        let end = start + (seconds * rate_hz) as usize;
        if end > times_s.len() {
            break;
        }
        let phases: Vec<f64> = signal.at[start..end].iter().map(|&k| phase[k]).collect();
        let middle = (start + end) / 2;
        // Orders beyond the sampling rate's half would come back as others.
        let highest = (0.4 * rate_hz / frequency_hz[signal.at[end - 1]].max(0.05)) as usize;
        let amplitudes = amplitudes(&phases, &part.residual[start..end], highest.min(ORDERS));
        let power = dot(&part.residual[start..end], &part.residual[start..end]) / (end - start) as f64;
        let ordered: f64 = amplitudes.iter().map(|a| 0.5 * a * a).sum();
        map.time_s.push(times_s[middle]);
        map.frequency_hz.push(frequency_hz[signal.at[middle]]);
        map.output.push(self::amplitudes(&phases, &part.simulated[start..end], 1)[0]);
        map.rest.push(((power - ordered) / power.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0));
        map.residual.push(amplitudes);
        start += ((end - start) / 2).max(1);
    }
    (map.time_s.len() >= 4).then_some(map)
}

/// Amplitudes of the orders 1 to `highest`, by least squares together with a level and a slope.
fn amplitudes(phases: &[f64], values: &[f64], highest: usize) -> [f64; ORDERS] {
    let n = values.len();
    let mut basis = Orthonormal::default();
    basis.push(vec![1.0; n]);
    basis.push((0..n).map(|k| k as f64 / n as f64 - 0.5).collect::<Vec<f64>>());
    for order in 1..=highest {
        let order = order as f64;
        basis.push(phases.iter().map(|p| (order * p).cos()).collect::<Vec<f64>>());
        basis.push(phases.iter().map(|p| (order * p).sin()).collect::<Vec<f64>>());
    }
    let components = basis.remove_from(&mut values.to_vec());
    let coefficients = basis.coefficients(&components);
    std::array::from_fn(|order| {
        let cosine = coefficients.get(2 + 2 * order).copied().unwrap_or(0.0);
        let sine = coefficients.get(3 + 2 * order).copied().unwrap_or(0.0);
        cosine.hypot(sine)
    })
}

/// One sentence over all maps, and odd and even distortion in decibels.
pub(crate) fn summary(maps: &[OrderMap]) -> (Option<String>, Option<f64>, Option<f64>) {
    if maps.is_empty() {
        return (None, None, None);
    }
    let mut powers = [0.0; ORDERS];
    let mut output = 0.0;
    let (mut rest, mut count) = (0.0, 0.0);
    for map in maps {
        for ((amplitudes, first), left) in map.residual.iter().zip(&map.output).zip(&map.rest) {
            for (power, amplitude) in powers.iter_mut().zip(amplitudes) {
                *power += amplitude * amplitude;
            }
            output += first * first;
            rest += left;
            count += 1.0;
        }
    }
    let total: f64 = powers.iter().sum();
    if total <= 0.0 || output <= 0.0 {
        return (None, None, None);
    }
    let share = |power: f64| 100.0 * power / total;
    let (even, odd) = (powers[1] + powers[3], powers[2] + powers[4]);
    let sentence = format!(
        "Of what follows the sweep, {:.0} % is of its own frequency, {:.0} % of even and {:.0} % of odd multiples; {:.0} % of the residual follows no multiple.",
        share(powers[0]),
        share(even),
        share(odd),
        100.0 * rest / count
    );
    let decibel = |power: f64| 10.0 * (power / output).max(1e-30).log10();
    (Some(sentence), Some(decibel(odd)), Some(decibel(even)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_of_a_sweep_are_told_apart() {
        let phases: Vec<f64> = (0..800)
            .map(|k| {
                let t = f64::from(k) * 0.01;
                6.0 * t + 0.4 * t * t
            })
            .collect();
        let values: Vec<f64> =
            phases.iter().map(|p| 0.3 + 2.0 * (p - 0.4).cos() + 0.5 * (3.0 * p + 1.0).sin()).collect();
        let found = amplitudes(&phases, &values, ORDERS);
        for (found, wanted) in found.iter().zip([2.0, 0.0, 0.5, 0.0, 0.0]) {
            assert!((found - wanted).abs() < 1e-9, "{found} for {wanted}");
        }
    }
}
