//! How many modes, and whether a delay, a direct share and a real pole: every step is judged and kept on
//! record.
//!
//! Modes are added one by one, each started where what is left responds most to the input; after every mode
//! the delay and the direct share are tried, and of a force a real pole, because without them further modes
//! would stand in for them; at the end whatever has become unnecessary is taken out again. A mode that is
//! refused for what it is hides no other: the search goes on beside it.

mod changing_modes;

use changing_modes::StandsIn;

use crate::amplitude_law::{Dependence, InTime};
use crate::error::IdentifyError;
use crate::forced_fit::{ForcedOptions, MAX_MODES};
use crate::forced_model::{ForcedModel, MAX_DAMPING, pole};
use crate::forced_record::ForcedRecord;
use crate::forced_start::{Starts, is_refused, refused_band_hz};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::{InputKind, OutputQuantity, Pole};
use crate::mode_gates::{NotLinear, held_out_sum, is_confirmed, refusal_of_last, refusal_within};
use crate::result::{ModelStep, Rejected};
use crate::separable::{Projected, fit, fit_covariance, fit_roughly, sum_of_squares_at};

/// A model and its fit, and how it came to be chosen.
pub(crate) struct Chosen<'r> {
    pub(crate) model: ForcedModel<'r>,
    pub(crate) minimum: Minimum<Projected>,
    pub(crate) steps: Vec<ModelStep>,
    pub(crate) rejected: Vec<Rejected>,
    /// Where one mode does not explain what the structure does, and no second one may.
    pub(crate) not_linear: Vec<NotLinear>,
    /// Modes that change while the records run, by their place in the fit.
    pub(crate) in_time: Vec<InTime>,
    /// Modes that were found to go with their amplitude; the records are without what that makes of them.
    pub(crate) dependences: Vec<Dependence>,
    /// One more of them, or a better one in place of one of them, with which the choice has to begin anew.
    pub(crate) new_dependence: Option<(Option<usize>, Dependence)>,
    /// Whether any may be looked for.
    looks_for_more: bool,
    /// What was done to the records.
    pub(crate) remarks: Vec<Rejected>,
}

/// Whether a further mode was added.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Added {
    Yes,
    /// Nothing is left that a mode would explain.
    NothingLeft,
    /// What was found in this band, Hz, is no mode; others may be.
    NotThere([f64; 2]),
    /// It would stand in for a mode that goes with its amplitude.
    GoesWithAmplitude,
}

/// Refusals in a row after which the search ends.
const REFUSALS: usize = 3;

/// What a further mode must explain of the sum of squares.
const SHARE_OF_A_MODE: f64 = 0.05;
/// What a delay or a direct share must explain of it.
const SHARE_OF_A_DETAIL: f64 = 0.02;
/// A mode without which this many times as much is left needs no confirmation.
const CERTAIN: f64 = 50.0;
/// Residuals 80 dB below the output are what interpolating the input between its samples leaves, not modes.
const EXPLAINED: f64 = 1e-4;

/// Chooses and fits the model.
pub(crate) fn choose<'r>(
    records: &'r [ForcedRecord],
    starts: &Starts,
    options: &ForcedOptions,
    (dependences, looks_for_more): (Vec<Dependence>, bool),
) -> Result<Chosen<'r>, IdentifyError> {
    let model = ForcedModel {
        records,
        modes: 0,
        delay: false,
        max_delay_s: options.max_delay_s,
        direct: false,
        real_pole: false,
    };
    let (recording, column) = (names(records), records[0].output_column.clone());
    let minimum = fit_roughly(&model, &[]).ok_or_else(|| IdentifyError::NotComputable {
        recording: recording.clone(),
        column: column.clone(),
    })?;
    let mut chosen = Chosen {
        dependences,
        looks_for_more: looks_for_more && records.iter().all(|record| !record.quieted),
        ..Chosen::new(model, minimum)
    };
    let mut refused_hz = Vec::new();
    while chosen.model.modes < options.modes.unwrap_or(MAX_MODES) && !chosen.is_explained() {
        match chosen.add_mode(starts, options.modes.is_some(), &refused_hz) {
            Added::Yes if chosen.is_explained() => {}
            Added::Yes => chosen.try_details(starts),
            Added::NotThere(band_hz) if refused_hz.len() < REFUSALS => refused_hz.push(band_hz),
            Added::NotThere(_) | Added::NothingLeft => break,
            Added::GoesWithAmplitude => return Ok(chosen),
        }
    }
    chosen.drop_idle_details(starts);
    chosen.finish();
    if options.modes.is_none() && chosen.prune() {
        chosen.finish();
    }
    chosen.new_dependence = chosen.dependence_that_matters();
    if chosen.new_dependence.is_none() {
        chosen.settle();
    }
    let found = chosen.model.modes;
    match options.modes {
        Some(requested) if found < requested => Err(IdentifyError::TooFewPeaks {
            recording,
            column,
            requested,
            found,
            frequencies_hz: chosen.poles().iter().map(|pole| pole.frequency_hz).collect(),
        }),
        None if found == 0 => Err(IdentifyError::NoPeaks { recording, column }),
        _ => Ok(chosen),
    }
}

