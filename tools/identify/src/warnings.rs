//! What a reader of the modes must know before relying on them.

use serde::{Deserialize, Serialize};

/// A warning: a sentence for people, and its kind and numbers for programs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Warning {
    /// The sentence.
    pub message: String,
    /// Kind and numbers.
    #[serde(flatten)]
    pub kind: WarningKind,
}

impl From<WarningKind> for Warning {
    fn from(kind: WarningKind) -> Self {
        Self { message: kind.sentence(), kind }
    }
}

/// A quantity of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Natural frequency, Hz.
    FrequencyHz,
    /// Damping ratio.
    DampingRatio,
}

impl Quantity {
    /// Without its unit, for changes in per cent.
    pub(crate) fn plain_words(self) -> &'static str {
        match self {
            Self::FrequencyHz => "frequency",
            Self::DampingRatio => "damping ratio",
        }
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::FrequencyHz => "frequency (Hz)",
            Self::DampingRatio => "damping ratio",
        }
    }
}

/// How fast a sweep passes a mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FastPassage {
    /// Frequency of the mode, Hz.
    pub mode_hz: f64,
    /// Sweep rate where it passes the mode, Hz/s.
    pub rate_hz_s: f64,
    /// (2 zeta f)², Hz/s.
    pub limit_hz_s: f64,
}

