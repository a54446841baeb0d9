//! What outputs of a modal model have beside modes in phase: the rest of what a matrix or a transfer function
//! says.

use super::invalid::{InvalidParameter, Problem, finite, positive};
use super::modal::ModalModel;

/// A real pole, `p' + p / time constant = s(t)`; an output of whatever quantity has its participation times
/// `p`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lag {
    /// Time by which it falls by e, s, above 0.
    pub time_constant_s: f64,
    /// One per output.
    pub participation: Vec<f64>,
}

/// A free motion, `r'' = s(t)`: poles at zero. An output of whatever quantity has `displacement` times `r`
/// and `velocity` times `r'`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigid {
    /// What the outputs have of `r`, one per output.
    pub displacement: Vec<f64>,
    /// What they have of `r'`, one per output.
    pub velocity: Vec<f64>,
}

/// All that outputs have beside their modes' participations; empty by default. Only where the input is a
/// force.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Beside {
    /// What the outputs have of the modes a quarter of a period off: of `q'` in a position or an
    /// acceleration, of `q` in a velocity. For every mode one per output; empty where there is none.
    pub quadrature: Vec<Vec<f64>>,
    /// Real poles.
    pub lags: Vec<Lag>,
    /// Poles at zero.
    pub rigid: Option<Rigid>,
    /// What the outputs have of the input times its gain at once, one per output; empty where there is none.
    pub feedthrough: Vec<f64>,
}

impl Beside {
    /// Whether there is nothing of all this.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What an output has of a mode a quarter of a period off; both count from 0.
    pub(crate) fn quadrature_of(&self, mode: usize, output: usize) -> f64 {
        self.quadrature.get(mode).and_then(|shares| shares.get(output)).copied().unwrap_or(0.0)
    }

    /// What an output has of the input at once; outputs count from 0.
    pub(crate) fn feedthrough_of(&self, output: usize) -> f64 {
        self.feedthrough.get(output).copied().unwrap_or(0.0)
    }

    /// Visits all numbers that are not zero: path, whether it is a time constant, place.
    pub(crate) fn visit(&mut self, visit: &mut dyn FnMut(String, bool, &mut f64)) {
        let mut shares = |path: String, list: &mut [f64]| {
            for (output, value) in (1..).zip(list).filter(|(_, value)| **value != 0.0) {
                visit(format!("{path}.{output}"), false, value);
            }
        };
        for (number, list) in (1..).zip(&mut self.quadrature) {
            shares(format!("mode.{number}.quadrature"), list);
        }
        for (number, lag) in (1..).zip(&mut self.lags) {
            shares(format!("lag.{number}.participation"), &mut lag.participation);
        }
        if let Some(rigid) = &mut self.rigid {
            shares("rigid.displacement".to_owned(), &mut rigid.displacement);
            shares("rigid.velocity".to_owned(), &mut rigid.velocity);
        }
        for (number, lag) in (1..).zip(&mut self.lags) {
            visit(format!("lag.{number}.time_constant_s"), true, &mut lag.time_constant_s);
        }
        for (number, value) in (1..).zip(&mut self.feedthrough).filter(|(_, value)| **value != 0.0) {
            visit(format!("output.{number}.feedthrough"), false, value);
        }
    }

    /// Paths that `[fixed]` may name.
    pub(crate) fn paths(&self) -> Vec<String> {
        let mut paths = Vec::new();
        self.clone().visit(&mut |path, is_time, _| {
            let whole = if is_time { path.clone() } else { trimmed(&path) };
            if paths.last() != Some(&whole) {
                paths.push(whole);
            }
        });
        paths
    }

    /// Checks everything against the model that it belongs to.
    pub(crate) fn check(&self, model: &ModalModel) -> Result<(), InvalidParameter> {
        if self.is_empty() {
            return Ok(());
        }
        let is_motion = model.input.as_ref().is_some_and(super::Input::is_motion);
        if is_motion || model.real_pole.is_some() {
            let (key, _) = self.lists().into_iter().next().unwrap_or_default();
            return Err(InvalidParameter::new(key, Problem::BesidePlace));
        }
        for (number, lag) in (1..).zip(&self.lags) {
            positive(format!("lag.{number}.time_constant_s"), lag.time_constant_s)?;
        }
        let outputs = model.outputs.len();
        for (key, list) in self.lists() {
            let found = list.len();
            if found != outputs {
                return Err(InvalidParameter::new(key, Problem::ParticipationCount { outputs, found }));
            }
            list.iter().try_for_each(|&value| finite(key.clone(), value))?;
        }
        Ok(())
    }

    /// Every list of one number per output, by path.
    fn lists(&self) -> Vec<(String, &[f64])> {
        let mut lists: Vec<(String, &[f64])> = Vec::new();
        let quadrature = (1..).zip(&self.quadrature);
        lists.extend(quadrature.map(|(n, list)| (format!("mode.{n}.quadrature"), list.as_slice())));
        let lags = (1..).zip(&self.lags);
        lists.extend(lags.map(|(n, lag)| (format!("lag.{n}.participation"), lag.participation.as_slice())));
        if let Some(rigid) = &self.rigid {
            lists.push(("rigid.displacement".to_owned(), &rigid.displacement));
            lists.push(("rigid.velocity".to_owned(), &rigid.velocity));
        }
        if !self.feedthrough.is_empty() {
            lists.push(("output.feedthrough".to_owned(), &self.feedthrough));
        }
        lists
    }
}

/// A path without the number of the output that ends it.
fn trimmed(path: &str) -> String {
    match path.rsplit_once('.') {
        Some((list, end)) if end.parse::<usize>().is_ok() => list.to_owned(),
        _ => path.to_owned(),
    }
}
