//! The result of a diagnosis: the JSON of `stillbeam diagnose`, schema version 1.

use std::collections::BTreeMap;

use serde::Serialize;
use stillbeam_plant::Model;

use crate::controls::Controls;
use crate::locate::{ForceSurface, OrderMap};
use crate::noise::NoiseSource;

/// Version of the JSON's fields.
pub const SCHEMA_VERSION: u32 = 1;

/// What the recordings say about the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The linear model, refitted within its own parameters, explains the recordings down to the noise.
    Adequate,
    /// Named physics was missing; with it the residual is down to the noise.
    Explained,
    /// Named physics was missing and the fit improves significantly, but a structured residual remains.
    Improved,
    /// Several candidates fit equally well.
    Ambiguous,
    /// There is a mismatch, it is located, and nothing in the catalogue explains it.
    Unexplained,
}

/// A number with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterEstimate {
    /// The estimate, in `unit`.
    pub value: f64,
    /// Its standard error, robust to coloured residuals; the same unit.
    pub stderr: f64,
    /// The unit as in column names.
    pub unit: String,
}

/// Why a law is believed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Change of the Bayesian information criterion on the training recordings when the law is added;
    /// negative is better. For information: it takes the residuals as white.
    pub delta_bic: f64,
    /// Held-out residual power without the law over that with it, decibels. Training recordings when none is
    /// held out.
    pub held_out_gain_db: f64,
    /// Two-sided probability of a term as many standard errors from zero on the training recordings.
    pub p_value: f64,
    /// How many standard errors the improvement of the held-out recordings is above none.
    pub held_out_z: Option<f64>,
}

/// Physics that was left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// Law of the catalogue.
    pub id: String,
    /// Where it sits.
    pub location: String,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, ParameterEstimate>,
    /// Why it is believed.
    pub evidence: Evidence,
    /// What a person should know.
    pub sentence: String,
}

/// The smallest effect of a law that would have been seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SmallestVisible {
    /// Law of the catalogue.
    pub id: String,
    /// Where it would sit.
    pub location: String,
    /// The parameter that says how strong it is.
    pub parameter: String,
    /// Its size, in `unit`.
    pub size: f64,
    /// The unit as in column names.
    pub unit: String,
}

/// A parameter of the given model that had to move: beside the physics found where some was named, by a refit
/// of the given model alone where not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterChange {
    /// Its path in the model file.
    pub path: String,
    /// In the given model.
    pub from: f64,
    /// Refitted.
    pub to: f64,
    /// Standard error of `to`: of noise, and of what these recordings leave undetermined and the drawing may
    /// have wrong.
    pub stderr: f64,
}

/// Where the refitted model and the recordings differ.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Mismatch {
    /// `drive`, `base`, `beam` or `sensor`; a body of a lumped model; `None` when the recordings cannot tell.
    pub link: Option<String>,
    /// Stretches that hold most of the unexplained energy, as `[from, to]` in seconds.
    pub time_windows_s: Vec<[f64; 2]>,
    /// Bands that hold most of it, as `[from, to]` in hertz.
    pub frequency_bands_hz: Vec<[f64; 2]>,
    /// Where in position and speed it lies, in words.
    pub state_region: String,
    /// Share (0 to 1) of the unexplained residual energy in those windows and bands.
    pub share_of_residual: f64,
    /// One sentence with numbers per way of looking.
    pub sentences: Vec<String>,
}

/// What a recording is used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordRole {
    /// Fitted to.
    Train,
    /// Judged on.
    HeldOut,
}

/// How well one model fits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quality {
    /// Root mean square of recorded minus simulated, in the output's unit.
    pub rms: f64,
    /// The same over the standard deviation of the recorded output.
    pub nrmse: f64,
    /// Estimated root mean square of the noise, in the output's unit.
    pub noise_floor: f64,
}

/// The three models, always apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ThreeFits {
    /// The model as given; only offsets and initial states are fitted.
    pub given: Quality,
    /// Refitted within its own parameters.
    pub refitted_linear: Quality,
    /// With the physics found; `None` when nothing was added.
    pub extended: Option<Quality>,
}

/// How well the models fit one output of one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingFit {
    /// The recording's name.
    pub recording: String,
    /// What it was used for.
    pub role: RecordRole,
    /// The output column.
    pub output: String,
    /// The three models.
    #[serde(flatten)]
    pub fits: ThreeFits,
}

/// All recordings of one role and output together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PooledFit {
    /// What they were used for.
    pub role: RecordRole,
    /// The output column.
    pub output: String,
    /// Where the noise floor comes from.
    pub noise_source: NoiseSource,
    /// The three models.
    #[serde(flatten)]
    pub fits: ThreeFits,
}

/// How well the models fit.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Fits {
    /// Output by output of every recording.
    pub recordings: Vec<RecordingFit>,
    /// By role and output.
    pub pooled: Vec<PooledFit>,
}

/// Tests of the residual that the final model leaves on the training recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualTests {
    /// Probability of as much correlation with itself if it were white. For information.
    pub whiteness_p: f64,
    /// Probability of as much correlation with the input if there were none.
    pub cross_correlation_p: f64,
    /// Probability of as much structure in step with the simulated output if there were none.
    pub structure_p: f64,
    /// Third and fifth order of the refitted model's residual relative to the output, decibels.
    pub odd_distortion_db: Option<f64>,
    /// Second and fourth order, decibels.
    pub even_distortion_db: Option<f64>,
}

/// Candidates that the recordings cannot tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tie {
    /// Each a set of laws, as `id at location`.
    pub candidates: Vec<Vec<String>>,
    /// What that means, in words.
    pub sentence: String,
}

