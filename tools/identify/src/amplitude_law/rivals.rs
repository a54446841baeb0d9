//! What changes a mode within a record: its amplitude, the time, or the recorder's clock. All explain the
//! same record, and what explains it clearly best is told; where two do about alike, that they do.

use super::{Dependence, InTime};
use crate::time_shifts::ClockJumps;

/// Share of what the best explanation explains from which another one does about as well, unless it leaves
/// more than so many times what the best one leaves.
const ALIKE: f64 = 0.9;
const LEAVES_MORE: f64 = 1.5;

/// What changes a mode, as far as the record can tell.
pub(crate) enum Change {
    /// The amplitude.
    WithAmplitude(Box<Dependence>),
    /// The time.
    InTime(InTime),
    /// Nothing: the recorder lost or doubled samples.
    Clock,
    /// The amplitude or something else.
    Unclear(Box<Dependence>),
}

/// The explanation that explains clearly most of a sum of squares, and how much it explains.
pub(crate) fn judged(
    before: f64,
    amplitude: Option<Dependence>,
    time: Option<InTime>,
    clock: &ClockJumps,
) -> Option<(Change, f64)> {
    let gain = |sum: Option<f64>| sum.map_or(0.0, |sum| before - sum);
    let of_amplitude = gain(amplitude.as_ref().map(|one| one.sum_of_squares));
    let of_time = gain(time.as_ref().map(|one| one.sum_of_squares));
    let of_clock = gain(clock.sum_of_squares);
    let is_alike = |gain: f64, than: f64| {
        gain > 0.0 && gain >= ALIKE * than && before - gain <= LEAVES_MORE * (before - than)
    };
    // Lost samples are whole intervals and explain what nothing else does.
    if clock.are_whole && of_clock > 0.0 && !is_alike(of_amplitude.max(of_time), of_clock) {
        return Some((Change::Clock, of_clock));
    }
    // A clock that jumps by parts of an interval is a change in time, too.
    if of_time > of_amplitude && !is_alike(of_amplitude, of_time) {
        return time.filter(InTime::matters).map(|time| (Change::InTime(time), of_time));
    }
    let one = amplitude?;
    if is_alike(of_time, of_amplitude) || is_alike(of_clock, of_amplitude) {
        return Some((Change::Unclear(Box::new(Dependence { is_unclear: true, ..one })), of_amplitude));
    }
    Some((Change::WithAmplitude(Box::new(one)), of_amplitude))
}
