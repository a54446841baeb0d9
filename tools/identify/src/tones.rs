//! Lines of a spectrum that are driven and not structural: forced tones.
//!
//! A mode left alone decays; what keeps its amplitude over many periods is driven. A line is called a tone
//! when its own band holds its amplitude over a stretch of the record and either ends abruptly, faster than
//! anything that rings so long could, or shows no decay at all, or keeps step with the mains or with another
//! tone.

use crate::decay_modes::Uniform;
use crate::modal_response::{Pole, free_response};
use crate::narrow_band::{NarrowBand, WholeSpectrum};
use crate::result::{Estimate, Rejected};
use crate::spectra::{Window, density, local_median, peaks, prominence};
use crate::tall::Orthonormal;
use crate::warnings::{Warning, WarningKind};

/// A driven line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tone {
    pub(crate) frequency_hz: Estimate,
    /// Damping ratio that its width would mean.
    pub(crate) damping_ratio: f64,
    /// When it sounds, s from the beginning of the record.
    pub(crate) window_s: [f64; 2],
    pub(crate) reason: String,
    /// Whether it is a steady multiple of a mains frequency.
    pub(crate) is_hum: bool,
}

impl Tone {
    /// A line that was fitted beside the modes, where it keeps step with the mains and does not decay over
    /// the record as far as that can be told.
    pub(crate) fn of_line(
        frequency_hz: Estimate,
        damping_ratio: Estimate,
        window_s: [f64; 2],
    ) -> Option<Self> {
        let length_s = window_s[1] - window_s[0];
        let radians = std::f64::consts::TAU * frequency_hz.value * length_s;
        let fall = damping_ratio.value * radians;
        let told_from_none = (UNSURE * damping_ratio.stderr * radians).clamp(STAYS, FALL);
        let multiple = mains_multiple(frequency_hz.value, UNSURE * frequency_hz.stderr)?;
        (fall < told_from_none).then(|| Self {
            frequency_hz,
            damping_ratio: damping_ratio.value,
            window_s,
            reason: format!("it does not decay within {length_s:.2} s; it is {multiple}"),
            is_hum: true,
        })
    }

    /// Whether a frequency is this line's, within a bin or two of a spectrum.
    pub(crate) fn is_at(&self, frequency_hz: f64, bin_hz: f64) -> bool {
        (self.frequency_hz.value - frequency_hz).abs() < (2.0 * bin_hz).min(0.01 * frequency_hz)
    }

    /// What a reader must know, and the entry in the list of what is not in the result.
    pub(crate) fn told(&self) -> (Warning, Rejected) {
        let frequency_hz = self.frequency_hz.value;
        let reason = self.reason.clone();
        let pole = Rejected::Pole {
            frequency_hz,
            damping_ratio: Some(self.damping_ratio),
            reason: format!("a forced tone: {reason}"),
        };
        (WarningKind::ToneInRecord { frequency_hz, reason }.into(), pole)
    }
}

/// What tones may be over time. Their frequency is known to a share of a turn over the record only: what that
/// leaves grows with time.
pub(crate) fn tones_over<'t>(tones: impl Iterator<Item = &'t Tone>, time_s: &[f64]) -> Orthonormal {
    let since: Vec<f64> = time_s.iter().map(|t| t - time_s[0]).collect();
    let mut basis = Orthonormal::default();
    for tone in tones {
        let pole = Pole { frequency_hz: tone.frequency_hz.value, damping_ratio: 0.0 };
        for column in free_response(pole, 0.0, &since) {
            let turned: Vec<f64> = column.iter().zip(&since).map(|(y, t)| y * t).collect();
            basis.push(column);
            basis.push(turned);
        }
    }
    basis
}

/// Takes the hum of the mains out of a signal; whether there was any.
pub(crate) fn take_hum_out(time_s: &[f64], values: &mut [f64]) -> bool {
    let tones = find_tones(&Uniform::new(time_s, values));
    tones_over(tones.iter().filter(|tone| tone.is_hum), time_s).remove_from(values);
    tones.iter().any(|tone| tone.is_hum)
}

