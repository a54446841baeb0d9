//! Long records on fewer samples: what is fitted is the band in which something happens.
//!
//! Input and output pass the same symmetric filter, so that they stay input and output of the same structure,
//! its free responses included. The band that is left between the last excited frequency and half the new
//! rate rolls off as much as it is folded, so that white noise stays nearly white.

use std::f64::consts::{PI, TAU};

use crate::forced_record::ForcedRecord;
use crate::interpolation::{InputInterpolation, PiecewiseCubic};
use crate::modal_response::InputKind;
use crate::result::Rejected;
use crate::spectra::{CrossSpectra, Window};

/// Records of fewer rows are fitted as they are.
const LONG: usize = 8192;
/// Segments that the spectra of a record are averaged over.
const SEGMENTS: usize = 16;
/// Density of the input, relative to its largest, at which it has ended.
const EXCITED: f64 = 1e-3;
/// The same of the acceleration of a base whose position is recorded, which a sensor's noise reaches sooner.
const DRIVEN: f64 = 1e-2;
/// Share of the output's power that has to lie below the band's end.
const POWER: f64 = 0.98;
/// Output samples per period of the band's end, and input samples, which a spline has to follow.
const OUTPUT_SAMPLES: f64 = 3.0;
const INPUT_SAMPLES: f64 = 12.0;
/// The filter passes up to the first and stops from the second of these multiples of the band's end.
const PASS: f64 = 1.1;
const STOP: f64 = 1.9;
/// Width of a Blackman filter's flank, in samples times its length.
const FLANK: f64 = 5.5;
/// Share of the output's energy that the ends, which the filter takes, may hold beyond their share of the
/// time.
const ENDS: f64 = 0.02;
/// Scatter of the intervals, as a share of the mean one, of stamps that count as even.
const EVEN: f64 = 1e-3;

/// The record on a coarser grid where that loses nothing; as it is where it does, or where it is short.
pub(crate) fn in_band(record: ForcedRecord, interpolation: InputInterpolation) -> ForcedRecord {
    match coarser(&record, interpolation) {
        Some(coarse) => coarse,
        None => record,
    }
}

fn coarser(record: &ForcedRecord, interpolation: InputInterpolation) -> Option<ForcedRecord> {
    let rows = record.time_s.len();
    if rows < LONG || record.output_is_absolute() || interpolation == InputInterpolation::Hold {
        return None;
    }
    let interval_s = even_interval(&record.time_s)?;
    let sampled = |times: &[f64]| -> Vec<f64> {
        record.input.sample(times.iter().copied()).into_iter().map(|value| value[0]).collect()
    };
    let mut top_hz = band_end_hz(&sampled(&record.time_s), &record.output, interval_s, EXCITED)?;
    if record.input_kind == InputKind::BasePosition {
        // What drives the modes is the base's acceleration.
        let drive = record.input.sample(record.time_s.iter().copied());
        let drive: Vec<f64> = drive.into_iter().map(|[_, _, second]| second).collect();
        top_hz = top_hz.max(band_end_hz(&drive, &record.output, interval_s, DRIVEN)?);
    }
    let rate_hz = 1.0 / interval_s;
    let stride = (rate_hz / (OUTPUT_SAMPLES * top_hz)) as usize;
    let input_stride = ((rate_hz / (INPUT_SAMPLES * top_hz)) as usize).max(1);
    if stride < 2 {
        return None;
    }
    let taps = filter(top_hz, interval_s);
    let reach = taps.len() / 2;
    if 4 * taps.len() > rows || !ends_hold_little(&record.output, reach) {
        return None;
    }
    // The input on the output's grid, as far as it is known.
    let [first_s, last_s] =
        [record.input.knots_s.first()?, record.input.knots_s.last()?].map(|end| end - record.time_s[0]);
    let before = (-first_s / interval_s + 1e-6) as usize;
    let after = ((last_s / interval_s + 1e-6) as usize + 1).saturating_sub(rows);
    let time = |k: usize| record.time_s[0] + (k as f64 - before as f64) * interval_s;
    let grid_s: Vec<f64> = (0..before + rows + after).map(time).collect();
    let input = sampled(&grid_s);
    let knots: Vec<usize> = (reach..grid_s.len().saturating_sub(reach)).step_by(input_stride).collect();
    let knots_s: Vec<f64> = knots.iter().map(|k| grid_s[*k]).collect();
    let smooth: Vec<f64> = knots.iter().map(|k| filtered(&input, *k, &taps)).collect();
    // What was kept free for a delay at the end stays free; at the beginning both grids lose the same.
    let known_to_s = *knots_s.last()? - (last_s - (record.time_s[rows - 1] - record.time_s[0]));
    let kept: Vec<usize> =
        (reach..rows - reach).step_by(stride).filter(|row| record.time_s[*row] <= known_to_s).collect();
    if knots.len() < 64 || kept.len() < 64 {
        return None;
    }
    let mut coarse = ForcedRecord {
        input: PiecewiseCubic::new(&knots_s, &smooth, interpolation),
        time_s: kept.iter().map(|row| record.time_s[*row]).collect(),
        output: kept.iter().map(|row| filtered(&record.output, *row, &taps)).collect(),
        ..record.clone()
    };
    coarse.left_out.push(Rejected::Samples {
        recording: record.name.clone(),
        count: rows - kept.len(),
        first_s: record.time_s[0] + record.origin_s,
        last_s: record.time_s[rows - 1] + record.origin_s,
        reason: format!(
            "merged into {} samples per second by a filter that passes up to {:.3} Hz: neither input nor output has more than noise above {top_hz:.3} Hz",
            (rate_hz / stride as f64).round(),
            PASS * top_hz
        ),
    });
    Some(coarse)
}

