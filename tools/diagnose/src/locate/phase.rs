//! The phase of a sweep, from the recorded input alone.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::record::Record;

/// Phase in radians, unwrapped, and frequency in hertz, at every stamp of a uniform recording whose input is
/// a sweep or a tone; `None` for any other input.
///
/// From the analytic signal (the spectrum's negative half removed). An input counts as a sweep when that
/// phase hardly ever turns back.
pub(crate) fn sweep_phase(record: &Record) -> Option<(Vec<f64>, Vec<f64>)> {
    let input = record.input.as_ref()?;
    let n = input.len();
    let interval_s = record.duration_s() / (n.max(2) - 1) as f64;
    let uniform = record.time_s.windows(2).all(|pair| ((pair[1] - pair[0]) / interval_s - 1.0).abs() < 0.01);
    if n < 64 || !uniform {
        return None;
    }
    let mean = input.iter().sum::<f64>() / n as f64;
    // Padded, or the end of the sweep would meet its start.
    let length = (2 * n).next_power_of_two();
    let mut buffer = vec![Complex::new(0.0, 0.0); length];
    for (place, value) in buffer.iter_mut().zip(input) {
        place.re = value - mean;
    }
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(length).process(&mut buffer);
    for (bin, value) in buffer.iter_mut().enumerate() {
        *value *= if bin == 0 || 2 * bin == length {
            1.0
        } else if 2 * bin < length {
            2.0
        } else {
            0.0
        };
    }
    planner.plan_fft_inverse(length).process(&mut buffer);
    let mut phase = Vec::with_capacity(n);
    let mut last = buffer[0].arg();
    let mut turns = last;
    for value in &buffer[..n] {
        let now = value.arg();
        let step =
            (now - last + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        turns += step;
        last = now;
        phase.push(turns);
    }
    let back = phase.windows(2).filter(|pair| pair[1] <= pair[0]).count();
    if back * 50 > n {
        return None;
    }
    // Over a tenth of a second or more: the frequency of a sweep changes slowly.
    let reach = ((0.25 / interval_s) as usize).max(2);
    let frequency_hz = (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(reach), (k + reach).min(n - 1));
            (phase[b] - phase[a]) / (std::f64::consts::TAU * (b - a) as f64 * interval_s)
        })
        .collect();
    Some((phase, frequency_hz))
}
