//! The fit of a free decay: its modes from where they start, those that the record bears out, and what stands
//! out of what they leave.

use nalgebra::DMatrix;

use crate::decay_model::DecayModel;
use crate::decay_modes::{Part, Uniform, find_parts};
use crate::error::IdentifyError;
use crate::forced_fit::MAX_MODES;
use crate::forced_model::{pole, pole_parameters};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::narrow_band::WholeSpectrum;
use crate::noise::{Refined, refine};
use crate::result::Rejected;
use crate::ringing::{DecayRecord, Ringing};
use crate::separable::{Projected, fit, fit_covariance};
use crate::tall::dot;
use crate::whitening::{Whitener, even_runs};

/// How often what a fit leaves is searched.
const ROUNDS: usize = 3;
/// How near a find may be to a known mode, as a share of its frequency, and how small beside it, as a share
/// of its energy, to be what that mode leaves because it does not decay as a linear one does.
const LEFTOVER: (f64, f64) = (0.05, 0.1);
/// How near, as a share, to a multiple of a mode's frequency a find of that small an energy is its harmonic,
/// and the highest multiple.
const HARMONIC: (f64, f64) = (3e-3, 7.0);
/// Standard errors that a mode's amplitude is at least: what only the gaps between samples seem to hold has
/// less.
const STANDS_OUT: f64 = 5.0;
/// Share of the energy of the loudest mode that a find has at least.
const HEARD: f64 = 1e-5;

/// Modes of a decay, fitted.
pub(crate) struct DecayFit {
    pub(crate) parts: Vec<Part>,
    pub(crate) minimum: Minimum<Projected>,
    pub(crate) refined: Refined,
}

impl DecayFit {
    /// Fits the modes and takes out, one round after the other, those that the whole record does not bear
    /// out.
    ///
    /// # Errors
    /// [`IdentifyError`] where too few are left, or the record does not determine them.
    pub(crate) fn of(
        record: &DecayRecord,
        mut parts: Vec<Part>,
        requested: Option<usize>,
        rejected: &mut Vec<Rejected>,
    ) -> Result<Self, IdentifyError> {
        let mut range = search_range(&parts);
        loop {
            refuse_too_few(record, requested, &parts)?;
            let model = DecayModel::of(record, parts.len(), lowest_hz(&parts));
            let minimum = fit(&model, &range).ok_or_else(|| IdentifyError::NotComputable {
                recording: record.name.clone(),
                column: record.column.clone(),
            })?;
            let covariance = fit_covariance(&model, &minimum);
            // What the whole record does not bear out was a leftover of a neighbour: fit again without it.
            let kept = borne_out(&minimum, covariance.as_ref(), &range, &record.time_s, loudest(&parts));
            if kept.iter().all(|kept| *kept) {
                let runs = even_runs(&record.time_s, 0);
                let whitener = Whitener::of(&minimum.point.residuals, runs);
                let refined = refine(&model, &minimum, &range, whitener).or_refused(
                    record.name.clone(),
                    &record.column,
                    parts.len(),
                )?;
                return Ok(Self { parts, minimum, refined });
            }
            for (mode, _) in kept.iter().enumerate().filter(|(_, kept)| !**kept) {
                let pole = pole(&minimum.parameters, mode);
                rejected.push(Rejected::Pole {
                    frequency_hz: pole.frequency_hz,
                    damping_ratio: Some(pole.damping_ratio),
                    reason: "the fit of the whole decay does not bear it out: it ran to the edge of its band or its damping stayed unknown".to_owned(),
                });
            }
            for (parameter, found) in range.iter_mut().zip(&minimum.parameters) {
                parameter.start = *found;
            }
            let mut index = 0..;
            range.retain(|_| index.next().is_none_or(|index: usize| kept[index / 2]));
            let mut index = 0..;
            parts.retain(|_| index.next().is_none_or(|index: usize| kept[index]));
        }
    }

    /// The fit with what stands out of what it leaves, as long as the record bears that out.
    pub(crate) fn with_what_it_leaves(
        mut self,
        ringing: &Ringing,
        record: &DecayRecord,
        uniform: &Uniform,
        rejected: &mut Vec<Rejected>,
    ) -> Self {
        for _ in 0..ROUNDS {
            let mut fresh = self.left_standing(record, rejected);
            fresh.retain(|part| !ringing.is_tone(part.pole.frequency_hz, uniform.bin_hz()));
            fresh.truncate(MAX_MODES.saturating_sub(self.parts.len()));
            if fresh.is_empty() {
                break;
            }
            let mut parts: Vec<Part> = self.fitted_parts().chain(fresh).collect();
            parts.sort_by(|a, b| a.pole.frequency_hz.total_cmp(&b.pole.frequency_hz));
            match Self::of(record, parts, None, rejected) {
                Ok(wider) if wider.parts.len() > self.parts.len() => self = wider,
                _ => break,
            }
        }
        self
    }

    /// The parts where the fit took them.
    fn fitted_parts(&self) -> impl Iterator<Item = Part> {
        let at = |mode: usize| pole(&self.minimum.parameters, mode);
        self.parts.iter().enumerate().map(move |(mode, part)| Part { pole: at(mode), ..*part })
    }

