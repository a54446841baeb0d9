//! How many modes a function of frequency shows: all places that the starts name are fitted together, and
//! what explains too little, or is no mode, is taken out again.

use crate::MAX_MODES;
use crate::forced_model::{MAX_DAMPING, MIN_DAMPING, pole, pole_parameters};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::Pole;
use crate::result::Rejected;
use crate::separable::{Projected, Separable, fit, fit_roughly, sum_of_squares_at};

/// A model of modes, by their number.
pub(super) trait ModalModel: Separable + Clone {
    /// The same model with another number of modes.
    fn with_modes(&self, modes: usize) -> Self;
    fn modes(&self) -> usize;
    /// Free numbers that a mode brings.
    fn numbers_per_mode(&self) -> usize;
    /// First and last frequency, Hz.
    fn band_hz(&self) -> [f64; 2];
}

/// A model, its fit, and what was taken out of it.
pub(super) struct Chosen<M> {
    pub(super) model: M,
    pub(super) minimum: Minimum<Projected>,
    pub(super) rejected: Vec<Rejected>,
}

impl<M: ModalModel> Chosen<M> {
    pub(super) fn poles(&self) -> Vec<Pole> {
        (0..self.model.modes()).map(|mode| pole(&self.minimum.parameters, mode)).collect()
    }
}

/// What a mode must explain of what is left without it.
const SHARE_OF_A_MODE: f64 = 0.2;
/// Evidence that speaks for a mode.
const EVIDENCE: f64 = 10.0;
/// How far, as a ratio's logarithm, a frequency may move from its start.
const REACH: f64 = 0.2;
/// Damping ratio above which a peak is part of the background.
const MOST_DAMPED: f64 = 0.5;

/// The modes that the model needs; `None` where it cannot be evaluated. With a number asked for, the weakest
/// ones go.
pub(super) fn choose<M: ModalModel>(empty: M, starts: Vec<Pole>, asked: Option<usize>) -> Option<Chosen<M>> {
    let mut poles = starts;
    poles.truncate(2 * MAX_MODES);
    let mut minimum = fitted(&empty, &poles)?;
    let mut rejected = Vec::new();
    loop {
        let model = empty.with_modes(poles.len());
        poles = (0..poles.len()).map(|mode| pole(&minimum.parameters, mode)).collect();
        let Some((weakest, reason, without)) = weakest(&empty, &model, &minimum, &poles, asked) else {
            break;
        };
        let taken = poles.remove(weakest);
        rejected.push(Rejected::Pole {
            frequency_hz: taken.frequency_hz,
            damping_ratio: Some(taken.damping_ratio),
            reason,
        });
        minimum = without;
    }
    let model = empty.with_modes(poles.len());
    let minimum = fit(&model, &range(&poles))?;
    Some(Chosen { model, minimum, rejected })
}

fn fitted<M: ModalModel>(empty: &M, poles: &[Pole]) -> Option<Minimum<Projected>> {
    fit_roughly(&empty.with_modes(poles.len()), &range(poles))
}

fn range(poles: &[Pole]) -> Vec<Parameter> {
    poles.iter().flat_map(|pole| pole_parameters(*pole, REACH)).collect()
}

/// The mode that goes, why, and the fit without it; `None` where all stay.
fn weakest<M: ModalModel>(
    empty: &M,
    model: &M,
    minimum: &Minimum<Projected>,
    poles: &[Pole],
    asked: Option<usize>,
) -> Option<(usize, String, Minimum<Projected>)> {
    let without = |mode: usize| {
        let mut left = poles.to_vec();
        left.remove(mode);
        fitted(empty, &left)
    };
    if let Some((mode, reason)) = (0..poles.len()).find_map(|mode| Some((mode, no_mode(model, poles, mode)?)))
    {
        return Some((mode, reason, without(mode)?));
    }
    // The one that is missed least while the others stay where they are; they are fitted again without it.
    let missed = (0..poles.len()).filter_map(|mode| {
        let mut left = poles.to_vec();
        left.remove(mode);
        let start: Vec<f64> = range(&left).iter().map(|parameter| parameter.start).collect();
        Some((sum_of_squares_at(&empty.with_modes(left.len()), &start)?, mode))
    });
    let (_, mode) = missed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let left = without(mode)?;
    let (before, after) = (left.sum_of_squares, minimum.sum_of_squares.max(f64::MIN_POSITIVE));
    let rows = minimum.point.residuals.len() as f64;
    let evidence = rows * (before / after).ln() - model.numbers_per_mode() as f64 * rows.ln();
    let share = 1.0 - after / before.max(f64::MIN_POSITIVE);
    let weak = match asked {
        Some(asked) => poles.len() > asked,
        None => share < SHARE_OF_A_MODE || evidence < EVIDENCE || poles.len() > MAX_MODES,
    };
    weak.then(|| {
        let reason =
            format!("it explains {:.1} % of what the others leave, evidence {evidence:.0}", 100.0 * share);
        (mode, reason, left)
    })
}

/// Why a pole is no mode whatever it explains.
fn no_mode<M: ModalModel>(model: &M, poles: &[Pole], mode: usize) -> Option<String> {
    let one = poles[mode];
    let [low, high] = model.band_hz();
    if !(low..=high).contains(&one.frequency_hz) {
        return Some(format!("it lies outside the band of the spectrum, {low:.3} to {high:.3} Hz"));
    }
    if one.damping_ratio <= 1.01 * MIN_DAMPING {
        return Some("its damping ratio would be the limit of the search: a line, not a mode".to_owned());
    }
    if one.damping_ratio > MOST_DAMPED.min(MAX_DAMPING) {
        return Some("it is damped so much that it is background, not a mode".to_owned());
    }
    poles[..mode].iter().find_map(|other| {
        let away_hz = (one.lambda() - other.lambda()).norm() / std::f64::consts::TAU;
        let half_hz = (one.damping_ratio * one.frequency_hz).min(other.damping_ratio * other.frequency_hz);
        (away_hz < 0.1 * half_hz).then(|| format!("it is the mode at {:.4} Hz once more", other.frequency_hz))
    })
}
