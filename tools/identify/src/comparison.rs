//! Do recordings of the same structure, at other levels of excitation perhaps, agree?

use crate::result::IdentifiedModes;
use crate::warnings::{Quantity, Warning, WarningKind};

/// Modes of two recordings this close (share of the frequency) are the same mode.
const SAME_MODE: f64 = 0.1;
/// Differences below these shares do not matter to a shaper, however sharp the intervals.
const MATTERS: [f64; 2] = [0.001, 0.1];

/// Warns of modes whose frequency or damping differ between recordings by more than three standard errors
/// and by an amount that matters (0.1 % of a frequency, 10 % of a damping): the mark of a structure that is
/// not linear. Every recording is compared with the first.
pub fn compare_recordings(results: &[IdentifiedModes]) -> Vec<Warning> {
    let Some((reference, others)) = results.split_first() else {
        return Vec::new();
    };
    let mut warnings = Vec::new();
    for mode in &reference.modes {
        let mode_hz = mode.frequency_hz.value;
        for other in others {
            let away = |f: f64| (f - mode_hz).abs();
            let nearest = other
                .modes
                .iter()
                .min_by(|a, b| away(a.frequency_hz.value).total_cmp(&away(b.frequency_hz.value)));
            let Some(twin) = nearest.filter(|twin| away(twin.frequency_hz.value) < SAME_MODE * mode_hz)
            else {
                continue;
            };
            let pairs = [
                (Quantity::FrequencyHz, mode.frequency_hz, twin.frequency_hz),
                (Quantity::DampingRatio, mode.damping_ratio, twin.damping_ratio),
            ];
            for ((quantity, first, second), share) in pairs.into_iter().zip(MATTERS) {
                let matters = (first.value - second.value).abs() > share * first.value.abs();
                if matters && first.distance(&second) > 3.0 {
                    let kind = WarningKind::RecordingsDisagree {
                        mode_hz,
                        quantity,
                        first: first.value,
                        second: second.value,
                        stderr: first.stderr.hypot(second.stderr),
                        first_amplitude: mode.amplitude.value,
                        second_amplitude: twin.amplitude.value,
                    };
                    warnings.push(kind.into());
                }
            }
        }
    }
    warnings
}