/// Peaks this far above the floor around them (a power ratio, 14 dB) are looked at, so many at most.
const ABOVE_FLOOR: f64 = 25.0;
const MOST: usize = 10;
/// Share of its largest amplitude that a tone holds while it sounds; a drive that speeds up and slows down
/// modulates it.
const HELD: f64 = 0.25;
/// Nepers by which a tone's amplitude may fall over its stretch.
const FALL: f64 = 0.3;
/// Nepers below which it does not fall, and standard errors within which a fitted value may lie elsewhere.
const STAYS: f64 = 0.05;
const UNSURE: f64 = 3.0;
/// Band samples and periods that a stretch must have.
const SAMPLES: usize = 12;
const PERIODS: f64 = 25.0;
/// Share of the stretch's energy that one steady oscillation must explain.
const STEADY: f64 = 0.6;
/// How near, as a share, a line must be to a multiple of the mains or of another tone.
const LOCKED: f64 = 2e-3;

/// The forced tones of a uniform record.
pub(crate) fn find_tones(uniform: &Uniform) -> Vec<Tone> {
    let signal = uniform.without_mean();
    let n = signal.len();
    let segment = (n / 8).max(n.min(512));
    let spectrum = density(&signal, uniform.interval_s, segment, Window::Hann).density;
    let bin_hz = 1.0 / (segment as f64 * uniform.interval_s);
    let whole = WholeSpectrum::new(&signal, uniform.interval_s);
    let standing = peaks(&spectrum, 2).into_iter().filter(|&k| {
        k > 3
            && prominence(&spectrum, k) > 4.0
            && spectrum[k] > ABOVE_FLOOR * local_median(&spectrum, k, (k / 3).max(24))
    });
    let held: Vec<Held> =
        standing.take(MOST).filter_map(|k| held(&whole, k as f64 * bin_hz, bin_hz)).collect();
    held.iter().filter_map(|line| line.as_tone(&held)).collect()
}

/// A line that keeps its amplitude for a while.
struct Held {
    frequency_hz: Estimate,
    damping_ratio: f64,
    window_s: [f64; 2],
    /// Nepers by which it falls over its stretch.
    fall: f64,
    /// Whether one steady oscillation explains it.
    steady: bool,
    /// Whether it ends faster than it could ring down.
    abrupt: bool,
}

fn held(whole: &WholeSpectrum, frequency_hz: f64, bin_hz: f64) -> Option<Held> {
    let band = whole.narrow_band(frequency_hz, (4.0 * bin_hz).min(0.4 * frequency_hz), 2);
    // A drive that reverses modulates its tone; over a sixteenth of the record it is as loud as ever.
    let width = (band.amplitude.len() / 16).max(1);
    let size = moving_rms(&band, width);
    let largest = size.iter().fold(0.0_f64, |top, a| top.max(*a));
    let (start, end) = longest_run(&size, HELD * largest)?;
    // The taper of the band smears the ends over a few samples.
    let inner = start + 2..end.saturating_sub(2);
    let step_s = band.time_s.get(1)? - band.time_s[0];
    let length_s = (end - start) as f64 * step_s;
    if inner.len() < SAMPLES.max(4 * width) || length_s * frequency_hz < PERIODS {
        return None;
    }
    let found = band.fit(inner.clone())?;
    let steady = found.explained > STEADY;
    let omega = std::f64::consts::TAU * found.pole.frequency_hz;
    let fall = match steady {
        true => found.damping_ratio.value * omega * length_s,
        false => fall_of(&size[inner]),
    };
    let abrupt = ends_abruptly(&size, (start, end), width);
    if is_beat(whole, frequency_hz) {
        return None;
    }
    (steady || abrupt).then(|| Held {
        frequency_hz: if steady {
            found.frequency_hz
        } else {
            Estimate { value: frequency_hz, stderr: bin_hz }
        },
        damping_ratio: fall / (omega * length_s),
        window_s: [band.time_s[start], band.time_s[end - 1]],
        fall,
        steady,
        abrupt,
    })
}

