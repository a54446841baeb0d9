//! The identified modes, in the shape of `stillbeam identify --json`.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Deserializer, Serialize};

use crate::aliasing::Image;
use crate::amplitude::{AmplitudeChange, AmplitudePoint};
use crate::levenberg_marquardt::StopReason;
use crate::linearity::Linearity;
use crate::modal_response::Pole;
use crate::modes_file::BOX_STANDARD_ERRORS;
use crate::poles::{MethodMode, Survey};
use crate::record_kind::RecordKind;
use crate::responses::{Frf, Spectrum};
use crate::warnings::{Quantity, Warning, WarningKind};

/// Version of the JSON shape.
pub const SCHEMA_VERSION: u32 = 1;

/// A number and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value, in the unit of the field that holds it.
    pub value: f64,
    /// Standard error in the same unit, robust to correlated residuals; infinite (`null` in JSON, or absent)
    /// when the record does not determine the value.
    #[serde(default = "infinite", deserialize_with = "null_is_infinite")]
    pub stderr: f64,
}

impl Estimate {
    /// [`BOX_STANDARD_ERRORS`] either way; just the value where there is no standard error.
    fn range(&self) -> [f64; 2] {
        let reach = if self.stderr.is_finite() { BOX_STANDARD_ERRORS * self.stderr } else { 0.0 };
        [self.value - reach, self.value + reach]
    }

    /// Distance to another estimate in combined standard errors.
    pub fn distance(&self, other: &Self) -> f64 {
        (self.value - other.value).abs() / self.stderr.hypot(other.stderr)
    }
}

fn infinite() -> f64 {
    f64::INFINITY
}

fn null_is_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}

/// How a mode was estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Output-error fit of the whole forced record.
    OutputError,
    /// Sum of damped sinusoids fitted to the whole free decay.
    DampedSinusoids,
    /// Covariance-driven subspace identification of outputs alone.
    CovarianceSubspace,
    /// Modal model fitted to measured frequency responses.
    ResponseFit,
    /// Peaks of modes under an even excitation, fitted to a power spectrum.
    PowerFit,
}

/// A second opinion on a mode. The standard error of a classical method is its scatter together with the
/// error that it makes on a record of exactly the fitted modes and noise like this one's; infinite where it
/// does not find the mode there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrossCheck {
    /// `frf_half_power`, `logarithmic_decrement`, `early_decay`, `late_decay`, or a
    /// [`PoleMethod`](crate::poles::PoleMethod).
    pub method: String,
    /// Natural frequency, Hz.
    pub frequency_hz: Option<Estimate>,
    /// Damping ratio.
    pub damping_ratio: Option<Estimate>,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentifiedMode {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: Estimate,
    /// Fraction of critical damping.
    pub damping_ratio: Estimate,
    /// How it was estimated.
    pub method: Method,
    /// Largest contribution to the output in the fitted record, in the output's unit; in a free decay the
    /// amplitude at the start of the fit.
    pub amplitude: Estimate,
    /// Participation: output per modal coordinate, whose equation is forced by minus the base's
    /// acceleration or by the force. `None` in a free decay, where it cannot be known.
    pub participation: Option<Estimate>,
    /// Output per rate of the modal coordinate, s times the unit of the participation: where friction on a
    /// free base keeps the structure from moving in phase. Only beside a real pole
    /// ([`IdentifiedModes::real_pole`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_participation: Option<Estimate>,
    /// Second opinions.
    pub cross_checks: Vec<CrossCheck>,
    /// The mode by amplitude: backbone and damping curve, where the record covers more than one amplitude.
    #[serde(default)]
    pub by_amplitude: Vec<AmplitudePoint>,
    /// What goes with amplitude, clearly and enough to matter; empty for a linear mode.
    #[serde(default)]
    pub amplitude_changes: Vec<AmplitudeChange>,
    /// Where frequency and damping may be, for a shaper that must hold over all of it.
    #[serde(default)]
    pub uncertainty_box: UncertaintyBox,
}

/// Ranges of frequency and damping ratio: two standard errors either way and, where the mode depends on
/// amplitude, everything between small and large amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct UncertaintyBox {
    /// Lowest and highest natural frequency, Hz.
    pub frequency_hz: [f64; 2],
    /// Lowest and highest damping ratio.
    pub damping_ratio: [f64; 2],
}

