//! How many modes, and whether a delay and a direct share: every step is judged and kept on record.
//!
//! Modes are added one by one, each started where what is left responds most to the input; after every mode the
//! delay and the direct share are tried, because without them further modes would stand in for them; at the
//! end whatever has become unnecessary is taken out again.

use crate::error::IdentifyError;
use crate::forced_fit::{ForcedOptions, MAX_MODES};
use crate::forced_model::{ForcedModel, MAX_DAMPING, pole};
use crate::forced_record::ForcedRecord;
use crate::forced_start::Starts;
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::{OutputQuantity, Pole};
use crate::result::{ModelStep, Rejected};
use crate::separable::{Projected, fit};

/// A model and its fit, and how it came to be chosen.
pub(crate) struct Chosen<'r> {
    pub(crate) model: ForcedModel<'r>,
    pub(crate) minimum: Minimum<Projected>,
    pub(crate) steps: Vec<ModelStep>,
    pub(crate) rejected: Vec<Rejected>,
}

/// What a further mode must explain of the sum of squares.
const SHARE_OF_A_MODE: f64 = 0.05;
/// What a delay or a direct share must explain of it.
const SHARE_OF_A_DETAIL: f64 = 0.02;
/// Residuals 80 dB below the output are what interpolating the input between its samples leaves, not modes.
const EXPLAINED: f64 = 1e-4;

/// Chooses and fits the model.
pub(crate) fn choose<'r>(
    records: &'r [ForcedRecord],
    starts: &Starts,
    options: &ForcedOptions,
) -> Result<Chosen<'r>, IdentifyError> {
    let model =
        ForcedModel { records, modes: 0, delay: false, max_delay_s: options.max_delay_s, direct: false };
    let (recording, column) = (names(records), records[0].output_column.clone());
    let minimum = fit(&model, &[]).ok_or_else(|| IdentifyError::NotComputable {
        recording: recording.clone(),
        column: column.clone(),
    })?;
    let mut chosen = Chosen { model, minimum, steps: Vec::new(), rejected: Vec::new() };
    for _ in 0..options.modes.unwrap_or(MAX_MODES) {
        if chosen.is_explained() || !chosen.add_mode(starts, options.modes.is_some()) {
            break;
        }
        chosen.try_details();
    }
    chosen.drop_idle_details();
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

impl Chosen<'_> {
    fn poles(&self) -> Vec<Pole> {
        (0..self.model.modes).map(|mode| pole(&self.minimum.parameters, mode)).collect()
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

    /// Adds the best further mode; false when there is none worth it.
    fn add_mode(&mut self, starts: &Starts, asked_for: bool) -> bool {
        let known = self.poles();
        let delay_s = self.model.delay_s(&self.minimum.parameters);
        let wider = ForcedModel { modes: self.model.modes + 1, ..self.model };
        let tried = starts.start_mode(&self.model, &self.minimum.parameters, &self.minimum.point.residuals);
        let fits = tried.into_iter().filter_map(|start| {
            let poles: Vec<Pole> = known.iter().copied().chain([start.pole]).collect();
            Some((fit(&wider, &wider.parameters(&poles, delay_s))?, start.from))
        });
        let best = fits.min_by(|a, b| a.0.sum_of_squares.total_cmp(&b.0.sum_of_squares));
        let Some((found, from)) = best else {
            return false;
        };
        let new = pole(&found.parameters, self.model.modes);
        let what = format!("mode {} at {:.4} Hz, started from {from}", wider.modes, new.frequency_hz);
        let refusal = not_sensible(&wider, &found, starts);
        let parameters = 2 + wider.columns_per_mode();
        let kept = self.weigh(what, wider, found, parameters, SHARE_OF_A_MODE, refusal.clone());
        if !kept && let Some(step) = self.steps.last() {
            let reason = match asked_for {
                true => step.reason.clone(),
                false => refusal.unwrap_or_else(|| step.reason.clone()),
            };
            self.rejected.push(Rejected::Pole {
                frequency_hz: new.frequency_hz,
                damping_ratio: Some(new.damping_ratio),
                reason,
            });
        }
        kept
    }

    /// Tries the direct share and the delay, where they are not in the model yet.
    fn try_details(&mut self) {
        let positions = |record: &ForcedRecord| record.quantity != OutputQuantity::Velocity;
        if !self.model.direct && self.model.records.iter().all(positions) {
            let wider = ForcedModel { direct: true, ..self.model };
            self.try_detail("a direct share of the modes beyond the band", wider);
        }
        if !self.model.delay && self.model.max_delay_s > 0.0 {
            let wider = ForcedModel { delay: true, ..self.model };
            self.try_detail("a delay of the output", wider);
        }
    }

    fn try_detail(&mut self, what: &str, wider: ForcedModel<'_>) {
        let delay_s = self.model.delay_s(&self.minimum.parameters);
        let model = ForcedModel { records: self.model.records, ..wider };
        if let Some(found) = fit(&model, &model.parameters(&self.poles(), delay_s)) {
            self.weigh(what.to_owned(), model, found, 1, SHARE_OF_A_DETAIL, None);
        }
    }

    /// Takes out what later additions have made unnecessary.
    fn drop_idle_details(&mut self) {
        let (delay, direct) = (self.model.delay, self.model.direct);
        let narrower = [
            direct.then_some(("the direct share", ForcedModel { direct: false, ..self.model })),
            delay.then_some(("the delay", ForcedModel { delay: false, ..self.model })),
        ];
        for (what, narrow) in narrower.into_iter().flatten() {
            let narrow = ForcedModel {
                direct: narrow.direct && self.model.direct,
                delay: narrow.delay && self.model.delay,
                ..narrow
            };
            let delay_s = self.model.delay_s(&self.minimum.parameters);
            let Some(found) = fit(&narrow, &narrow.parameters(&self.poles(), delay_s)) else { continue };
            let gain = evidence(found.sum_of_squares, self.minimum.sum_of_squares, self.rows(), 1);
            let share = 1.0 - self.minimum.sum_of_squares / found.sum_of_squares.max(f64::MIN_POSITIVE);
            if gain <= 10.0 || share <= SHARE_OF_A_DETAIL {
                self.steps.push(ModelStep {
                    what: format!("without {what}"),
                    parameters: parameters_of(&narrow),
                    residual_rms: rms(&found),
                    evidence: -gain,
                    kept: true,
                    reason: "the model explains the record as well without it".to_owned(),
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

fn rms(found: &Minimum<Projected>) -> f64 {
    (found.sum_of_squares / found.point.residuals.len() as f64).sqrt()
}

/// Free numbers of a model, linear ones included.
fn parameters_of(model: &ForcedModel<'_>) -> usize {
    model.modes * (2 + model.columns_per_mode())
        + model.records.len()
        + usize::from(model.delay)
        + usize::from(model.direct)
}

/// Why a fit is no model of the structure, if it is none: a mode below one period per record is a trend, one above
/// the output's Nyquist frequency an alias, one near critical damping a drift.
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
