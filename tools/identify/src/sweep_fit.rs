//! Modes from a forced record, such as a sweep: output-error fit of the whole time record.
//!
//! The measured input drives the modal equations
//! q_r'' + 2 zeta_r omega_r q_r' + omega_r² q_r = s(t), y = sum participation_r q_r + offset,
//! from a free initial state, and frequencies and dampings are chosen so that the sum of squares of
//! recorded minus simulated output is least. Participations, initial states and the offset enter linearly and
//! are solved for at every trial. No window, no segment, no leakage: a record shorter than the decay
//! time is fitted as well as a long one, only with wider intervals.

use stillbeam_recording::Recording;

use crate::error::IdentifyError;
use crate::forced_record::ForcedRecord;
use crate::forced_start::{Spectral, start_mode};
use crate::interpolation::InputInterpolation;
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::{InputKind, OutputQuantity, Pole, forced_response, free_response};
use crate::result::IdentifiedModes;
use crate::separable::{Projected, Separable, fit};
use crate::sweep_report::report;

/// The most modes that are looked for or can be asked for.
pub const MAX_MODES: usize = 12;
/// Smallest damping ratio that is searched.
pub(crate) const MIN_DAMPING: f64 = 1e-6;
/// Largest damping ratio that is searched.
pub(crate) const MAX_DAMPING: f64 = 0.95;

/// Choices of [`identify_forced`].
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedOptions {
    /// Input column: base position, base acceleration or force.
    pub input: String,
    /// Output column.
    pub output: String,
    /// How many modes; `None` takes all that explain a noticeable part of the output.
    pub modes: Option<usize>,
    /// What the input is; `None` goes by its unit (m, m_s2, N).
    pub input_kind: Option<InputKind>,
    /// What the output is; `None` goes by its unit.
    pub output_quantity: Option<OutputQuantity>,
    /// What the input does between its samples.
    pub interpolation: InputInterpolation,
    /// Fits a delay of the output behind the input within plus and minus this many seconds; 0 fits none.
    pub max_delay_s: f64,
}

impl ForcedOptions {
    /// The usual choices for an input and an output column.
    pub fn new(input: impl Into<String>, output: impl Into<String>) -> Self {
        Self {
            input: input.into(),
            output: output.into(),
            modes: None,
            input_kind: None,
            output_quantity: None,
            interpolation: InputInterpolation::default(),
            max_delay_s: 0.0,
        }
    }

    /// The same with a number of modes.
    #[must_use]
    pub fn with_modes(mut self, modes: usize) -> Self {
        self.modes = Some(modes);
        self
    }
}

/// Identifies modes from a record with a measured input.
///
/// The output may be missing where the input is present (an input at 1 kHz, a camera at 100 Hz) and the
/// other way round; stamps need not be uniform.
///
/// # Errors
/// [`IdentifyError`] when the columns cannot be used or fewer modes stand out than were asked for.
pub fn identify_forced(
    recording: &Recording,
    options: &ForcedOptions,
) -> Result<IdentifiedModes, IdentifyError> {
    check_modes(options.modes)?;
    if !(options.max_delay_s >= 0.0 && options.max_delay_s.is_finite()) {
        return Err(IdentifyError::BadOption {
            option: "max_delay_s",
            value: options.max_delay_s.to_string(),
            remedy: "give a number of seconds, 0 for none",
        });
    }
    let record = ForcedRecord::new(
        recording,
        (&options.input, &options.output),
        (options.input_kind, options.output_quantity),
        options.interpolation,
        options.max_delay_s,
    )?;
    let spectral = Spectral::new(&record);
    let model = ForcedModel { record: &record, modes: 0, max_delay_s: options.max_delay_s };
    let fitted = build_up(model, &spectral, options.modes)?;
    Ok(report(&fitted.model, &fitted.minimum, &spectral))
}

/// Refuses numbers of modes that make no sense.
pub(crate) fn check_modes(modes: Option<usize>) -> Result<(), IdentifyError> {
    match modes {
        Some(0) | Some(MAX_MODES..) if modes != Some(MAX_MODES) => Err(IdentifyError::BadOption {
            option: "modes",
            value: modes.unwrap_or_default().to_string(),
            remedy: "ask for 1 to 12 modes, or for none in particular",
        }),
        _ => Ok(()),
    }
}

/// The forced record's model: parameters are ln f and ln zeta of every mode, then the delay if it is free.
#[derive(Clone, Copy)]
pub(crate) struct ForcedModel<'r> {
    pub(crate) record: &'r ForcedRecord,
    pub(crate) modes: usize,
    pub(crate) max_delay_s: f64,
}

/// The parameter vector's logarithms as a pole.
pub(crate) fn pole(parameters: &[f64], mode: usize) -> Pole {
    Pole { frequency_hz: parameters[2 * mode].exp(), damping_ratio: parameters[2 * mode + 1].exp() }
}

/// The two search parameters of a mode that starts at a pole.
pub(crate) fn pole_parameters(start: Pole, reach: f64) -> [Parameter; 2] {
    let frequency = start.frequency_hz.ln();
    [
        Parameter { start: frequency, lower: frequency - reach, upper: frequency + reach, max_step: 0.05 },
        Parameter {
            start: start.damping_ratio.ln(),
            lower: MIN_DAMPING.ln(),
            upper: MAX_DAMPING.ln(),
            max_step: 1.0,
        },
    ]
}