impl UncertaintyBox {
    /// The box of two estimates alone; nothing below zero.
    pub(crate) fn of(frequency_hz: &Estimate, damping_ratio: &Estimate) -> Self {
        let inside = |range: [f64; 2]| range.map(|end| end.max(0.0));
        Self { frequency_hz: inside(frequency_hz.range()), damping_ratio: inside(damping_ratio.range()) }
    }
}

impl IdentifiedMode {
    /// Energy of its free decay from the amplitude given, the square of the output's unit times s: what ranks
    /// modes.
    pub fn energy(&self) -> f64 {
        let decay_per_s = std::f64::consts::TAU * self.frequency_hz.value * self.damping_ratio.value;
        self.amplitude.value.powi(2) / (4.0 * decay_per_s)
    }

    /// Widens the box to hold another one, of the same mode in another recording.
    #[must_use]
    pub fn with_box_over(mut self, other: &UncertaintyBox) -> Self {
        let over = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        self.uncertainty_box.frequency_hz = over(self.uncertainty_box.frequency_hz, other.frequency_hz);
        self.uncertainty_box.damping_ratio = over(self.uncertainty_box.damping_ratio, other.damping_ratio);
        self
    }

    /// Gives the mode its course over amplitude, what changes there by more than `clear` standard errors
    /// (`None` where nothing is known to change), and the box.
    pub(crate) fn with_amplitudes(mut self, points: Vec<AmplitudePoint>, clear: Option<f64>) -> Self {
        let changes = clear.map(|clear| crate::amplitude::changes(&points, clear)).unwrap_or_default();
        self.go_with_amplitude(points, changes);
        self
    }

    /// Gives the mode its course over amplitude, what changes there, and the box that holds both.
    pub(crate) fn go_with_amplitude(&mut self, points: Vec<AmplitudePoint>, changes: Vec<AmplitudeChange>) {
        self.amplitude_changes = changes;
        self.by_amplitude = points;
        let mut area = UncertaintyBox::of(&self.frequency_hz, &self.damping_ratio);
        for change in &self.amplitude_changes {
            for point in &self.by_amplitude {
                let (range, value) = match change.quantity {
                    Quantity::FrequencyHz => (&mut area.frequency_hz, point.frequency_hz.value),
                    Quantity::DampingRatio => (&mut area.damping_ratio, point.damping_ratio.value),
                };
                *range = [range[0].min(value), range[1].max(value)];
            }
        }
        self.uncertainty_box = area;
    }

    /// Says nothing of the amplitude, and has a box that holds these poles as well.
    pub(crate) fn hold(&mut self, poles: &[Pole]) {
        let points = std::mem::take(&mut self.by_amplitude);
        self.go_with_amplitude(points, Vec::new());
        let wider = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        let area = &mut self.uncertainty_box;
        for pole in poles {
            area.frequency_hz = wider(area.frequency_hz, pole.frequency_hz);
            area.damping_ratio = wider(area.damping_ratio, pole.damping_ratio);
        }
    }

    /// Warnings about the dependence on amplitude, weakness and aliasing.
    pub(crate) fn own_warnings(&self, nyquist_hz: f64, image: Image) -> Vec<Warning> {
        let mode_hz = self.frequency_hz.value;
        let mut kinds: Vec<WarningKind> = self
            .amplitude_changes
            .iter()
            .map(|change| WarningKind::DependsOnAmplitude {
                mode_hz,
                quantity: change.quantity,
                small: change.small.value,
                large: change.large.value,
                stderr: change.small.stderr.hypot(change.large.stderr),
                small_amplitude: change.small_amplitude,
                large_amplitude: change.large_amplitude,
            })
            .collect();
        let damping_share = self.damping_ratio.stderr / self.damping_ratio.value;
        if damping_share.is_finite() && damping_share > 0.2 {
            kinds.push(WarningKind::WeakMode { mode_hz, amplitude: self.amplitude.value, damping_share });
        }
        if image == Image::Likelier || (image == Image::Unknown && mode_hz > 0.8 * nyquist_hz) {
            kinds.push(WarningKind::MayBeAliased {
                mode_hz,
                nyquist_hz,
                image_hz: 2.0 * nyquist_hz - mode_hz,
                likelier: image == Image::Likelier,
            });
        }
        kinds.into_iter().map(Warning::from).collect()
    }
}