/// The kinds of warning, with their numbers. Modes are named by their frequency.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum WarningKind {
    /// The record ends before the mode has had time to decay by e.
    RecordShorterThanDecay {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Length of the fitted record, s.
        duration_s: f64,
        /// 1 / (zeta omega), s.
        decay_time_s: f64,
    },
    /// The sweep passes modes faster than their half-power bandwidths squared.
    SweepTooFast {
        /// The modes, by rising frequency.
        modes: Vec<FastPassage>,
    },
    /// An independent estimate differs by more than three standard errors.
    CrossCheckDisagrees {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// What differs.
        quantity: Quantity,
        /// The method that differs.
        method: String,
        /// The fit's value.
        fitted: f64,
        /// The other method's value.
        other: f64,
        /// Combined standard error.
        stderr: f64,
    },
    /// The input hardly reaches the mode.
    OutsideExcitedBand {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Lowest excited frequency, Hz.
        lower_hz: f64,
        /// Highest excited frequency, Hz.
        upper_hz: f64,
    },
    /// Frequency or damping differ between the early and the late part of the decay.
    ChangesDuringDecay {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// What changes.
        quantity: Quantity,
        /// Value in the early, large part.
        early: f64,
        /// Value in the late, small part.
        late: f64,
        /// Combined standard error.
        stderr: f64,
    },
    /// The signal stays at its extreme value.
    Clipping {
        /// The column.
        column: String,
        /// The value it stays at, in the column's unit.
        level: f64,
        /// Samples at that value.
        samples: usize,
        /// Whether the fit does without them.
        #[serde(default)]
        left_out: bool,
    },
    /// Single samples far outside all around them: set aside.
    WildSamples {
        /// The column.
        column: String,
        /// Time (s) and value (the column's unit) of each.
        samples: Vec<[f64; 2]>,
    },
    /// The sensor drifts by much beside the ringing: that was taken out.
    SensorDrifts {
        /// The column.
        column: String,
        /// By how much from the lowest to the highest, in the column's unit.
        by: f64,
    },
    /// A column holds every reading for several rows: the sensor is slower than the recorder.
    HeldReadings {
        /// The column.
        column: String,
        /// How many rows a reading is held for, on average.
        rows_each: f64,
    },
    /// A column holds a value that stands for "no reading".
    LostReadings {
        /// The column.
        column: String,
        /// That value, in the column's unit.
        value: f64,
        /// In how many rows.
        count: usize,
    },
    /// A column stands still from here to the end although the structure was still moving.
    NothingChanges {
        /// The column.
        column: String,
        /// From when on, s.
        at_s: f64,
        /// The value it stays at, in the column's unit.
        level: f64,
    },
    /// Two columns hold the same samples.
    DoubledColumn {
        /// The column that was fitted.
        column: String,
        /// The other one.
        other: String,
    },
    /// The structure was knocked several times; one decay was fitted.
    SeveralKnocks {
        /// When, s.
        knocks_s: Vec<f64>,
        /// The decay that was fitted, s.
        window_s: [f64; 2],
    },
    /// A line of the spectrum that does not decay.
    ForcedTone {
        /// Its frequency, Hz.
        mode_hz: f64,
        /// The longest decay that could be told from none, s.
        duration_s: f64,
    },
    /// A parameter ended at the limit of its range.
    AtBound {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Which parameter.
        quantity: Quantity,
        /// The limit.
        bound: f64,
    },
    /// The search ended before it reached a minimum.
    NotConverged {
        /// Steps made.
        steps: usize,
    },
    /// What the fit leaves is coloured in a way that independent noise is not.
    ResidualsNotNoise {
        /// By how many standard errors the fits with and without a noise model differ.
        apart: f64,
    },
    /// The fit explains visibly less of its column than the noise in it allows.
    LeavesMoreThanNoise {
        /// The column.
        column: String,
        /// How much the fit explains, percent.
        explained_percent: f64,
        /// How much a fit that leaves noise alone would explain, percent.
        possible_percent: f64,
        /// Where what is left is loudest, Hz.
        loudest_hz: f64,
    },
    /// Recordings of the same structure disagree.
    RecordingsDisagree {
        /// Frequency of the mode in the first one, Hz.
        mode_hz: f64,
        /// What differs.
        quantity: Quantity,
        /// Value in the first one.
        first: f64,
        /// Value in the second one.
        second: f64,
        /// Combined standard error.
        stderr: f64,
        /// Amplitude of the mode in the first one, in the output's unit.
        first_amplitude: f64,
        /// Amplitude of the mode in the second one, in the output's unit.
        second_amplitude: f64,
    },
    /// Stamps are farther apart than usual: samples were dropped. They are fitted as they are, not filled in.
    MissingSamples {
        /// The recording.
        recording: String,
        /// How many samples would fill the gaps.
        count: usize,
        /// How many gaps.
        gaps: usize,
        /// The longest gap, s.
        longest_s: f64,
        /// Where it begins, s.
        at_s: f64,
    },
    /// A peak of the spectrum that none of the modes explains.
    PeakWithoutMode {
        /// The column.
        column: String,
        /// Where it is, Hz.
        frequency_hz: f64,
        /// How far it stands above its neighbourhood, dB.
        above_db: f64,
        /// Share of the column's power that it holds.
        power_share: f64,
    },
    /// The stamps have gaps, and one stretch between them was read.
    OneStretchRead {
        /// The recording.
        recording: String,
        /// Its first and its last row, s.
        window_s: [f64; 2],
    },
    /// The stamps have gaps, and all stretches between them were read, each on its own.
    StretchesRead {
        /// The recording.
        recording: String,
        /// How many stretches.
        stretches: usize,
        /// How long they are together, s.
        together_s: f64,
    },
    /// Stamps are closer than half the usual interval: samples were delivered twice, or stamped wrongly.
    CrowdedSamples {
        /// The recording.
        recording: String,
        /// How many.
        count: usize,
        /// The first one, s.
        at_s: f64,
    },
    /// The intervals scatter.
    UnevenStamps {
        /// The recording.
        recording: String,
        /// Standard deviation of the intervals, as a share of the usual one.
        scatter: f64,
    },
    /// Samples repeat the one before while the signal moves: frames delivered twice.
    RepeatedSamples {
        /// The recording.
        recording: String,
        /// How many.
        count: usize,
        /// The first one, s.
        at_s: f64,
    },
    /// Stamps are even, but from here on the record is early or late by whole intervals: frames were lost, or
    /// delivered twice, and numbered all the same.
    LostFrames {
        /// The recording.
        recording: String,
        /// How many were lost; negative where there are too many.
        count: i64,
        /// Where, s.
        at_s: f64,
    },
    /// A mode may be the image of one above half the sampling rate: it is close to it and the record cannot
    /// tell, or the record fits the image better.
    MayBeAliased {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Half the sampling rate, Hz.
        nyquist_hz: f64,
        /// Where the original would be, Hz.
        image_hz: f64,
        /// Whether the record fits the original better.
        likelier: bool,
    },
    /// The record hardly shows the mode.
    WeakMode {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Its largest amplitude, in the output's unit.
        amplitude: f64,
        /// Standard error of its damping ratio as a share of it.
        damping_share: f64,
    },
    /// A driven line in the spectrum, which is no mode.
    ToneInRecord {
        /// Its frequency, Hz.
        frequency_hz: f64,
        /// How it was recognised.
        reason: String,
    },
    /// A mode's frequency or damping goes with its amplitude: the structure is not linear.
    DependsOnAmplitude {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// What changes.
        quantity: Quantity,
        /// Value at the small amplitude.
        small: f64,
        /// Value at the large amplitude.
        large: f64,
        /// Combined standard error.
        stderr: f64,
        /// The small amplitude, in the output's unit.
        small_amplitude: f64,
        /// The large amplitude.
        large_amplitude: f64,
    },
    /// One mode does not explain what the structure does near a frequency, and a second one there would stand
    /// in for a frequency or a damping that changes.
    NotLinearNear {
        /// The frequency, Hz.
        frequency_hz: f64,
        /// How many times the power beside it the fit leaves there.
        times_floor: f64,
    },
    /// The fit leaves much near a mode of an impact test whose blows few samples show: what the force did
    /// between them may be the reason, and the structure need not be.
    BlowsOfFewSamples {
        /// The frequency, Hz.
        frequency_hz: f64,
        /// Samples that a blow lasts.
        samples: usize,
    },
    /// A mode's frequency or damping changes while the record runs, and that explains more than a change with
    /// its amplitude.
    NotConstantNear {
        /// Frequency before, Hz.
        before_hz: f64,
        /// Frequency after, Hz.
        after_hz: f64,
        /// Damping ratio before.
        before_damping: f64,
        /// Damping ratio after.
        after_damping: f64,
        /// When it changes, s; `None` where it changes all the time.
        at_s: Option<f64>,
    },
    /// A mode changes with its amplitude, in time or by the recorder's clock: the record cannot tell which.
    NotLinearOrNotConstantNear {
        /// Frequency of the mode, Hz.
        frequency_hz: f64,
    },
    /// The modes come from a power spectrum.
    FromPowerSpectrum {
        /// What it is, in words.
        what: String,
        /// Distance of its lines, Hz.
        line_hz: f64,
    },
    /// The half-power band of a mode is hardly wider than the lines of the spectrum are apart.
    PeakNarrowerThanLines {
        /// Frequency of the mode, Hz.
        mode_hz: f64,
        /// Its damping ratio.
        damping_ratio: f64,
        /// Distance of the lines, Hz.
        line_hz: f64,
    },
    /// Samples are so far apart that the stamps may not be seconds.
    StampsMayNotBeSeconds {
        /// The recording.
        recording: String,
        /// The usual interval, s.
        interval_s: f64,
    },
    /// The input has a gap that the interpolation had to bridge.
    InputGap {
        /// Where it begins, s.
        start_s: f64,
        /// How long it is, s.
        length_s: f64,
    },
}