/// Half of the band in which a beat is looked for, as a share of its frequency.
const BEAT_BAND: f64 = 0.1;
/// Share of the energy from the loudest moment on that the two modes of a beat explain, and that comes before
/// it at most.
const BEAT: (f64, f64) = (0.9, 0.2);

/// Whether two close modes that both decay explain a line: they beat, and a beat ends at once as a drive
/// does.
fn is_beat(whole: &WholeSpectrum, frequency_hz: f64) -> bool {
    let band = whole.narrow_band(frequency_hz, BEAT_BAND * frequency_hz, 1);
    let size = |k: &usize| band.amplitude[*k].norm_sqr();
    let Some(loudest) = (0..band.amplitude.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else {
        return false;
    };
    let before: f64 = (0..loudest).map(|k| size(&k)).sum();
    let Some(values) = band.values(loudest.max(1)..band.amplitude.len().saturating_sub(1)) else {
        return false;
    };
    let energy = values.energy();
    before < BEAT.1 * energy
        && values.clear_pair().is_some_and(|pair| {
            let length_s = values.time_s.last().unwrap_or(&0.0) - values.time_s.first().unwrap_or(&0.0);
            let decays = pair.rates.iter().all(|rate| -rate.re * length_s > FALL);
            decays && pair.sum_of_squares < (1.0 - BEAT.0) * energy
        })
}

/// Root of the mean square over `width` samples around each.
fn moving_rms(band: &NarrowBand, width: usize) -> Vec<f64> {
    let power: Vec<f64> = band.amplitude.iter().map(|z| z.norm_sqr()).collect();
    (0..power.len())
        .map(|k| {
            let around = &power[k.saturating_sub(width / 2)..(k + width.div_ceil(2)).min(power.len())];
            (around.iter().sum::<f64>() / around.len() as f64).sqrt()
        })
        .collect()
}

/// Nepers by which an amplitude falls over a stretch, from its first to its last third.
fn fall_of(size: &[f64]) -> f64 {
    let third = (size.len() / 3).max(1);
    let mean = |some: &[f64]| some.iter().sum::<f64>() / some.len() as f64;
    1.5 * (mean(&size[..third]) / mean(&size[size.len() - third..])).ln()
}

/// The longest run of samples above a level.
fn longest_run(size: &[f64], level: f64) -> Option<(usize, usize)> {
    let mut best = None;
    let mut start = None;
    for k in 0..=size.len() {
        match (size.get(k).is_some_and(|a| *a >= level), start) {
            (true, None) => start = Some(k),
            (false, Some(from)) => {
                if best.is_none_or(|(a, b)| k - from > b - a) {
                    best = Some((from, k));
                }
                start = None;
            }
            _ => {}
        }
    }
    best
}

/// Whether the amplitude is gone within a sixth of the stretch over which it was held.
fn ends_abruptly(size: &[f64], (start, end): (usize, usize), width: usize) -> bool {
    let stretch = &size[start..end];
    let level = stretch.iter().sum::<f64>() / stretch.len().max(1) as f64;
    let after = (end + ((end - start) / 6).max(width).max(4)).min(size.len().saturating_sub(1));
    after >= end + width && size.get(after).is_some_and(|a| *a < 0.2 * level)
}

impl Held {
    /// Why the line is a tone, if it is one.
    fn as_tone(&self, all: &[Held]) -> Option<Tone> {
        if self.fall > FALL {
            return None;
        }
        let [from_s, to_s] = self.window_s;
        let mut reasons = Vec::new();
        if self.abrupt {
            reasons.push(format!(
                "it keeps its amplitude from {from_s:.2} s to {to_s:.2} s and then stops at once, as nothing does that rings freely"
            ));
        }
        if self.steady && self.fall.abs() < STAYS {
            reasons.push(format!("it does not decay within {:.2} s", to_s - from_s));
        }
        let multiple = mains_multiple(self.frequency_hz.value, 0.0).filter(|_| self.steady);
        let is_hum = multiple.is_some();
        if let Some(multiple) = multiple {
            reasons.push(format!("it is {multiple}"));
        }
        if let Some((order, base_hz)) = self.harmonic_of(all).filter(|_| self.steady) {
            reasons.push(format!("it keeps step with the line at {base_hz:.2} Hz as its harmonic {order}"));
        }
        (!reasons.is_empty()).then(|| Tone {
            frequency_hz: self.frequency_hz,
            damping_ratio: self.damping_ratio,
            window_s: self.window_s,
            reason: reasons.join("; "),
            is_hum,
        })
    }

    fn harmonic_of(&self, all: &[Held]) -> Option<(f64, f64)> {
        all.iter().find_map(|other| {
            let ratio = self.frequency_hz.value / other.frequency_hz.value;
            let order = ratio.round();
            ((2.0..=8.0).contains(&order) && (ratio / order - 1.0).abs() < LOCKED)
                .then_some((order, other.frequency_hz.value))
        })
    }
}

/// Which multiple of a mains frequency a line is, if it is one of the first dozen; its frequency may be off
/// by so many Hz.
fn mains_multiple(frequency_hz: f64, off_hz: f64) -> Option<String> {
    [50.0, 60.0].into_iter().find_map(|mains_hz: f64| {
        let order = (frequency_hz / mains_hz).round();
        let near = (frequency_hz / (order * mains_hz) - 1.0).abs();
        let near = near < LOCKED + off_hz / frequency_hz;
        ((1.0..=12.0).contains(&order) && near).then(|| format!("{order} times the mains' {mains_hz} Hz"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn uniform(signal: impl Fn(f64) -> f64) -> Uniform {
        let time_s: Vec<f64> = (0..6000).map(|k| f64::from(k) / 2000.0).collect();
        let mut state = 7_u64;
        let values: Vec<f64> = time_s
            .iter()
            .map(|t| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                signal(*t) + 0.1 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
            })
            .collect();
        Uniform::new(&time_s, &values)
    }

    #[test]
    fn a_line_that_stops_at_once_and_its_harmonic_are_tones() {
        let found = find_tones(&uniform(|t| match t {
            0.5..2.0 => (TAU * 353.7 * t).sin() + 0.5 * (TAU * 707.4 * t).cos(),
            _ => 0.0,
        }));
        let frequencies: Vec<f64> = found.iter().map(|tone| tone.frequency_hz.value).collect();
        for wanted in [353.7, 707.4] {
            assert!(frequencies.iter().any(|f| (f - wanted).abs() < 0.1), "{found:?}");
        }
        assert!(found.iter().all(|tone| tone.reason.contains("at once")), "{found:?}");
    }

    #[test]
    fn a_fitted_line_is_hum_where_it_keeps_step_with_the_mains_and_may_not_fall_and_a_mode_else() {
        let exactly = |value: f64| Estimate { value, stderr: 1e-3 * value };
        let is_hum = |hz: f64, damping: Estimate, length_s: f64| {
            Tone::of_line(exactly(hz), damping, [1.0, 1.0 + length_s]).is_some()
        };
        for hz in [50.0, 60.03, 99.95, 180.1] {
            assert!(is_hum(hz, exactly(1e-6), 1.5), "{hz}");
            // Falls by 0.2 nepers within an error of 0.1.
            let unsure = 0.1 / (TAU * hz * 1.5);
            assert!(is_hum(hz, Estimate { value: 2.0 * unsure, stderr: unsure }, 1.5), "{hz}");
            assert!(!is_hum(hz, exactly(1e-3), 1.5), "{hz}");
            assert!(!is_hum(1.07 * hz, exactly(1e-6), 1.5), "{hz}");
        }
    }

    #[test]
    fn hum_is_a_tone_and_modes_of_any_damping_are_not() {
        let found = find_tones(&uniform(|t| (TAU * 100.0 * t).sin()));
        assert!(found[0].reason.contains("2 times the mains"), "{found:?}");
        for damping in [0.0005, 0.002, 0.01, 0.05] {
            let ringing = |t: f64| (-damping * TAU * 353.7 * t).exp() * (TAU * 353.7 * t).sin();
            assert!(
                find_tones(&uniform(ringing)).is_empty(),
                "{damping}: {:?}",
                find_tones(&uniform(ringing))
            );
        }
    }
}