/// What was taken of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum NoiseModel {
    /// The residuals are white, or their stamps too uneven for a filter: plain least squares, with standard
    /// errors that allow for correlation.
    #[default]
    White,
    /// Coloured: the fit was made through the filter that whitens the residuals.
    Autoregressive {
        /// Order of the autoregression.
        order: usize,
    },
    /// Coloured, but not noise: the whitened fit differs from the plain one by more than independent noise
    /// allows, so that the residuals hold something of the structure. The plain fit is reported.
    NotNoise {
        /// Order of the autoregression.
        order: usize,
        /// The largest difference of a parameter, in standard errors.
        #[serde(deserialize_with = "null_is_infinite")]
        apart: f64,
    },
}

/// A mode's share of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShapePart {
    /// The output column.
    pub output: String,
    /// Real part, relative to the largest part of the shape.
    pub real: f64,
    /// Imaginary part; near 0 where all outputs move in phase or against each other.
    pub imag: f64,
}

/// How a mode looks at several outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModeShape {
    /// Frequency of the mode, Hz.
    pub frequency_hz: f64,
    /// One part per output, the largest of them 1.
    pub parts: Vec<ShapePart>,
}

impl ModeShape {
    /// A shape from the complex shares of the outputs, of any common factor.
    pub(crate) fn of(frequency_hz: f64, outputs: &[String], shares: &[Complex64]) -> Self {
        let largest = shares.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()));
        let largest = largest.filter(|part| part.norm() > 0.0).unwrap_or(Complex64::new(1.0, 0.0));
        let parts = outputs.iter().zip(shares).map(|(output, share)| {
            let part = share / largest;
            ShapePart { output: output.clone(), real: part.re, imag: part.im }
        });
        Self { frequency_hz, parts: parts.collect() }
    }
}

/// One step in the choice of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelStep {
    /// What was added or taken out.
    pub what: String,
    /// Free numbers of the model with it, linear ones included.
    pub parameters: usize,
    /// Root mean square of what the model with it leaves, in the output's unit.
    pub residual_rms: f64,
    /// Schwarz's criterion: rows times the logarithm of the ratio of the sums of squares, less the logarithm
    /// of the rows for every parameter. Above 10 speaks for it.
    pub evidence: f64,
    /// Whether it was kept.
    pub kept: bool,
    /// Why, or why not.
    pub reason: String,
}

/// What was found or recorded and is not in the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Rejected {
    /// Something that might have been a mode.
    Pole {
        /// Its frequency, Hz.
        frequency_hz: f64,
        /// Its damping ratio, where it was estimated.
        damping_ratio: Option<f64>,
        /// Why it is not a mode.
        reason: String,
    },
    /// Samples that were not fitted.
    Samples {
        /// The recording.
        recording: String,
        /// How many.
        count: usize,
        /// Time of the first one, s.
        first_s: f64,
        /// Time of the last one, s.
        last_s: f64,
        /// Why they were left out.
        reason: String,
    },
}

impl Rejected {
    /// The frequency of a pole, Hz.
    pub(crate) fn frequency_hz(&self) -> Option<f64> {
        match self {
            Self::Pole { frequency_hz, .. } => Some(*frequency_hz),
            Self::Samples { .. } => None,
        }
    }
}

/// What belongs to one of the recordings that were fitted together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordFit {
    /// Name of the recording.
    pub recording: String,
    /// Samples fitted.
    pub rows: usize,
    /// Constant part of its output, in the output's unit.
    pub offset: Estimate,
    /// Root mean square of its recorded minus fitted output, in the output's unit.
    pub residual_rms: f64,
    /// How much of its output the fit explains, percent: 100 (1 - residual rms / standard deviation of the
    /// output).
    #[serde(default)]
    pub fit_percent: f64,
    /// Time of its first and its last fitted sample, s.
    pub window_s: [f64; 2],
}