/// One candidate and the gates it passed or failed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateRow {
    /// Law of the catalogue.
    pub id: String,
    /// Where it would sit.
    pub location: String,
    /// Standard errors from zero in the screen.
    pub screen_t: f64,
    /// The strength at which it would be five standard errors from zero on these recordings, as far as a
    /// straight line says: its first parameter's name and value. `None` for laws without a strength.
    pub detection_limit: Option<(String, f64)>,
    /// Share (0 to 1) of the law's effect that a linear refit would hide.
    pub hidden_share: f64,
    /// Fitted parameters; empty for a candidate that the screen dropped.
    pub parameters: BTreeMap<String, ParameterEstimate>,
    /// Standard errors from zero on the training recordings, when fitted.
    pub training_t: Option<f64>,
    /// Improvement of the held-out recordings in standard errors, when fitted.
    pub held_out_z: Option<f64>,
    /// Every gate with whether it was passed and why not.
    pub gates: Vec<Gate>,
    /// Whether it is part of the result.
    pub named: bool,
}

/// One gate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gate {
    /// Which.
    pub name: String,
    /// Whether it was passed.
    pub passed: bool,
    /// With numbers.
    pub detail: String,
}

/// How alike two candidates' effects are on these recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Confusability {
    /// `id at location`, in the order of rows and columns.
    pub candidates: Vec<String>,
    /// Absolute cosine of the angle between effects, what a refit hides taken out; 1 cannot be told apart.
    pub cosine: Vec<Vec<f64>>,
}

/// One output of one recording, for plots.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// The recording's name.
    pub recording: String,
    /// What it was used for.
    pub role: RecordRole,
    /// The output column.
    pub output: String,
    /// Seconds.
    pub time_s: Vec<f64>,
    /// As recorded, in the output's unit.
    pub recorded: Vec<f64>,
    /// Recorded minus simulated by the given model.
    pub given_residual: Vec<f64>,
    /// Recorded minus simulated by the refitted model.
    pub refitted_residual: Vec<f64>,
    /// Recorded minus simulated by the extended model, if there is one.
    pub extended_residual: Option<Vec<f64>>,
    /// What the extended model makes without the laws that were found, its start and offsets as fitted with
    /// them; `None` without an extended model, or where this one cannot be simulated over every recording.
    pub without_effects: Option<Vec<f64>>,
}

/// What a diagnosis cost.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Cost {
    /// Processor time of this process meanwhile, all threads together; `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Recordings that were simulated, each as often as it was.
    pub simulations: u64,
    /// Their time stamps, all together.
    pub simulated_samples: u64,
    /// Fits that were begun.
    pub fits: u64,
    /// The same step by step, in order.
    pub steps: Vec<StepCost>,
}

/// What one step of a diagnosis cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepCost {
    /// The step, as progress names it.
    pub step: String,
    /// Processor time; `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Recordings that were simulated, each as often as it was.
    pub simulations: u64,
}

/// A diagnosis. Serialises to the JSON of `stillbeam diagnose`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// What the recordings say.
    pub verdict: Verdict,
    /// The same in words, with numbers.
    pub sentence: String,
    /// Where the verdict is "adequate": as much of the noise's power, as a share of it, may be more than
    /// noise, at 95 % certainty.
    pub excess_power_share: Option<f64>,
    /// There too: the smallest effect of every kind that would have been seen.
    pub smallest_visible: Vec<SmallestVisible>,
    /// What kept the verdict from saying more.
    pub caps: Vec<String>,
    /// Physics that was missing, in order of importance.
    pub effects: Vec<Effect>,
    /// Parameters of the given model that had to move by more than three standard errors.
    pub parameter_changes: Vec<ParameterChange>,
    /// Parameters that the recordings cannot determine, kept as given.
    pub undetermined_parameters: Vec<String>,
    /// Where the refitted model and the recordings differ; `None` when they do not.
    pub mismatch: Option<Mismatch>,
    /// Orders of the sweep in what the refitted model leaves over, per training recording.
    pub orders: Vec<OrderMap>,
    /// Forces that would explain it, per place, the likeliest first.
    pub surfaces: Vec<ForceSurface>,
    /// How well the models fit.
    pub fit: Fits,
    /// Candidates that cannot be told apart.
    pub ties: Vec<Tie>,
    /// Where nothing is named: laws that by themselves take much of what is missing away, those that take
    /// most first. Held-out recordings hardly show them, a large rest remains, or time ended the search for
    /// others.
    pub unconfirmed: Vec<String>,
    /// The run that would tell the tied candidates apart, as a line for the board's console.
    pub next_experiment: Option<String>,
    /// What is to be expected of it.
    pub next_experiment_reason: Option<String>,
    /// Tests of what is left.
    pub residual_tests: ResidualTests,
    /// Every candidate with its gates.
    pub candidates: Vec<CandidateRow>,
    /// How alike the candidates' effects are.
    pub confusability: Confusability,
    /// Samples set aside as outliers, with the reason.
    pub set_aside: Vec<String>,
    /// The diagnosis tried on itself, when asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controls: Option<Controls>,
    /// Wall-clock time.
    pub seconds: f64,
    /// What it cost on any machine.
    pub cost: Cost,
    /// For plots; not part of the JSON.
    #[serde(skip)]
    pub overlays: Vec<Overlay>,
    /// The given model with its own parameters refitted, and nothing added.
    #[serde(skip)]
    pub refitted_model: Model,
    /// The refitted model with the physics found, for `--extended-model`; not part of the JSON.
    #[serde(skip)]
    pub extended_model: Option<Model>,
}