/// The interval of even stamps, s.
fn even_interval(time_s: &[f64]) -> Option<f64> {
    let mean_s = (time_s.last()? - time_s.first()?) / (time_s.len().max(2) - 1) as f64;
    let even = time_s.windows(2).all(|pair| (pair[1] - pair[0] - mean_s).abs() < EVEN * mean_s);
    even.then_some(mean_s)
}

/// The frequency above which the input excites nothing and the output holds next to nothing, Hz.
fn band_end_hz(input: &[f64], output: &[f64], interval_s: f64, excited: f64) -> Option<f64> {
    let spectra = CrossSpectra::welch(input, output, interval_s, output.len() / SEGMENTS, Window::Hann);
    let top = spectra.input.iter().skip(2).fold(0.0_f64, |top, value| top.max(*value));
    let last_excited = spectra.input.iter().rposition(|value| *value >= excited * top)?;
    let power: f64 = spectra.output.iter().skip(2).sum();
    let mut below = 0.0;
    let last_heard = spectra.output.iter().skip(2).position(|value| {
        below += value;
        below >= POWER * power
    })? + 2;
    Some(spectra.frequency_hz[last_excited.max(last_heard)])
}

/// A symmetric low-pass filter of unit gain at zero frequency.
fn filter(top_hz: f64, interval_s: f64) -> Vec<f64> {
    let cut_off = 0.5 * (PASS + STOP) * top_hz * interval_s;
    let half = (0.5 * FLANK / ((STOP - PASS) * top_hz * interval_s)).ceil() as i64;
    let tap = |k: i64| {
        let sinc = if k == 0 { 2.0 * cut_off } else { (TAU * cut_off * k as f64).sin() / (PI * k as f64) };
        let place = PI * k as f64 / (half + 1) as f64;
        sinc * (0.42 + 0.5 * place.cos() + 0.08 * (2.0 * place).cos())
    };
    let taps: Vec<f64> = (-half..=half).map(tap).collect();
    let gain: f64 = taps.iter().sum();
    taps.into_iter().map(|tap| tap / gain).collect()
}

/// The filter's output around a row that is at least half its length from both ends.
fn filtered(values: &[f64], row: usize, taps: &[f64]) -> f64 {
    let from = row - taps.len() / 2;
    crate::tall::dot(&values[from..from + taps.len()], taps)
}

fn ends_hold_little(output: &[f64], reach: usize) -> bool {
    let mean = output.iter().sum::<f64>() / output.len() as f64;
    let energy = |some: &[f64]| some.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    let ends = energy(&output[..reach]) + energy(&output[output.len() - reach..]);
    let share_of_time = 2.0 * reach as f64 / output.len() as f64;
    ends <= (ENDS + 2.0 * share_of_time) * energy(output)
}