    /// What stands out of what the fit leaves and is neither left by a mode that is not linear nor one of its
    /// harmonics.
    fn left_standing(&self, record: &DecayRecord, rejected: &mut Vec<Rejected>) -> Vec<Part> {
        let left = Uniform::new(&record.time_s, &self.minimum.point.residuals);
        let known: Vec<Part> = self.fitted_parts().collect();
        let loudest = known.iter().map(|part| part.energy).fold(0.0, f64::max);
        let mut fresh = find_parts(&left, None, &mut Vec::new());
        fresh.retain(|part| {
            if let Some(reason) = known.iter().find_map(|known| is_made_by(part, known)) {
                rejected.push(Rejected::Pole {
                    frequency_hz: part.pole.frequency_hz,
                    damping_ratio: Some(part.pole.damping_ratio),
                    reason,
                });
                return false;
            }
            part.energy > HEARD * loudest
        });
        fresh
    }
}

/// Why a find is what a known mode makes of itself, if it is.
fn is_made_by(part: &Part, known: &Part) -> Option<String> {
    let (hz, known_hz) = (part.pole.frequency_hz, known.pole.frequency_hz);
    if part.energy > LEFTOVER.1 * known.energy {
        return None;
    }
    if (hz - known_hz).abs() < LEFTOVER.0 * known_hz {
        return Some("a leftover of the mode beside it, which does not decay as a linear one".to_owned());
    }
    let order = (hz / known_hz).round();
    let is_multiple =
        (2.0..=HARMONIC.1).contains(&order) && (hz / (order * known_hz) - 1.0).abs() < HARMONIC.0;
    is_multiple.then(|| format!("the harmonic {order} of the mode at {known_hz:.4} Hz, which is not linear"))
}

/// Frequency of the slowest mode, Hz.
pub(crate) fn lowest_hz(parts: &[Part]) -> f64 {
    parts.iter().map(|part| part.pole.frequency_hz).fold(f64::INFINITY, f64::min)
}

/// How much larger the damping of the whole record may be than that of a mode's band alone.
const DAMPING_FACTOR: f64 = 5.0;

/// The bounds of the search: every mode inside its own band, its damping within a factor of what the band
/// said. Wider bounds let a poorly determined mode turn into a patch for its neighbours' misfit.
fn search_range(parts: &[Part]) -> Vec<Parameter> {
    let range = |part: &Part| {
        let reach = (part.half_width_hz / part.pole.frequency_hz).min(0.2);
        let [frequency, mut damping] = pole_parameters(part.pole, reach);
        damping.upper = damping.upper.min(damping.start + DAMPING_FACTOR.ln());
        [frequency, damping]
    };

    parts.iter().flat_map(range).collect()
}

/// Place of the part with the most energy.
fn loudest(parts: &[Part]) -> Option<usize> {
    (0..parts.len()).max_by(|&a, &b| parts[a].energy.total_cmp(&parts[b].energy))
}

/// Which modes the fit of the whole record determines: inside their range, damping known to better than half,
/// and an amplitude that stands out of its error. The loudest one does in any case: what it leaves by not
/// being linear makes its own error large.
fn borne_out(
    minimum: &Minimum<Projected>,
    covariance: Option<&DMatrix<f64>>,
    range: &[Parameter],
    time_s: &[f64],
    loudest: Option<usize>,
) -> Vec<bool> {
    let left = &minimum.point.residuals;
    let power = dot(left, left) / left.len().max(1) as f64;
    let uniform = Uniform::new(time_s, left);
    let spectrum = WholeSpectrum::new(uniform.samples(), uniform.interval_s);
    // A drift or a line elsewhere makes nothing uncertain here.
    let heard = |mode: usize| {
        let amplitudes = &minimum.point.coefficients[2 * mode..2 * mode + 2];
        let at = |side: usize| range.len() + 2 * mode + side;
        let near = spectrum.noise_variance_near(pole(&minimum.parameters, mode).frequency_hz);
        let share = (near / power.max(f64::MIN_POSITIVE)).min(1.0);
        let variance = |c: &DMatrix<f64>| share * c[(at(0), at(0))].max(c[(at(1), at(1))]).max(0.0);
        covariance.is_none_or(|c| amplitudes[0].hypot(amplitudes[1]) > STANDS_OUT * variance(c).sqrt())
    };
    (0..range.len() / 2)
        .map(|mode| {
            let (frequency, damping) = (2 * mode, 2 * mode + 1);
            let found = &minimum.parameters;
            let inside = found[frequency] > range[frequency].lower + 1e-9
                && found[frequency] < range[frequency].upper - 1e-9
                && found[damping] < range[damping].upper - 1e-9;
            let tone = pole(found, mode).decay_time_s() > 10.0 * (time_s[time_s.len() - 1] - time_s[0]);
            let relative = covariance.map(|c| c[(damping, damping)].max(0.0).sqrt());
            inside
                && (loudest == Some(mode) || heard(mode))
                && (tone || relative.is_none_or(|stderr| stderr < 0.5))
        })
        .collect()
}

fn refuse_too_few(
    record: &DecayRecord,
    requested: Option<usize>,
    parts: &[Part],
) -> Result<(), IdentifyError> {
    let (recording, column) = (record.name.clone(), record.column.clone());
    match requested {
        Some(requested) if parts.len() < requested => Err(IdentifyError::TooFewPeaks {
            recording,
            column,
            requested,
            found: parts.len(),
            frequencies_hz: parts.iter().map(|part| part.pole.frequency_hz).collect(),
        }),
        _ if parts.is_empty() => Err(IdentifyError::NoPeaks { recording, column }),
        _ => Ok(()),
    }
}