/// The recordings' names in one.
pub(crate) fn names(records: &[ForcedRecord]) -> String {
    records.iter().map(|record| record.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Schwarz's criterion: how much more the residuals fell than `parameters` further ones would make them.
fn evidence(before: f64, after: f64, rows: usize, parameters: usize) -> f64 {
    let n = rows as f64;
    n * (before / after.max(f64::MIN_POSITIVE)).ln() - parameters as f64 * n.ln()
}

impl<'r> Chosen<'r> {
    /// A model and its fit, of which nothing more is known.
    pub(crate) fn new(model: ForcedModel<'r>, minimum: Minimum<Projected>) -> Self {
        Self {
            model,
            minimum,
            steps: Vec::new(),
            rejected: Vec::new(),
            not_linear: Vec::new(),
            in_time: Vec::new(),
            dependences: Vec::new(),
            new_dependence: None,
            looks_for_more: false,
            remarks: Vec::new(),
        }
    }
}

impl Chosen<'_> {
    fn poles(&self) -> Vec<Pole> {
        (0..self.model.modes).map(|mode| pole(&self.minimum.parameters, mode)).collect()
    }

    fn rate_per_s(&self) -> Option<f64> {
        self.model.rate_per_s(&self.minimum.parameters)
    }

    fn rows(&self) -> usize {
        self.minimum.point.residuals.len()
    }

    /// Whether there is anything left to explain.
    fn is_explained(&self) -> bool {
        let power: f64 = self
            .model
            .records
            .iter()
            .map(|record| {
                let mean = record.output.iter().sum::<f64>() / record.output.len() as f64;
                record.output.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
            })
            .sum();
        self.minimum.sum_of_squares <= EXPLAINED * EXPLAINED * power
    }

    /// The last digits of the fit that was chosen.
    fn finish(&mut self) {
        let range = self.model.parameters(
            &self.poles(),
            self.model.delay_s(&self.minimum.parameters),
            self.rate_per_s(),
        );
        let range: Vec<Parameter> = range
            .into_iter()
            .zip(&self.minimum.parameters)
            .map(|(parameter, found)| Parameter { start: *found, ..parameter })
            .collect();
        if let Some(found) = fit(&self.model, &range) {
            self.minimum = found;
        }
    }

    /// Takes out the modes that the complete fit does not confirm, the least one first; whether there were
    /// any.
    ///
    /// What seemed a mode while others were missing may be none beside them.
    fn prune(&mut self) -> bool {
        let mut pruned = false;
        while let Some((mode, reason, found)) = self.unconfirmed() {
            let taken = pole(&self.minimum.parameters, mode);
            self.rejected.push(Rejected::Pole {
                frequency_hz: taken.frequency_hz,
                damping_ratio: Some(taken.damping_ratio),
                reason,
            });
            self.model.modes -= 1;
            self.minimum = found;
            pruned = true;
        }
        pruned
    }

    /// The least mode that is none of the structure's, why, and the fit without it.
    fn unconfirmed(&mut self) -> Option<(usize, String, Minimum<Projected>)> {
        let (delay_s, rate) = (self.model.delay_s(&self.minimum.parameters), self.rate_per_s());
        let poles = self.poles();
        let narrow = ForcedModel { modes: self.model.modes.checked_sub(1)?, ..self.model };
        let range = |mode: usize| {
            let mut left = poles.clone();
            left.remove(mode);
            narrow.parameters(&left, delay_s, rate)
        };
        let mut order: Vec<(f64, usize)> = (0..poles.len())
            .filter_map(|mode| {
                let start: Vec<f64> = range(mode).iter().map(|parameter| parameter.start).collect();
                Some((sum_of_squares_at(&narrow, &start)?, mode))
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (without, mode) in order {
            if let Some((reason, not_linear)) = refusal_within(&self.model, &self.minimum, mode) {
                self.not_linear.extend(not_linear);
                return Some((mode, reason, fit_roughly(&narrow, &range(mode))?));
            }
            if without > CERTAIN * self.minimum.sum_of_squares || narrow.modes == 0 {
                continue;
            }
            let left = fit_roughly(&narrow, &range(mode))?;
            let share = 1.0 - self.minimum.sum_of_squares / left.sum_of_squares.max(f64::MIN_POSITIVE);
            let with = held_out_sum(&self.model, &self.minimum, Some(mode));
            let held_out = held_out_sum(&narrow, &left, None).zip(with);
            if let Some((without, with)) = held_out
                && !is_confirmed(without, with, share)
            {
                return Some((mode, not_confirmed(share, without, with), left));
            }
        }
        None
    }

    /// Takes out the mode that explains least; false where there is only one.
    pub(crate) fn without_weakest(&mut self) -> bool {
        if self.model.modes < 2 {
            return false;
        }
        let narrow = ForcedModel { modes: self.model.modes - 1, ..self.model };
        let (delay_s, rate) = (self.model.delay_s(&self.minimum.parameters), self.rate_per_s());
        let poles = self.poles();
        let fits = (0..poles.len()).filter_map(|without| {
            let mut left = poles.clone();
            let taken = left.remove(without);
            let start: Vec<f64> =
                narrow.parameters(&left, delay_s, rate).iter().map(|parameter| parameter.start).collect();
            Some((sum_of_squares_at(&narrow, &start)?, left, taken))
        });
        let Some((_, left, taken)) = fits.min_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        let Some(found) = fit(&narrow, &narrow.parameters(&left, delay_s, rate)) else { return false };
        self.rejected.push(Rejected::Pole {
            frequency_hz: taken.frequency_hz,
            damping_ratio: Some(taken.damping_ratio),
            reason: "the record does not determine it beside the others".to_owned(),
        });
        (self.model, self.minimum) = (ForcedModel { records: self.model.records, ..narrow }, found);
        true
    }

    /// Whether the same modes explain other versions of the records better, by the mean square that they
    /// leave.
    pub(crate) fn explains_less_than(&self, records: &[ForcedRecord]) -> bool {
        let other = ForcedModel { records, ..self.model };
        let rows: usize = records.iter().map(|record| record.time_s.len()).sum();
        let mean = |sum: f64, rows: usize| sum / rows.max(1) as f64;
        sum_of_squares_at(&other, &self.minimum.parameters)
            .is_some_and(|sum| mean(sum, rows) < mean(self.minimum.sum_of_squares, self.rows()))
    }

    /// Adds the best further mode away from those that were refused.
    fn add_mode(&mut self, starts: &Starts, asked_for: bool, refused_hz: &[[f64; 2]]) -> Added {
        let known = self.poles();
        let delay_s = self.model.delay_s(&self.minimum.parameters);
        let wider = ForcedModel { modes: self.model.modes + 1, ..self.model };
        let rate_per_s = self.rate_per_s();
        let tried = starts.start_mode(
            &self.model,
            &self.minimum.parameters,
            &self.minimum.point.residuals,
            refused_hz,
        );
        let fits = tried.into_iter().filter_map(|start| {
            let poles: Vec<Pole> = known.iter().copied().chain([start.pole]).collect();
            let found = fit_roughly(&wider, &wider.parameters(&poles, delay_s, rate_per_s))?;
            // A search that leads to what was refused leads nowhere.
            let ends_hz = pole(&found.parameters, self.model.modes).frequency_hz;
            (!is_refused(ends_hz, refused_hz)).then_some((found, start.from))
        });
        let best = fits.min_by(|a, b| a.0.sum_of_squares.total_cmp(&b.0.sum_of_squares));
        let Some((found, from)) = best else {
            return Added::NothingLeft;
        };
        let new = pole(&found.parameters, self.model.modes);
        let what = format!("mode {} at {:.4} Hz, started from {from}", wider.modes, new.frequency_hz);
        let refusal = not_sensible(&wider, &found, starts);
        let stands_in = if refusal.is_none() && !asked_for { self.stands_in(&found, new) } else { None };
        let refusal = match stands_in {
            Some(StandsIn::ForAmplitude) => return Added::GoesWithAmplitude,
            Some(StandsIn::For(what)) => Some(what),
            None => refusal,
        };
        let undetermined = if refusal.is_none() { not_determined(&wider, &found) } else { None };
        if undetermined.is_some() && self.model.delay && self.model.real_pole {
            // A delay is to first order a rate of every mode, which a real pole brings: nothing may determine
            // the one beside the other.
            self.drop_idle_details(starts);
            if !self.model.delay {
                return self.add_mode(starts, asked_for, refused_hz);
            }
        }
        let explained = self.minimum.sum_of_squares - found.sum_of_squares;
        let beside = || self.beside_a_dependence(new, explained, asked_for);
        let refusal = refusal.or(undetermined).or_else(beside);
        let refusal = refusal.or_else(|| self.no_mode(&wider, &found, asked_for));
        let parameters = 2 + wider.columns_per_mode();
        let kept = self.weigh(what, wider, found, parameters, SHARE_OF_A_MODE, refusal.clone());
        if !kept && let Some(step) = self.steps.last() {
            let reason = match asked_for {
                true => step.reason.clone(),
                false => refusal.clone().unwrap_or_else(|| step.reason.clone()),
            };
            self.rejected.push(Rejected::Pole {
                frequency_hz: new.frequency_hz,
                damping_ratio: Some(new.damping_ratio),
                reason,
            });
        }
        let around = self.dependences.iter().find_map(|known| known.surroundings_of(new.frequency_hz));
        match (kept, refusal) {
            (true, _) => Added::Yes,
            (false, Some(_)) => Added::NotThere(around.unwrap_or(refused_band_hz(new.frequency_hz))),
            (false, None) => Added::NothingLeft,
        }
    }

    /// Why the last mode of a wider fit is none of the structure's, if it is none: for what it is, or because
    /// held-out stretches of the records do not confirm it. Who asks for a number of modes gets overlapping
    /// ones, too.
    fn no_mode(
        &mut self,
        wider: &ForcedModel<'_>,
        found: &Minimum<Projected>,
        asked_for: bool,
    ) -> Option<String> {
        if asked_for {
            return None;
        }
        if let Some((reason, not_linear)) = refusal_of_last(wider, found) {
            self.not_linear.extend(not_linear);
            return Some(reason);
        }
        let share = 1.0 - found.sum_of_squares / self.minimum.sum_of_squares.max(f64::MIN_POSITIVE);
        let narrow = held_out_sum(&self.model, &self.minimum, None)?;
        let wide = held_out_sum(wider, found, Some(self.model.modes))?;
        let is_ghost = share > SHARE_OF_A_MODE && !is_confirmed(narrow, wide, share);
        is_ghost.then(|| not_confirmed(share, narrow, wide))
    }

    /// Tries the direct share, the delay and a real pole, where they are not in the model yet.
    fn try_details(&mut self, starts: &Starts) {
        let positions = |record: &ForcedRecord| record.quantity != OutputQuantity::Velocity;
        if !self.model.direct && self.model.records.iter().all(positions) {
            let wider = ForcedModel { direct: true, ..self.model };
            self.try_detail("a direct share of the modes beyond the band", wider);
        }
        if !self.model.delay && self.model.max_delay_s > 0.0 {
            let wider = ForcedModel { delay: true, ..self.model };
            self.try_detail("a delay of the output", wider);
        }
        if !self.model.real_pole
            && self.model.records.iter().all(|record| record.input_kind == InputKind::Force)
        {
            self.try_real_pole(starts);
        }
    }

    /// Tries a body that the force moves freely against viscous friction.
    fn try_real_pole(&mut self, starts: &Starts) {
        let delay_s = self.model.delay_s(&self.minimum.parameters);
        let poles = self.poles();
        let Some(rate_per_s) = starts.start_rate(&self.model, &poles, delay_s) else { return };
        let wider = ForcedModel { real_pole: true, ..self.model };
        let Some(found) = fit_roughly(&wider, &wider.parameters(&poles, delay_s, Some(rate_per_s))) else {
            return;
        };
        let refusal = not_sensible(&wider, &found, starts)
            .or_else(|| no_real_pole(&wider, &found, starts))
            .or_else(|| not_determined(&wider, &found));
        let parameters = parameters_of(&wider) - parameters_of(&self.model);
        self.weigh(real_pole_words(&wider, &found), wider, found, parameters, SHARE_OF_A_MODE, refusal);
    }

    fn try_detail(&mut self, what: &str, wider: ForcedModel<'_>) {
        let delay_s = self.model.delay_s(&self.minimum.parameters);
        let model = ForcedModel { records: self.model.records, ..wider };
        if let Some(found) = fit_roughly(&model, &model.parameters(&self.poles(), delay_s, self.rate_per_s()))
        {
            self.weigh(what.to_owned(), model, found, 1, SHARE_OF_A_DETAIL, None);
        }
    }

    /// Takes out what later additions have made unnecessary.
    fn drop_idle_details(&mut self, starts: &Starts) {
        let ForcedModel { delay, direct, real_pole, .. } = self.model;
        let narrower = [
            direct.then_some(("the direct share", ForcedModel { direct: false, ..self.model })),
            delay.then_some(("the delay", ForcedModel { delay: false, ..self.model })),
            real_pole.then_some(("the real pole", ForcedModel { real_pole: false, ..self.model })),
        ];
        for (what, narrow) in narrower.into_iter().flatten() {
            let narrow = ForcedModel {
                direct: narrow.direct && self.model.direct,
                delay: narrow.delay && self.model.delay,
                ..narrow
            };
            let delay_s = self.model.delay_s(&self.minimum.parameters);
            let start = narrow.parameters(&self.poles(), delay_s, self.rate_per_s());
            let Some(found) = fit_roughly(&narrow, &start) else { continue };
            let fewer = parameters_of(&self.model) - parameters_of(&narrow);
            let gain = evidence(found.sum_of_squares, self.minimum.sum_of_squares, self.rows(), fewer);
            let share = 1.0 - self.minimum.sum_of_squares / found.sum_of_squares.max(f64::MIN_POSITIVE);
            let refusal = match narrow.real_pole {
                true => None,
                false => no_real_pole(&self.model, &self.minimum, starts),
            };
            if gain <= 10.0 || share <= SHARE_OF_A_DETAIL || refusal.is_some() {
                self.steps.push(ModelStep {
                    what: format!("without {what}"),
                    parameters: parameters_of(&narrow),
                    residual_rms: rms(&found),
                    evidence: -gain,
                    kept: true,
                    reason: refusal
                        .unwrap_or_else(|| "the model explains the record as well without it".to_owned()),
                });
                (self.model, self.minimum) = (narrow, found);
            }
        }
    }

    /// Keeps a wider model when it explains enough more, and writes down why or why not.
    fn weigh(
        &mut self,
        what: String,
        wider: ForcedModel<'_>,
        found: Minimum<Projected>,
        parameters: usize,
        least_share: f64,
        refusal: Option<String>,
    ) -> bool {
        let wider = ForcedModel { records: self.model.records, ..wider };
        let before = self.minimum.sum_of_squares;
        let share = 1.0 - found.sum_of_squares / before.max(f64::MIN_POSITIVE);
        let evidence = evidence(before, found.sum_of_squares, self.rows(), parameters);
        let explains =
            format!("explains {:.1} % of what was left, evidence {evidence:.0}", 100.0 * share.max(0.0));
        let (kept, reason) = match refusal {
            Some(refusal) => (false, refusal),
            None if share <= least_share => {
                (false, format!("{explains}: less than {:.0} %", 100.0 * least_share))
            }
            None if evidence <= 10.0 => (false, format!("{explains}: no more than chance would")),
            None => (true, explains),
        };
        self.steps.push(ModelStep {
            what,
            parameters: parameters_of(&wider),
            residual_rms: rms(&found),
            evidence,
            kept,
            reason,
        });
        if kept {
            (self.model, self.minimum) = (wider, found);
        }
        kept
    }
}

/// How far apart the frequencies of two modes are, as a share of the halves of their half-power bands
/// together.
fn apart(a: Pole, b: Pole) -> f64 {
    (a.frequency_hz - b.frequency_hz).abs()
        / (a.damping_ratio * a.frequency_hz + b.damping_ratio * b.frequency_hz)
}

/// What held-out parts of the record say of a mode that explains a share of the whole.
fn not_confirmed(share: f64, without: f64, with: f64) -> String {
    let theirs = 1.0 - with / without.max(f64::MIN_POSITIVE);
    let of_theirs = match theirs > 0.0 {
        true => format!("{:.1} % of theirs", 100.0 * theirs),
        false => "nothing of theirs".to_owned(),
    };
    format!(
        "parts of the record that were held out do not confirm it: it explains {:.1} % of what was left of the whole, and {of_theirs}",
        100.0 * share
    )
}

fn rms(found: &Minimum<Projected>) -> f64 {
    (found.sum_of_squares / found.point.residuals.len() as f64).sqrt()
}

/// Free numbers of a model, linear ones included.
fn parameters_of(model: &ForcedModel<'_>) -> usize {
    model.modes * (2 + model.columns_per_mode())
        + model.records.len()
        + usize::from(model.delay)
        + usize::from(model.direct)
        + if model.real_pole { 2 + model.records.len() } else { 0 }
}

/// A real pole in the words of a step.
fn real_pole_words(model: &ForcedModel<'_>, found: &Minimum<Projected>) -> String {
    let time_s = model.rate_per_s(&found.parameters).map_or(f64::INFINITY, f64::recip);
    format!("a real pole of {time_s:.4} s, and of every mode the rate")
}

/// Why a fit cannot be judged, if it cannot: a mode without a standard error is no mode.
fn not_determined(model: &ForcedModel<'_>, found: &Minimum<Projected>) -> Option<String> {
    let none = fit_covariance(model, found).is_none();
    none.then(|| "the record does not determine it: no standard error is finite with it".to_owned())
}

/// Why a real pole is none that the record shows, if it is none.
///
/// Beyond the band that the input excites its response is the input's own, which is a direct share, or a
/// delay.
fn no_real_pole(model: &ForcedModel<'_>, found: &Minimum<Projected>, starts: &Starts) -> Option<String> {
    let rate_per_s = model.rate_per_s(&found.parameters)?;
    let [lower, highest] = model.rate_range_per_s();
    let excited_hz = starts.spectral.iter().map(|spectral| spectral.excited_band_hz()[1]).fold(0.0, f64::max);
    let upper = highest.min(std::f64::consts::TAU * excited_hz);
    if rate_per_s <= 1.01 * lower {
        Some(format!("its time constant of {:.3} s is longer than the record can tell", 1.0 / rate_per_s))
    } else if rate_per_s >= upper / 1.01 {
        Some(format!(
            "its time constant of {:.2e} s is shorter than the input's band can tell",
            1.0 / rate_per_s
        ))
    } else {
        None
    }
}

/// Why a fit is no model of the structure, if it is none: a mode below one period per record is a trend, one
/// above the output's Nyquist frequency an alias, one near critical damping a drift.
fn not_sensible(model: &ForcedModel<'_>, found: &Minimum<Projected>, starts: &Starts) -> Option<String> {
    let slowest_hz =
        model.records.iter().map(|record| 1.0 / record.duration_s()).fold(f64::INFINITY, f64::min);
    let nyquist_hz = starts.spectral.iter().map(|s| s.nyquist_hz()).fold(0.0, f64::max);
    (0..model.modes).find_map(|mode| {
        let Pole { frequency_hz, damping_ratio } = pole(&found.parameters, mode);
        if frequency_hz < slowest_hz {
            Some(format!("at {frequency_hz:.4} Hz less than one period fits the record: a trend, not a mode"))
        } else if frequency_hz >= nyquist_hz {
            Some(format!("{frequency_hz:.4} Hz is above half the output's sampling rate"))
        } else if damping_ratio >= 0.9 * MAX_DAMPING {
            Some(format!("a damping ratio of {damping_ratio:.2} is a drift, not a vibration"))
        } else {
            None
        }
    })
}
