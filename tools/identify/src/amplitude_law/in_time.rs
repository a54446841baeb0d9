//! The rival of a mode that goes with its amplitude: one whose stiffness and damping change while the record
//! runs, at a moment or all the time.

use super::fit::{OneMode, moved};
use super::{Cause, Moment};
use crate::amplitude::MATTERS;
use crate::forced_model::{ForcedModel, pole};
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::Pole;
use crate::separable::Projected;

/// Relative changes of the stiffness that the search starts from, in damping ratios, and of the damping.
const STIFFNESS: [f64; 8] = [-0.5, 0.5, -1.5, 1.5, -5.0, 5.0, -15.0, 15.0];
const DAMPING: f64 = 1.0;
/// Shares of the change of which the linear mode may be the frequency.
const SEEN_AT: [f64; 2] = [0.3, 0.7];
/// Moments that the search starts from.
const MOMENTS: u32 = 10;
/// Width of a change at a moment, in periods of the mode.
const PERIODS: f64 = 1.0;

/// A mode that changes in time.
#[derive(Debug, Clone)]
pub(crate) struct InTime {
    /// Frequency and damping before and after.
    pub(crate) before: Pole,
    pub(crate) after: Pole,
    /// When the change happens, s; `None` where it goes on all the time, or in several records.
    pub(crate) at_s: Option<f64>,
    /// What it leaves of the record.
    pub(crate) sum_of_squares: f64,
}

impl InTime {
    /// Whether the change is large enough to matter.
    pub(super) fn matters(&self) -> bool {
        let [frequency, damping] = MATTERS;
        (self.after.frequency_hz / self.before.frequency_hz).ln().abs() > frequency
            || (self.after.damping_ratio / self.before.damping_ratio).ln().abs() > damping
    }
}

/// The mode with the change in time that leaves least; `None` where none can be fitted.
pub(crate) fn in_time(model: &ForcedModel<'_>, found: &Minimum<Projected>, mode: usize) -> Option<InTime> {
    let mut one = OneMode::new(model, found, mode)?;
    let own = pole(&found.parameters, mode);
    let total_s: f64 = model.records.iter().map(|record| record.duration_s()).sum();
    let changes: Vec<[f64; 2]> =
        STIFFNESS.into_iter().map(|k| [k * own.damping_ratio, 0.0]).chain([[0.0, DAMPING]]).collect();
    let starts: Vec<[f64; 4]> = changes
        .into_iter()
        .flat_map(|[k, d]| SEEN_AT.map(|seen| moved(own, [k * seen, d * seen], [k, d])))
        .collect();
    let throughout = Cause::Time(Moment::Throughout);
    let width = PERIODS / (own.frequency_hz * total_s);
    let around = Cause::Time(Moment::Around { moment: 0.5, width });
    let at = |moment: u32| {
        let moment = f64::from(moment) / f64::from(MOMENTS);
        starts.iter().map(move |[f, zeta, k, d]| [*f, *zeta, *k, *d, moment])
    };
    let moments = (1..MOMENTS).flat_map(at).collect();
    one.cause = throughout;
    let gradual = one.best(starts.clone());
    one.cause = around;
    let minimum = match (gradual, one.best(moments)) {
        (Some((sum, start)), sudden) if sudden.is_none_or(|sudden| sum < sudden.0) => {
            one.cause = throughout;
            one.fitted(start)
        }
        (_, sudden) => one.fitted(sudden?.1),
    }?;
    let course = one.course(&minimum.parameters);
    let at_s = match (course.cause, model.records) {
        (Cause::Time(Moment::Around { moment, .. }), [only]) => {
            Some(only.origin_s + only.time_s.first()? + moment * only.duration_s())
        }
        _ => None,
    };
    Some(InTime {
        before: course.at(0.0),
        after: course.at(1.0),
        at_s,
        sum_of_squares: minimum.sum_of_squares,
    })
}
