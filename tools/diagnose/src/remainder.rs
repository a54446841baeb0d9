//! What modes beyond those of a model add to its outputs: a share of what drives them, and of its
//! derivatives.
//!
//! A mode far above what an excitation reaches, `q'' + 2zwq' + w²q = s`, follows it nearly without delay:
//! `q = s/w² - 2z s'/w³ - s''/w⁴` and smaller terms. Where a force drives, or an acceleration, `s` is the
//! input; where a motion drives, its second derivative; a beam's modes are driven by the acceleration of its
//! base, whatever moves that. Which share of each no model without those modes says, and the machine is as
//! linear with them as without.

use stillbeam_plant::{BeamSignal, Model};

use crate::record::Record;

/// Second derivatives are taken over this share of a period of the fastest motion of the model, so that the
/// noise of a measured motion stays small: they are then 1.3 % too small there.
const OF_A_PERIOD: f64 = 1.0 / 16.0;

/// The columns at the record's stamps, of unit size: what drives, its first and its second derivative. `None`
/// where nothing drives the record, or not much.
pub(crate) fn remainder(record: &Record, model: &Model, fastest_hz: Option<f64>) -> Option<Vec<Vec<f64>>> {
    let input = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
    let stride = stride(record, fastest_hz);
    let drive = if model.input_is_motion() || matches!(model, Model::BeamOnBase(_)) {
        let moved = base_motion(record, model)?.unwrap_or_else(|| input.clone());
        second_difference(&moved, stride)
    } else {
        input.clone()
    };
    let columns = [difference(&drive, stride), second_difference(&drive, stride)];
    std::iter::once(drive).chain(columns).map(of_unit_size).collect()
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
    let outputs = record.rerun.outputs(&Model::BeamOnBase(base), Some(record.longest_step_s)).ok()?;
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
