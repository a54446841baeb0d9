//! What each warning says to people.

use crate::warnings::{FastPassage, WarningKind};

impl WarningKind {
    pub(crate) fn sentence(&self) -> String {
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
                "{recording}: {count} samples are missing in {gaps} gaps of the time stamps, the longest {longest_s:.4} s after {at_s:.4} s; nothing was put in their place"
            ),
            Self::PeakWithoutMode { column, frequency_hz, above_db, power_share } => format!(
                "column `{column}`: the peak at {frequency_hz:.3} Hz stands {above_db:.0} dB above its neighbourhood, holds {:.0} % of the power and is explained by no mode that is listed: a mode may be missing there, or something drives that frequency; record longer, or name more outputs",
                100.0 * power_share
            ),
            Self::OneStretchRead { recording, window_s } => format!(
                "{recording}: the stamps have gaps, and only the stretch without one from {:.4} s to {:.4} s was read; `--start` and `--end` choose another stretch, and a record without gaps gives more",
                window_s[0], window_s[1]
            ),
            Self::StretchesRead { recording, stretches, together_s } => format!(
                "{recording}: the stamps have gaps, and the {stretches} stretches between them ({together_s:.2} s together) were read, each on its own: nothing was drawn across a gap"
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
                "the input is missing for {length_s:.4} s from {start_s:.4} s on; what it did there is not known"
            ),
        }
    }
}
