//! The logarithmic decrement of the free vibration after the unshaped move, eqs. 28 and 29.

use stillbeam_identify::{Estimate, FreeDecayOptions, damping_from_peaks, identify_free_decay};
use stillbeam_plant::TIP_DEFLECTION;
use stillbeam_recording::Recording;

use crate::base_move::BaseMove;
use crate::demo::rig::camera;
use crate::error::CliError;

/// Peaks that are used: the paper's two, and more.
pub const PEAKS: [usize; 4] = [2, 6, 11, 31];

/// Draws of the camera's noise.
pub const DRAWS: u64 = 200;

/// Seconds of free vibration.
const RECORD_S: f64 = 40.0;

/// The decrement from a number of peaks, over many draws of the camera's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecrementRow {
    /// Peaks used, the first and the last of them.
    pub peaks: usize,
    /// Mean damping ratio over the draws, periods counted right.
    pub mean: f64,
    /// Standard deviation over the draws.
    pub deviation: f64,
    /// The mean with eq. 29 as printed.
    pub as_printed: f64,
}

/// What the free vibration says of the damping.
#[derive(Clone, Debug, PartialEq)]
pub struct Decrement {
    /// Both modes together, as the camera sees them.
    pub both_modes: Vec<DecrementRow>,
    /// The first mode alone: what the decrement is meant for.
    pub first_alone: Vec<DecrementRow>,
    /// Damping ratios fitted to one draw of the record, lowest mode first.
    pub fitted: Vec<Estimate>,
    /// Free vibration of the tip, `(seconds since the setpoint came to rest, millimetres)`.
    pub tip: Vec<(f64, f64)>,
}

/// Takes the decrement after `unshaped`, whose modes are `true_modes` (frequency in hertz, damping ratio).
///
/// # Errors
/// [`CliError::Camera`], [`CliError::Identify`]; [`CliError::Internal`] when the vibration has no peaks.
pub fn run(unshaped: &BaseMove, true_modes: &[(f64, f64)]) -> Result<Decrement, CliError> {
    let rate_hz = unshaped.rate_hz;
    let start = unshaped.residual.end_tick;
    let samples = (RECORD_S * rate_hz) as usize;
    let tip_m: Vec<f64> = unshaped.tip_deflection_m.iter().skip(start).take(samples).copied().collect();
    let (Some(&(first_hz, first_damping)), Some(amplitude_m)) =
        (true_modes.first(), unshaped.residual.mode_amplitudes_m.first())
    else {
        return Err(CliError::Internal("a beam without modes".to_owned()));
    };
    let omega = std::f64::consts::TAU * first_hz;
    let damped = omega * (1.0 - first_damping * first_damping).sqrt();
    let alone_m: Vec<f64> = (0..samples)
        .map(|sample| sample as f64 / rate_hz)
        .map(|t| amplitude_m * (-first_damping * omega * t).exp() * (damped * t).sin())
        .collect();
    let frames = camera(rate_hz, 0).observe(rate_hz, &tip_m)?;
    let time_s = (0..samples).map(|sample| sample as f64 / rate_hz).collect();
    let record = Recording::new("free vibration", time_s).with_column(TIP_DEFLECTION, frames);
    let fitted = identify_free_decay(&record, &FreeDecayOptions::new(TIP_DEFLECTION).with_modes(2))?;
    Ok(Decrement {
        both_modes: rows(&tip_m, rate_hz, first_hz)?,
        first_alone: rows(&alone_m, rate_hz, first_hz)?,
        fitted: fitted.modes.iter().map(|mode| mode.damping_ratio).collect(),
        tip: (0..samples).map(|sample| (sample as f64 / rate_hz, 1e3 * tip_m[sample])).collect(),
    })
}

fn rows(tip_m: &[f64], rate_hz: f64, first_hz: f64) -> Result<Vec<DecrementRow>, CliError> {
    let no_peaks = || CliError::Internal("the free vibration does not decay from peak to peak".to_owned());
    let mut found = [const { Vec::new() }; PEAKS.len()];
    for seed in 0..DRAWS {
        let eye = camera(rate_hz, 1000 + seed);
        let frames: Vec<f64> =
            eye.observe(rate_hz, tip_m)?.into_iter().filter(|frame| !frame.is_nan()).collect();
        let heights = positive_peaks(&frames, eye.rate_hz / first_hz);
        for (ratios, count) in found.iter_mut().zip(PEAKS) {
            // A rising peak has no decrement; it counts as none.
            let peaks = heights.get(..count).ok_or_else(no_peaks)?;
            ratios.push(damping_from_peaks(peaks, 0.0).map_or(0.0, |ratio| ratio.value));
        }
    }
    let rows = PEAKS.into_iter().zip(found).map(|(peaks, ratios)| {
        let count = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / count;
        let square = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let as_printed = mean * (peaks - 1) as f64 / peaks as f64;
        DecrementRow { peaks, mean, deviation: square.sqrt(), as_printed }
    });
    Ok(rows.collect())
}

/// The highest frame of every period of the first mode, the first one within the first period.
fn positive_peaks(frames: &[f64], frames_per_period: f64) -> Vec<f64> {
    let highest = |from: f64| {
        let range = from.max(0.0) as usize..((from + frames_per_period) as usize).min(frames.len());
        frames.get(range.clone()).and_then(|_| range.max_by(|a, b| frames[*a].total_cmp(&frames[*b])))
    };
    let mut heights = Vec::new();
    let Some(mut place) = highest(0.0) else { return heights };
    while place as f64 + 1.5 * frames_per_period < frames.len() as f64 {
        heights.push(frames[place]);
        match highest(place as f64 + 0.5 * frames_per_period) {
            Some(next) => place = next,
            None => break,
        }
    }
    heights
}
