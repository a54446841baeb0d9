//! Where a machine that was moved comes to ring freely about its new place.
//!
//! What rings freely about a level is foreseen by an autoregression of its end; what is held elsewhere, or
//! moved, is not, since the level enters the prediction. The last instant that is not foreseen is the end of
//! the move.

use super::{median, rms};
use crate::narrow_band::WholeSpectrum;
use crate::poles::decimated;

use super::knocks::{Autoregression, ORDER};

/// Samples per period of the loudest frequency at which the record is looked at.
const PER_PERIOD: f64 = 8.0;
/// Share of the record, from its end, that shows where it ends up and how it rings there.
const END: f64 = 0.25;
/// Samples of that end that tell an autoregression, at least.
const FEWEST: usize = 3 * ORDER;
/// Share of the record, from its beginning, that shows where it began, and periods of it at most.
const BEGINNING: f64 = 0.05;
const QUARTER: f64 = 0.25;
/// Periods that it rings for after the move at least.
const RINGS: f64 = 4.0;
/// Usual errors of the prediction beyond which an instant is not foreseen.
const UNFORESEEN: f64 = 6.7;
/// Share of the loudest ringing that lies between the two places at least: a structure that was let go or
/// pushed rings from one place to the other, one that was moved slowly rings less.
const APART: f64 = 0.9;
/// Share of that distance by which it may move about the first place while it is held there.
const HELD: f64 = 0.25;

/// The row from which a signal rings freely about another place than it began at.
pub(super) fn rings_from(signal: &[f64], interval_s: f64) -> Option<usize> {
    let rows = signal.len();
    let end = &signal[rows - (END * rows as f64) as usize..];
    let level = end.iter().sum::<f64>() / end.len().max(1) as f64;
    let loudest_hz = WholeSpectrum::new(&super::without_trend(end), interval_s).strongest_hz()?;
    let period_s = 1.0 / loudest_hz;
    if RINGS * period_s > rows as f64 * interval_s {
        return None;
    }
    let about: Vec<f64> = signal.iter().map(|y| y - level).collect();
    let (mut slow, step_s) = decimated(&about, interval_s, PER_PERIOD * loudest_hz);
    // Thinning takes the mean out; the prediction is to know the level.
    let mean = about.iter().sum::<f64>() / rows as f64;
    slow.iter_mut().for_each(|y| *y += mean);
    let from_end = slow.len().checked_sub(((END * slow.len() as f64) as usize).max(FEWEST))?;
    let autoregression = Autoregression::of(slow.get(from_end..)?)?;
    let errors = autoregression.errors(&slow);
    let usual =
        (median(errors.iter().skip(from_end).map(|e| e.abs()).collect()) / 0.6745).max(1e-9 * rms(&slow));
    let last = errors.iter().rposition(|error| error.abs() > UNFORESEEN * usual)?;
    let ringing = slow.get(last + ORDER + 1..)?;
    let lasts_s = ringing.len() as f64 * step_s;
    let first_rows = ((BEGINNING * rows as f64) as usize).min((QUARTER * period_s / interval_s) as usize);
    let beginning = &about[..first_rows + 1];
    let place = median(beginning.to_vec());
    let apart = place.abs();
    let was_held = rms(&beginning.iter().map(|y| y - place).collect::<Vec<f64>>()) < HELD * apart;
    let loudest = ringing.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
    let moved = lasts_s > RINGS * period_s && was_held && apart > APART * loudest;
    moved.then(|| (((last + ORDER + 1) as f64 * step_s / interval_s).ceil() as usize).min(rows))
}
