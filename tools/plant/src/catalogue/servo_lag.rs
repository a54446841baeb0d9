//! A first-order lag.

use super::law::{Action, Given, Law, ParameterSpec, Place, SignalLaw};
use super::trial::{Sizes, Trial};

/// `servo_lag`.
pub struct ServoLag;

impl Law for ServoLag {
    fn id(&self) -> &'static str {
        "servo_lag"
    }

    fn sentence(&self) -> &'static str {
        "The drive follows its input late and weakened towards high frequencies, as a first-order lag: phase and amplitude fall together."
    }

    fn places(&self) -> &'static [Place] {
        &[Place::Drive]
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[ParameterSpec::size("time_constant", "s", "of the lag")];
        PARAMETERS
    }

    fn is_late(&self) -> bool {
        true
    }

    fn trials(&self, _: &Sizes<'_>) -> Vec<Trial> {
        vec![Trial::of("time_constant", 1e-3)]
    }

    fn action(&self, given: &Given<'_>) -> Action {
        Action::Signal(Box::new(Lag { time_constant_s: given.get("time_constant"), before: None }))
    }
}

struct Lag {
    time_constant_s: f64,
    /// Time, value that came in and value that went out.
    before: Option<(f64, f64, f64)>,
}

impl SignalLaw for Lag {
    fn pass(&mut self, time_s: f64, value: f64) -> f64 {
        let out = match self.before {
            Some((before_s, from, out)) if time_s > before_s && self.time_constant_s > 0.0 => {
                // Exact for a straight line: out' = (in − out) / T.
                let x = (time_s - before_s) / self.time_constant_s;
                let late = (value - from) / x;
                value - late - (from - late - out) * (-x).exp()
            }
            Some((_, _, out)) if self.time_constant_s > 0.0 => out,
            _ => value,
        };
        self.before = Some((time_s, value, out));
        out
    }
}