/// How much of an output a fit explains, percent; below 0 where it is worse than the output's mean.
pub(crate) fn fit_percent(output: &[f64], residual_rms: f64) -> f64 {
    let count = output.len().max(1) as f64;
    let mean = output.iter().sum::<f64>() / count;
    let deviation = (output.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count).sqrt();
    100.0 * (1.0 - residual_rms / deviation.max(f64::MIN_POSITIVE))
}

/// A body that the force moves freely against viscous friction: no mode, a velocity that is forgotten.
///
/// Its coordinate p obeys p' + p / time constant = force, and the output has participation times p (its rate,
/// for an output that is a velocity; the rate of that, for an acceleration). For a base on a guide the time
/// constant is the moved mass over the friction, nearly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RealPole {
    /// Time by which the velocity falls by e, s.
    pub time_constant_s: Estimate,
    /// Output per coordinate, the output's unit per (N s).
    pub participation: Estimate,
}

impl RealPole {
    /// The sentence for people.
    pub fn words(&self) -> String {
        let Estimate { value, stderr } = self.time_constant_s;
        format!(
            "real pole, time constant {value:.4} ± {stderr:.1e} s: no mode, but the base's velocity, forgotten by viscous friction (its moved mass over its friction, nearly)"
        )
    }
}

/// Measured and fitted output, for plots.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitTrace {
    /// Stamps of the samples that were fitted, s.
    pub time_s: Vec<f64>,
    /// The recorded output there, in its unit.
    pub measured: Vec<f64>,
    /// The fitted output there.
    pub fitted: Vec<f64>,
}

/// The result of an identification.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentifiedModes {
    /// Version of this shape, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Name of the recording.
    pub recording: String,
    /// What kind of record it is, where its input was not recorded; that of the input, where it was.
    #[serde(default)]
    pub kind: Option<RecordKind>,
    /// Shapes of the modes, in their order, where several outputs were read together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shapes: Vec<ModeShape>,
    /// Input column, if the record is a forced one.
    pub input: Option<String>,
    /// Output column.
    pub output: String,
    /// Modes by rising frequency.
    pub modes: Vec<IdentifiedMode>,
    /// The modes as the classical methods see them, those included that the fit does not have; of the first
    /// recording, where there are several.
    #[serde(default)]
    pub second_opinions: Vec<MethodMode>,
    /// Frequency response of a forced record.
    pub frf: Option<Frf>,
    /// Spectrum of a free decay.
    pub spectrum: Option<Spectrum>,
    /// Constant part of the output, in its unit.
    pub offset: Estimate,
    /// Delay of the output behind the input, s, when it was asked for.
    pub delay_s: Option<Estimate>,
    /// The share of the output in direct proportion to the force or to minus the base's acceleration: the
    /// static compliance of the modes beyond the band. Where the record calls for it.
    #[serde(default)]
    pub direct: Option<Estimate>,
    /// The real pole beside the modes that viscous friction gives a structure whose base is free and pushed
    /// by a force. Where the record calls for it; never where the input is a motion of the base.
    #[serde(default)]
    pub real_pole: Option<RealPole>,
    /// Root mean square of recorded minus fitted output, in the output's unit.
    pub residual_rms: f64,
    /// Time of the first and the last fitted sample, s; of the first recording, where there are several.
    pub window_s: [f64; 2],
    /// First and last frequency that was fitted, Hz, of what is a function of frequency and not of time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band_hz: Option<[f64; 2]>,
    /// The recordings that were fitted together.
    #[serde(default)]
    pub records: Vec<RecordFit>,
    /// Whether the structure answered as a linear one.
    #[serde(default)]
    pub linearity: Linearity,
    /// What was taken of the noise.
    #[serde(default)]
    pub noise: NoiseModel,
    /// How the model was chosen, step by step.
    #[serde(default)]
    pub model_choice: Vec<ModelStep>,
    /// Poles and samples that are not in the result, with the reasons.
    #[serde(default)]
    pub rejected: Vec<Rejected>,
    /// Why the search ended.
    pub stop_reason: StopReason,
    /// What to know before relying on the modes.
    pub warnings: Vec<Warning>,
    /// Measured and fitted output (of the first recording, where there are several); not part of the JSON.
    #[serde(skip)]
    pub fit: FitTrace,
    /// Responses and stabilisation charts of the classical methods, for plots; not part of the JSON.
    #[serde(skip)]
    pub survey: Survey,
}
