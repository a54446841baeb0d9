//! What modes beyond those of a model add to its outputs: to first order a share of what drives them.
//!
//! A mode far above what an excitation reaches, `q'' + 2zwq' + w²q = s`, follows it without delay: `q =
//! s/w²`. Where a force drives, or an acceleration, that is a share of the input; where a motion drives, of
//! its second derivative. Which share no model without those modes says, and the machine is as linear with
//! them as without.

use stillbeam_plant::Model;

use crate::record::Record;

/// Second derivatives are taken over this share of a period of the fastest motion of the model, so that the
/// noise of a measured motion stays small: they are then 1.3 % too small there.
const OF_A_PERIOD: f64 = 1.0 / 16.0;

/// The column at the record's stamps, of unit size; `None` where nothing drives the record, or not much.
pub(crate) fn remainder(record: &Record, model: &Model, fastest_hz: Option<f64>) -> Option<Vec<f64>> {
    let input = record.input.as_ref().filter(|_| !record.rerun.is_in_loop())?;
    let column = if model.input_is_motion() {
        let count = input.len();
        let rate_hz = (count - 1) as f64 / record.duration_s();
        let stride = fastest_hz.map_or(1.0, |fastest_hz| OF_A_PERIOD * rate_hz / fastest_hz);
        let stride = (stride.round().max(1.0) as usize).min(count / 4);
        // At the ends a motion is taken to stand still.
        let at = |k: usize, back: bool| {
            let place = if back { k.saturating_sub(stride) } else { (k + stride).min(count - 1) };
            input[place]
        };
        (0..count).map(|k| at(k, false) - 2.0 * input[k] + at(k, true)).collect()
    } else {
        input.clone()
    };
    let largest = column.iter().fold(0.0, |most: f64, value: &f64| most.max(value.abs()));
    (largest > 0.0).then(|| column.iter().map(|value| value / largest).collect())
}
