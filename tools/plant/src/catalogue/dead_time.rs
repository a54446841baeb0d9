//! A delay before the drive.

use std::collections::VecDeque;

use super::law::{Action, Given, Law, ParameterSpec, Place, SignalLaw};
use super::trial::{Sizes, Trial};

/// `dead_time`.
pub struct DeadTime;

impl Law for DeadTime {
    fn id(&self) -> &'static str {
        "dead_time"
    }

    fn sentence(&self) -> &'static str {
        "The drive does at t what it was told at t - delay: phase that falls in proportion to frequency, amplitudes unchanged."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::size("delay", "s", "the delay")];
        PARAMETERS
    }

    fn is_late(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("delay", 1e-3)]
    }

    fn ranges(&self, _: &Sizes<'_>) -> Vec<(&'static str, f64, f64)> {
        vec![("delay", -0.1, 0.1)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Signal(Box::new(Late::new(given.get("delay"))))
    }
}

/// The signal some time ago; before its first sample it stood still.
pub(crate) struct Late {
    delay_s: f64,
    past: VecDeque<(f64, f64)>,
}

impl Late {
    pub(crate) fn new(delay_s: f64) -> Self {
        Self { delay_s, past: VecDeque::new() }
    }
}

impl SignalLaw for Late {
    fn pass(&mut self, time_s: f64, value: f64) -> f64 {
        self.past.push_back((time_s, value));
        let wanted_s = time_s - self.delay_s;
        while self.past.len() > 2 && self.past.get(1).is_some_and(|(next_s, _)| *next_s <= wanted_s) {
            self.past.pop_front();
        }
        match (self.past.front(), self.past.get(1)) {
            (Some(&(from_s, from)), Some(&(to_s, to))) if to_s > from_s => {
                from + (to - from) * ((wanted_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
            }
            (Some(&(_, from)), Some(&(to_s, to))) => {
                if wanted_s >= to_s {
                    to
                } else {
                    from
                }
            }
            _ => value,
        }
    }
}
