//! What modes beyond those of a model add to its outputs: a share of what drives them, and of its
//! derivatives.
//!
//! A mode far above what an excitation reaches, `q'' + 2zwq' + w²q = s`, follows it nearly without delay:
//! `q = s/w² - 2z s'/w³ - s''/w⁴` and smaller terms. Where a force drives, or an acceleration, `s` is the
//! input; where a motion drives, its second derivative; a beam's modes are driven by the acceleration of its
//! base, whatever moves that. Which share of each no model without those modes says, and the machine is as
//! linear with them as without.

use std::f64::consts::TAU;

use stillbeam_plant::{BeamSignal, Model, StateSpace};

use crate::record::Record;

/// Second derivatives are taken over this share of a period of the fastest motion of the model, so that the
/// noise of a measured motion stays small: they are then 1.3 % too small there.
const OF_A_PERIOD: f64 = 1.0 / 16.0;

/// The columns at the record's stamps, of unit size: what drives, its first and its second derivative. `None`
/// where nothing drives the record, or not much.
pub(crate) fn remainder(record: &Record, model: &Model, fastest_hz: Option<f64>) -> Option<Vec<Vec<f64>>> {
    let stride = stride(record, fastest_hz);
    let drive = drive(record, model, stride)?;
    let columns = [difference(&drive, stride), second_difference(&drive, stride)];
    std::iter::once(drive).chain(columns).map(of_unit_size).collect()
}

/// The columns that every mode of a refitted `model` adds to those of [`remainder`]: what it does under what
/// drives.
pub(crate) fn shares(record: &Record, model: &Model, fastest_hz: Option<f64>) -> Option<Vec<Vec<f64>>> {
    let drive = drive(record, model, stride(record, fastest_hz))?;
    let modes = StateSpace::new(model).ok()?.natural_modes().ok()?;
    let ringing = modes.into_iter().filter(|(hz, ratio)| *hz > 0.0 && (0.0..1.0).contains(ratio));
    let columns = ringing.map(|(hz, ratio)| of_unit_size(driven(hz, ratio, &record.time_s, &drive)));
    columns.collect()
}

/// What drives the modes, at the record's stamps, to any scale.
fn drive(record: &Record, model: &Model, stride: usize) -> Option<Vec<f64>> {
    let input = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
    let drive = if model.input_is_motion() || matches!(model, Model::BeamOnBase(_)) {
        let moved = base_motion(record, model)?.unwrap_or_else(|| input.clone());
        second_difference(&moved, stride)
    } else {
        input.clone()
    };
    Some(drive)
}

/// A mode `q'' + 2zwq' + w²q = s` at the stamps, from rest; `s` goes in straight lines from stamp to stamp,
/// along which `q = s/w² - 2z s'/w³` is the motion that rings nowhere.
fn driven(frequency_hz: f64, damping_ratio: f64, time_s: &[f64], drive: &[f64]) -> Vec<f64> {
    let omega = TAU * frequency_hz;
    let decay_per_s = damping_ratio * omega;
    let damped = omega * (1.0 - damping_ratio * damping_ratio).sqrt();
    let (mut q, mut v) = (0.0, 0.0);
    let mut found = vec![0.0];
    for (time, s) in time_s.windows(2).zip(drive.windows(2)) {
        let step_s = time[1] - time[0];
        let slope = (s[1] - s[0]) / step_s;
        let smooth = |s: f64| s / omega.powi(2) - 2.0 * damping_ratio * slope / omega.powi(3);
        let smooth_v = slope / omega.powi(2);
        let (x, w) = (q - smooth(s[0]), v - smooth_v);
        let (sine, cosine) = (damped * step_s).sin_cos();
        let fallen = (-decay_per_s * step_s).exp();
        q = smooth(s[1]) + fallen * (x * cosine + (w + decay_per_s * x) / damped * sine);
        v = smooth_v + fallen * (w * cosine - (decay_per_s * w + omega * omega * x) / damped * sine);
        found.push(q);
    }
    found
}

fn of_unit_size(column: Vec<f64>) -> Option<Vec<f64>> {
    let largest = column.iter().fold(0.0, |most: f64, value: &f64| most.max(value.abs()));
    (largest > 0.0).then(|| column.iter().map(|value| value / largest).collect())
}

/// What the base of a beam does at the record's stamps, whatever pushes or tells it: a servo follows late,
/// and under a force the beam pulls at it. `Some(None)` for a model whose input is the motion itself.
fn base_motion(record: &Record, model: &Model) -> Option<Option<Vec<f64>>> {
    let Model::BeamOnBase(beam) = model else { return Some(None) };
    if model.input_is_behind_the_drive() {
        return Some(None);
    }
    let mut base = beam.clone();
    base.outputs = vec![BeamSignal::BasePosition];
    base.setup.physics.clear();
    let beam = Model::BeamOnBase(base);
    let outputs = record.rerun.outputs(&beam, Some(record.sub_steps.lengths(&beam))).ok()?;
    Some(Some(outputs.into_iter().next()?))
}

/// Samples over which derivatives are taken.
fn stride(record: &Record, fastest_hz: Option<f64>) -> usize {
    let count = record.time_s.len();
    let rate_hz = (count - 1) as f64 / record.duration_s();
    let stride = fastest_hz.map_or(1.0, |fastest_hz| OF_A_PERIOD * rate_hz / fastest_hz);
    (stride.round().max(1.0) as usize).min(count / 4)
}

/// Values so many samples before and after every one; at the ends a signal is taken to stand still.
fn around(signal: &[f64], stride: usize) -> impl Iterator<Item = [f64; 3]> {
    let last = signal.len().saturating_sub(1);
    (0..signal.len())
        .map(move |k| [signal[k.saturating_sub(stride)], signal[k], signal[(k + stride).min(last)]])
}

/// In proportion to the derivative.
fn difference(signal: &[f64], stride: usize) -> Vec<f64> {
    around(signal, stride).map(|[before, _, after]| after - before).collect()
}

/// In proportion to the second derivative.
fn second_difference(signal: &[f64], stride: usize) -> Vec<f64> {
    around(signal, stride).map(|[before, here, after]| before - 2.0 * here + after).collect()
}