impl ForcedModel<'_> {
    /// Input times that belong to the output's stamps.
    pub(crate) fn input_times(&self, parameters: &[f64]) -> Vec<f64> {
        let delay_s = parameters.get(2 * self.modes).copied().unwrap_or(0.0);
        self.record.time_s.iter().map(|t| t - delay_s).collect()
    }

    /// The columns of one mode: forced response and two free ones.
    pub(crate) fn mode_columns(&self, pole: Pole, times_s: &[f64]) -> Vec<Vec<f64>> {
        let record = self.record;
        let forced = forced_response(pole, &record.input, record.input_kind, record.quantity, times_s);
        let origin_s = times_s.first().copied().unwrap_or(0.0);
        let [cosine, sine] = free_response(pole, origin_s, times_s);
        vec![forced, cosine, sine]
    }

    /// Search parameters for modes that start at `poles`.
    fn parameters(&self, poles: &[Pole], delay_s: f64) -> Vec<Parameter> {
        let mut parameters: Vec<Parameter> =
            poles.iter().flat_map(|start| pole_parameters(*start, 0.5)).collect();
        if self.max_delay_s > 0.0 {
            parameters.push(Parameter {
                start: delay_s,
                lower: -self.max_delay_s,
                upper: self.max_delay_s,
                max_step: self.max_delay_s / 4.0,
            });
        }
        parameters
    }
}

impl Separable for ForcedModel<'_> {
    fn target(&self, parameters: &[f64]) -> Vec<f64> {
        let mut target = self.record.output.clone();
        if self.record.output_is_absolute() {
            let base = self.record.input.sample(self.input_times(parameters));
            for (value, base) in target.iter_mut().zip(base) {
                *value -= base[0];
            }
        }
        target
    }

    fn blocks(&self) -> usize {
        self.modes + 1
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Vec<f64>> {
        if block == self.modes {
            return vec![vec![1.0; self.record.time_s.len()]];
        }
        self.mode_columns(pole(parameters, block), &self.input_times(parameters))
    }

    fn depends(&self, block: usize, parameter: usize) -> bool {
        block < self.modes && (parameter / 2 == block || parameter == 2 * self.modes)
    }

    fn target_depends(&self, parameter: usize) -> bool {
        parameter == 2 * self.modes && self.record.output_is_absolute()
    }
}

struct Fitted<'r> {
    model: ForcedModel<'r>,
    minimum: Minimum<Projected>,
}

/// Adds modes one by one, each started where the residual's response to the input peaks, and refits all.
fn build_up<'r>(
    mut model: ForcedModel<'r>,
    spectral: &Spectral,
    requested: Option<usize>,
) -> Result<Fitted<'r>, IdentifyError> {
    let not_computable = || IdentifyError::NotComputable {
        recording: model.record.name.clone(),
        column: model.record.output_column.clone(),
    };
    let mut best = fit(&model, &model.parameters(&[], 0.0)).ok_or_else(not_computable)?;
    for _ in 0..requested.unwrap_or(MAX_MODES) {
        if is_explained(model.record, &best) {
            break;
        }

        let known: Vec<Pole> = (0..model.modes).map(|mode| pole(&best.parameters, mode)).collect();
        let delay_s = best.parameters.get(2 * model.modes).copied().unwrap_or(0.0);
        let wider = ForcedModel { modes: model.modes + 1, ..model };
        let mut candidates: Vec<Minimum<Projected>> = Vec::new();
        for start in start_mode(&model, &known, &best.point.residuals, spectral) {
            let mut poles = known.clone();
            poles.push(start);
            candidates.extend(fit(&wider, &wider.parameters(&poles, delay_s)));
        }
        let found = candidates.into_iter().min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
        match found {
            Some(found) if is_better(&best, &found) && is_sensible(&wider, &found, spectral) => {
                (model, best) = (wider, found);
            }
            _ => break,
        }
    }
    match requested {
        Some(requested) if model.modes < requested => Err(IdentifyError::TooFewPeaks {
            recording: model.record.name.clone(),
            column: model.record.output_column.clone(),
            requested,
            found: model.modes,
            frequencies_hz: (0..model.modes).map(|mode| best.parameters[2 * mode].exp()).collect(),
        }),
        None if model.modes == 0 => Err(IdentifyError::NoPeaks {
            recording: model.record.name.clone(),
            column: model.record.output_column.clone(),
        }),
        _ => Ok(Fitted { model, minimum: best }),
    }
}

/// A further mode must explain a twentieth of what was left, and much more than its five parameters would
/// of plain noise.
fn is_better(before: &Minimum<Projected>, after: &Minimum<Projected>) -> bool {
    let n = before.point.residuals.len() as f64;
    let ratio = before.sum_of_squares / after.sum_of_squares.max(f64::MIN_POSITIVE);
    ratio > 1.0 / 0.95 && n * ratio.ln() > 10.0 + 5.0 * n.ln()
}

/// Residuals 80 dB below the output are what interpolating the input between its samples leaves, not modes.
const EXPLAINED: f64 = 1e-4;

/// Whether there is anything left to explain.
fn is_explained(record: &ForcedRecord, fitted: &Minimum<Projected>) -> bool {
    let n = record.output.len() as f64;
    let mean = record.output.iter().sum::<f64>() / n;
    let power: f64 = record.output.iter().map(|y| (y - mean).powi(2)).sum();
    fitted.sum_of_squares <= EXPLAINED * EXPLAINED * power
}

/// A mode below one period per record or above the output's Nyquist frequency is a trend or an alias.
fn is_sensible(model: &ForcedModel, found: &Minimum<Projected>, spectral: &Spectral) -> bool {
    (0..model.modes).all(|mode| {
        let pole = pole(&found.parameters, mode);
        let slowest = 1.0 / model.record.duration_s();
        (slowest..spectral.nyquist_hz()).contains(&pole.frequency_hz)
            && pole.damping_ratio < 0.9 * MAX_DAMPING
    })
}
