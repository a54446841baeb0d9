//! What the classical methods say of the fitted modes, and how far each can be trusted on this very record.
//!
//! None of these methods knows its own error: leakage and noise bias them, and the scatter over model orders
//! sees neither. So every method is run a second time on a *replica*, the fitted record plus the residuals in
//! reverse order, which has the fitted modes exactly, the same input and noise of the same spectrum. What the
//! method gets wrong there is the standard error it is given here, together with its scatter. It then
//! disagrees with the fit only where the record holds something that the fitted modes and noise do not.

use crate::poles::{MethodMode, Survey};
use crate::result::{CrossCheck, Estimate, IdentifiedMode, Rejected};

/// Share of its frequency, and damping ratios, within which a method's mode is taken for the fitted one.
const SAME: (f64, f64) = (0.05, 3.0);

/// The survey of a record and of its replica.
pub(crate) struct Opinions {
    pub(crate) record: Survey,
    pub(crate) replica: Survey,
}

/// The fitted output with the residuals in reverse order.
pub(crate) fn replica(output: &[f64], residuals: &[f64]) -> Vec<f64> {
    let fitted = output.iter().zip(residuals).map(|(y, e)| y - e);
    fitted.zip(residuals.iter().rev()).map(|(fitted, e)| fitted + e).collect()
}

impl Opinions {
    /// One cross-check per method that sees the mode.
    pub(crate) fn of(&self, mode: &IdentifiedMode) -> Vec<CrossCheck> {
        let seen = nearest(&self.record, mode);
        let again = nearest(&self.replica, mode);
        let checks = seen.into_iter().map(|seen| {
            let twin = again.iter().find(|twin| twin.method == seen.method);
            let estimate = |value: f64, own: Option<f64>, fitted: f64, there: Option<f64>| Estimate {
                value,
                stderr: there.map_or(f64::INFINITY, |there| own.unwrap_or(0.0).hypot(there - fitted)),
            };
            CrossCheck {
                method: seen.method.name().to_owned(),
                frequency_hz: Some(estimate(
                    seen.frequency_hz,
                    seen.frequency_stderr_hz,
                    mode.frequency_hz.value,
                    twin.map(|twin| twin.frequency_hz),
                )),
                damping_ratio: Some(estimate(
                    seen.damping_ratio,
                    seen.damping_stderr,
                    mode.damping_ratio.value,
                    twin.map(|twin| twin.damping_ratio),
                )),
            }
        });
        checks.collect()
    }

    /// Modes that a method picks and the fit does not have, and groups of poles that are no picks, with the
    /// reasons.
    pub(crate) fn rejected(&self, modes: &[IdentifiedMode]) -> Vec<Rejected> {
        let is_fitted = |hz: f64| modes.iter().any(|mode| is_same(hz, mode));
        let picked = self.record.modes.iter().filter(|seen| !is_fitted(seen.frequency_hz)).map(|seen| {
            Rejected::Pole {
                frequency_hz: seen.frequency_hz,
                damping_ratio: Some(seen.damping_ratio),
                reason: format!("{} sees it; the fit of the record does without it", seen.method.words()),
            }
        });
        let unstable = self.record.charts.iter().flat_map(|chart| {
            let groups = chart.rejected.iter().filter(|group| !is_fitted(group.frequency_hz));
            groups.map(|group| Rejected::Pole {
                frequency_hz: group.frequency_hz,
                damping_ratio: Some(group.damping_ratio),
                reason: format!("{}: {}", chart.method.words(), group.reason),
            })
        });
        let mut all: Vec<Rejected> = picked.chain(unstable).collect();
        all.sort_by(|a, b| {
            let hz = |entry: &Rejected| entry.frequency_hz().unwrap_or(0.0);
            hz(a).total_cmp(&hz(b))
        });
        all
    }
}

fn is_same(frequency_hz: f64, mode: &IdentifiedMode) -> bool {
    let reach = SAME.0.max(SAME.1 * mode.damping_ratio.value);
    (frequency_hz / mode.frequency_hz.value).ln().abs() < reach
}

/// Of every method the mode nearest to a fitted one.
fn nearest<'s>(survey: &'s Survey, mode: &IdentifiedMode) -> Vec<&'s MethodMode> {
    let away = |seen: &MethodMode| (seen.frequency_hz / mode.frequency_hz.value).ln().abs();
    let mut found: Vec<&MethodMode> = Vec::new();
    for seen in survey.modes.iter().filter(|seen| is_same(seen.frequency_hz, mode)) {
        match found.iter_mut().find(|known| known.method == seen.method) {
            Some(known) if away(seen) < away(known) => *known = seen,
            Some(_) => {}
            None => found.push(seen),
        }
    }
    found
}
