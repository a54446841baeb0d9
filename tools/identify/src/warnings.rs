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

impl WarningKind {
    fn sentence(&self) -> String {
        match self {
            Self::RecordShorterThanDecay { mode_hz, duration_s, decay_time_s } => format!(
                "mode at {mode_hz:.4} Hz: the record is {duration_s:.3} s long but the mode takes {decay_time_s:.3} s to decay by e; record longer for a sharper damping"
            ),
            Self::SweepTooFast { modes } => {
                let passage = |one: &FastPassage| {
                    let FastPassage { mode_hz, rate_hz_s, limit_hz_s } = one;
                    format!("{mode_hz:.4} Hz at {rate_hz_s:.1e} Hz/s (limit {limit_hz_s:.1e})")
                };
                format!(
                    "the sweep passes {} too fast for methods based on the frequency response: {}; the time-domain fit reported here needs no such limit, but do not read damping off the frequency response",
                    if modes.len() == 1 { "a mode" } else { "modes" },
                    modes.iter().map(passage).collect::<Vec<_>>().join(", ")
                )
            }
            Self::CrossCheckDisagrees { mode_hz, quantity, method, fitted, other, stderr } => format!(
                "mode at {mode_hz:.4} Hz: {method} gives a {} of {other:.6} where the fit gives {fitted:.6}, {:.1} standard errors apart",
                quantity.words(),
                (fitted - other).abs() / stderr
            ),
            Self::OutsideExcitedBand { mode_hz, lower_hz, upper_hz } => format!(
                "mode at {mode_hz:.4} Hz lies outside the band the input excites ({lower_hz:.3} to {upper_hz:.3} Hz); sweep further to pin it down"
            ),
            Self::ChangesDuringDecay { mode_hz, quantity, early, late, stderr } => format!(
                "mode at {mode_hz:.4} Hz: its {} goes from {early:.6} early (large) to {late:.6} late (small), {:.1} standard errors apart: it depends on amplitude or on time; `stillbeam diagnose` looks for the reason",
                quantity.words(),
                (early - late).abs() / stderr
            ),
            Self::Clipping { column, level, samples, left_out } => format!(
                "column `{column}` stays at its extreme {level} for {samples} samples: it looks clipped, {}; record with a larger range",
                if *left_out {
                    "and these samples were left out"
                } else {
                    "which spoils amplitude and damping"
                }
            ),
            Self::WildSamples { column, samples } => {
                let named: Vec<String> =
                    samples.iter().take(3).map(|[t, value]| format!("{value} at {t:.4} s")).collect();
                format!(
                    "column `{column}`: {} far outside all around {} set aside: {}{}",
                    if samples.len() == 1 {
                        "one sample".to_owned()
                    } else {
                        format!("{} samples", samples.len())
                    },
                    if samples.len() == 1 { "it was" } else { "them were" },
                    named.join(", "),
                    if samples.len() > named.len() { ", ..." } else { "" }
                )
            }
            Self::SensorDrifts { column, by } => format!(
                "column `{column}` drifts by {by:.3e} beside the ringing (temperature, a charge that leaks away): that was taken out, and a mode with fewer than three periods in the record with it"
            ),
            Self::HeldReadings { column, rows_each } => format!(
                "column `{column}` holds every reading for {rows_each:.1} rows: the sensor is slower than the recorder, and each reading was taken once"
            ),
            Self::LostReadings { column, value, count } => format!(
                "column `{column}` is {value} in {count} rows, far outside all others: taken as no reading, and left out"
            ),
            Self::NothingChanges { column, at_s, level } => format!(
                "column `{column}`: nothing changes after {at_s:.3} s (it stays at {level}): the sensor or its cable failed there; what came before was fitted (`--end {at_s:.3}` says so)"
            ),
            Self::DoubledColumn { column, other } => format!(
                "the columns `{column}` and `{other}` hold the same samples: one sensor was recorded twice; check the channels"
            ),
            Self::SeveralKnocks { knocks_s, window_s } => format!(
                "the structure was knocked {} times (at {} s); the decay from {:.3} s to {:.3} s was fitted; `--start` and `--end` choose another",
                knocks_s.len(),
                knocks_s.iter().map(|t| format!("{t:.3}")).collect::<Vec<_>>().join(", "),
                window_s[0],
                window_s[1]
            ),
            Self::ForcedTone { mode_hz, duration_s } => format!(
                "the line at {mode_hz:.4} Hz does not decay within {duration_s:.2} s: it looks like a forced tone (mains hum, a motor), not a mode"
            ),
            Self::AtBound { mode_hz, quantity, bound } => format!(
                "mode at {mode_hz:.4} Hz: its {} ended at the limit {bound:.6} of the search; do not rely on it",
                quantity.words()
            ),
            Self::NotConverged { steps } => {
                format!("the search gave up after {steps} steps without reaching a minimum; try fewer modes")
            }
            Self::ResidualsNotNoise { apart } => format!(
                "what the fit leaves is not independent noise (with and without a noise model it differs by {apart:.1} standard errors): the structure does something that the modes do not; `stillbeam diagnose` looks for what"
            ),
            Self::LeavesMoreThanNoise { column, explained_percent, possible_percent, loudest_hz } => format!(
                "the fit explains {explained_percent:.1} % of `{column}`, and the noise in it would allow {possible_percent:.1} %: what is left is loudest near {loudest_hz:.3} Hz; a mode may be missing there, or the sensor saw something else (a drift, a motor, a structure that is not linear)"
            ),
            Self::RecordingsDisagree {
                mode_hz,
                quantity,
                first,
                second,
                stderr,
                first_amplitude,
                second_amplitude,
            } => format!(
                "mode at {mode_hz:.4} Hz: its {} is {first:.6} at amplitude {first_amplitude:.3e} and {second:.6} at {second_amplitude:.3e}, {:.1} standard errors apart: the structure is not linear, or changed",
                quantity.words(),
                (first - second).abs() / stderr
            ),
            Self::MissingSamples { recording, count, gaps, longest_s, at_s } => format!(
                "{recording}: {count} samples are missing in {gaps} gaps of the time stamps, the longest {longest_s:.4} s after {at_s:.4} s; the rest is fitted where it is"
            ),
            Self::CrowdedSamples { recording, count, at_s } => format!(
                "{recording}: {count} samples come less than half the usual interval after the one before, the first at {at_s:.4} s: delivered twice, or stamped wrongly"
            ),
            Self::UnevenStamps { recording, scatter } => format!(
                "{recording}: the intervals between samples scatter by {:.0} %; they are fitted as stamped, so the stamps must be those of the exposure, not of the arrival",
                100.0 * scatter
            ),
            Self::RepeatedSamples { recording, count, at_s } => format!(
                "{recording}: {count} samples repeat the one before while the signal moves, the first at {at_s:.4} s: frames delivered twice; leave their cells empty"
            ),
            Self::LostFrames { recording, count, at_s } => format!(
                "{recording}: from {at_s:.3} s on the record is {} by {} intervals although its stamps are even: {}; record the true stamps, or cut the recording there",
                if *count > 0 { "early" } else { "late" },
                count.abs(),
                if *count > 0 {
                    "samples were lost and not counted"
                } else {
                    "samples were counted that there were not"
                }
            ),
            Self::MayBeAliased { mode_hz, nyquist_hz, image_hz, likelier: true } => format!(
                "mode at {mode_hz:.4} Hz: the record fits one at {image_hz:.2} Hz better, above half the sampling rate ({nyquist_hz:.2} Hz); sample faster"
            ),
            Self::MayBeAliased { mode_hz, nyquist_hz, image_hz, likelier: false } => format!(
                "mode at {mode_hz:.4} Hz is close to half the sampling rate ({nyquist_hz:.2} Hz): it may be the image of one at {image_hz:.2} Hz; sample faster to tell"
            ),
            Self::WeakMode { mode_hz, amplitude, damping_share } => format!(
                "mode at {mode_hz:.4} Hz is weak (amplitude {amplitude:.2e}; its damping ratio is known to ±{:.0} %): excite it more before shaping for it",
                100.0 * damping_share
            ),
            Self::ToneInRecord { frequency_hz, reason } => {
                format!("the line at {frequency_hz:.2} Hz is a forced tone, not a mode: {reason}")
            }
            Self::DependsOnAmplitude {
                mode_hz,
                quantity,
                small,
                large,
                stderr,
                small_amplitude,
                large_amplitude,
            } => format!(
                "not linear near {mode_hz:.3} Hz: the {} {} with amplitude by {:.2} %, from {small:.6} at {small_amplitude:.2e} to {large:.6} at {large_amplitude:.2e}, {:.1} standard errors apart; `stillbeam diagnose` looks for the reason",
                quantity.plain_words(),
                if large < small { "falls" } else { "rises" },
                100.0 * (large / small - 1.0).abs(),
                (small - large).abs() / stderr
            ),
            Self::FromPowerSpectrum { what, line_hz } => format!(
                "the modes come from {what}: they hold if the excitation was even around them; the window of the spectrum widens every peak, by about its lines' distance of {line_hz:.3} Hz or more, so that damping ratios are upper bounds; close modes merge; record the signal over time for modes to rely on"
            ),
            Self::PeakNarrowerThanLines { mode_hz, damping_ratio, line_hz } => format!(
                "mode at {mode_hz:.4} Hz: with a damping ratio of {damping_ratio:.6} its peak is {:.3} Hz wide and the lines of the spectrum are {line_hz:.3} Hz apart: a finer spectrum tells the damping",
                2.0 * damping_ratio * mode_hz
            ),
            Self::NotLinearNear { frequency_hz, times_floor } => format!(
                "not linear near {frequency_hz:.3} Hz: the fit leaves {times_floor:.0} times as much there as beside it, and a second mode there would only stand in for a frequency or damping that changes with amplitude or time; `stillbeam diagnose` looks for the reason"
            ),
            Self::BlowsOfFewSamples { frequency_hz, samples } => format!(
                "a blow lasts {samples} samples of the force, too few to know it between them: what the fit leaves near {frequency_hz:.3} Hz may come from that, and whether the structure is linear cannot be told; sample the force faster, or strike with a softer tip"
            ),
            Self::NotConstantNear { before_hz, after_hz, before_damping, after_damping, at_s } => {
                let when = match at_s {
                    Some(at_s) => format!("around {at_s:.2} s"),
                    None => "while the record runs".to_owned(),
                };
                format!(
                    "not constant in time near {before_hz:.3} Hz: a mode that changes {when} from {before_hz:.4} Hz and a damping ratio of {before_damping:.5} to {after_hz:.4} Hz and {after_damping:.5} explains more than one that goes with its amplitude; the mode that is listed lies between; look for what changed (load, temperature, a joint), or fit the parts before and after on their own"
                )
            }
            Self::NotLinearOrNotConstantNear { frequency_hz } => format!(
                "not linear or not constant in time near {frequency_hz:.3} Hz: a mode that goes with its amplitude and something that changes with time (the mode, or the recorder's clock) explain this record about alike, and the record cannot tell which; record the same excitation again at half the amplitude"
            ),
            Self::StampsMayNotBeSeconds { recording, interval_s } => format!(
                "{recording}: its samples are {interval_s:.4} s apart, so that nothing above {:.3} Hz is seen; if the stamps are milliseconds, divide them by 1000",
                0.5 / interval_s
            ),
            Self::InputGap { start_s, length_s } => format!(
                "the input is missing for {length_s:.4} s from {start_s:.4} s on and was interpolated there"
            ),
        }
    }
}
