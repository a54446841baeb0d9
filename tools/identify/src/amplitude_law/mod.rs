//! One mode whose frequency or damping goes with its amplitude: told from two modes by which of the two
//! explains more, and taken out of the record so that the rest of it is a linear structure's.
//!
//! The mode is advanced with a relative stiffness 1 + k h(A) and a relative damping 1 + d h(A), A being the
//! amplitude at each moment as a share of the largest, for a few laws h. What that differs by from the
//! linear mode at the mean amplitude is the correction: without it the record is one of a linear structure
//! with that mean mode.

mod fit;
mod in_time;
mod motion;
mod rivals;

use crate::amplitude::{AmplitudeChange, AmplitudePoint, CLEAR, MATTERS};
use crate::forced_model::{ForcedModel, pole};
use crate::forced_record::ForcedRecord;
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::Pole;
use crate::result::Estimate;
use crate::separable::Projected;
use crate::warnings::Quantity;
pub(crate) use fit::{again, dependence, may_depend};
pub(crate) use in_time::{InTime, in_time};
pub(crate) use rivals::{Change, judged};

/// How stiffness and damping go with the amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Law {
    /// In proportion: drag, for the damping.
    Proportional,
    /// A spring with a cubic share and a drag with the square of the speed, moment by moment.
    CubicAndDrag,
    /// Most at small amplitudes, as one over the amplitude far above the mean: friction, play.
    AtSmall,
}

const LAWS: [Law; 3] = [Law::Proportional, Law::CubicAndDrag, Law::AtSmall];

/// Amplitude, as a share of the largest, below which a law that is strong at small amplitudes stays level.
const LEVEL_BELOW: f64 = 0.1;
/// How near a further mode must be to one that may depend on amplitude, as a share of the frequency.
const NEAR: f64 = 0.1;
/// Share of the correction's power that its law may miss, and how far around the mode, as a ratio's
/// logarithm.
const MISSED: f64 = 0.02;
const AROUND: f64 = 0.25;
/// How far beside the frequencies of such a mode, as a share, there is no other.
const BESIDE: f64 = 0.03;
/// Points of the course over amplitude that are told.
const POINTS: u32 = 6;
/// Shares of the mode's motion below the amplitudes that count as small and as large, and below those between
/// which its course is told.
const SMALL_AND_LARGE: [f64; 2] = [0.1, 0.9];
const TOLD: [f64; 2] = [0.01, 0.99];

impl Law {
    /// What a steady vibration of an amplitude, as a share of the largest, feels of it: in its stiffness
    /// and in its damping.
    fn felt(self, share: f64) -> [f64; 2] {
        match self {
            Self::Proportional => [share; 2],
            Self::CubicAndDrag => [0.75 * share * share, 8.0 / (3.0 * std::f64::consts::PI) * share],
            Self::AtSmall => [LEVEL_BELOW / (LEVEL_BELOW + share); 2],
        }
    }
}

/// What a mode does with its amplitude.
#[derive(Debug, Clone)]
pub(crate) struct Dependence {
    /// The linear mode at the mean amplitude.
    pub(crate) mean: Pole,
    /// Whether something else explains the record about as well, so that none of the two can be told.
    pub(crate) is_unclear: bool,
    pub(crate) changes: Vec<AmplitudeChange>,
    pub(crate) points: Vec<AmplitudePoint>,
    course: Course,
    /// The largest amplitude of the modal coordinate, which the course's shares are of.
    reference: f64,
    /// What it leaves of the record.
    pub(crate) sum_of_squares: f64,
    /// What the output has because the mode is not the linear one of the mean amplitude, by row.
    correction: Vec<f64>,
}

impl Dependence {
    /// Takes out of the records what a linear mode does not do.
    pub(crate) fn take_out_of(&self, records: &mut [ForcedRecord]) {
        self.add_to(records, -1.0);
    }

    /// Gives the records back what was taken out.
    pub(crate) fn give_back_to(&self, records: &mut [ForcedRecord]) {
        self.add_to(records, 1.0);
    }

    fn add_to(&self, records: &mut [ForcedRecord], sign: f64) {
        let mut from = 0;
        for record in records {
            let rows = record.output.len();
            let part = &self.correction[from..from + rows];
            record.output.iter_mut().zip(part).for_each(|(y, c)| *y += sign * c);
            record.taken_out.resize(rows, 0.0);
            record.taken_out.iter_mut().zip(part).for_each(|(sum, c)| *sum -= sign * c);
            from += rows;
        }
    }

    /// The least sum of squares that a mode at a frequency must explain beside this one: no law holds
    /// exactly, and what it misses lies around the mode.
    pub(crate) fn missed_near(&self, frequency_hz: f64) -> f64 {
        let is_around = (frequency_hz / self.mean.frequency_hz).ln().abs() < AROUND;
        if is_around { MISSED * self.correction.iter().map(|c| c * c).sum::<f64>() } else { 0.0 }
    }

    /// Whether a frequency is this mode's at some amplitude.
    pub(crate) fn is_near(&self, frequency_hz: f64) -> bool {
        let beside = (2.0 * self.mean.damping_ratio).max(BESIDE);
        let [low, high] = self.range_hz();
        (low * (1.0 - beside)..=high * (1.0 + beside)).contains(&frequency_hz)
    }

    /// Where what no law explains of this mode lies, Hz, if a frequency is there.
    pub(crate) fn surroundings_of(&self, frequency_hz: f64) -> Option<[f64; 2]> {
        let [low, high] = self.range_hz();
        let band_hz = [low * (-AROUND).exp(), high * AROUND.exp()];
        (band_hz[0]..=band_hz[1]).contains(&frequency_hz).then_some(band_hz)
    }

    /// The mode's lowest and highest frequency, Hz.
    fn range_hz(&self) -> [f64; 2] {
        let frequencies = self.points.iter().map(|point| point.frequency_hz.value);
        let all = frequencies.chain([self.mean.frequency_hz]);
        all.fold([f64::INFINITY, 0.0], |[low, high], hz| [low.min(hz), high.max(hz)])
    }
}

/// The mode of a model that a further one at `frequency_hz` may stand in for.
pub(crate) fn nearest_mode(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    frequency_hz: f64,
) -> Option<usize> {
    let away = |mode: usize| (pole(&found.parameters, mode).frequency_hz / frequency_hz).ln().abs();
    let nearest = (0..model.modes).min_by(|a, b| away(*a).total_cmp(&away(*b)))?;
    let width = 4.0 * pole(&found.parameters, nearest).damping_ratio;
    (away(nearest) < NEAR.max(width)).then_some(nearest)
}

/// What a stiffness and a damping go with.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cause {
    Amplitude(Law),
    Time(Moment),
}

/// When a change in time happens, as shares of all records' time.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Moment {
    /// Evenly from the first sample to the last.
    Throughout,
    /// Around a moment, within a width.
    Around { moment: f64, width: f64 },
}

impl Moment {
    /// How much of the change has happened.
    fn felt(self, share: f64) -> f64 {
        match self {
            Self::Throughout => share,
            Self::Around { moment, width } => 1.0 / (1.0 + ((moment - share) / width).exp()),
        }
    }
}

/// A law with its numbers.
#[derive(Debug, Clone, Copy)]
struct Course {
    cause: Cause,
    /// At no amplitude, or before the change.
    pole: Pole,
    stiffness: f64,
    damping: f64,
}

impl Course {
    /// What is felt at a share of the largest amplitude, or of the time.
    fn felt(self, share: f64) -> [f64; 2] {
        match self.cause {
            Cause::Amplitude(law) => law.felt(share),
            Cause::Time(moment) => [moment.felt(share); 2],
        }
    }

    /// Frequency and damping at a share of the largest amplitude.
    fn at(self, share: f64) -> Pole {
        self.feeling(self.felt(share))
    }

    fn feeling(self, [of_stiffness, of_damping]: [f64; 2]) -> Pole {
        let stiffer = (1.0 + self.stiffness * of_stiffness).max(motion::LEAST).sqrt();
        let damped = (1.0 + self.damping * of_damping).max(motion::LEAST);
        Pole {
            frequency_hz: self.pole.frequency_hz * stiffer,
            damping_ratio: self.pole.damping_ratio * damped / stiffer,
        }
    }

    /// The course with the standard errors of ln f, ln zeta, k and d.
    fn point(self, share: f64, errors: [f64; 4]) -> [Estimate; 2] {
        let ([spring, drag], here) = (self.felt(share), self.at(share));
        let [frequency, damping, k, d] = errors;
        let of_stiffness = 0.5 * spring * k / (1.0 + self.stiffness * spring).max(motion::LEAST);
        let of_damping = drag * d / (1.0 + self.damping * drag).max(motion::LEAST);
        [
            Estimate { value: here.frequency_hz, stderr: here.frequency_hz * frequency.hypot(of_stiffness) },
            Estimate {
                value: here.damping_ratio,
                stderr: here.damping_ratio * damping.hypot(of_damping).hypot(of_stiffness),
            },
        ]
    }
}

/// Amplitudes below which the given shares of a motion lie, each moment weighed by its amplitude.
fn quantiles(amplitude: &[f64], shares: [f64; 2]) -> [f64; 2] {
    let mut sorted = amplitude.to_vec();
    sorted.sort_by(f64::total_cmp);
    let total: f64 = sorted.iter().sum();
    shares.map(|share| {
        let mut below = 0.0;
        let reached = sorted.iter().find(|a| {
            below += **a;
            below >= share * total
        });
        reached.copied().unwrap_or(0.0)
    })
}

/// What changes clearly, and enough to matter, from the small to the large amplitudes; with points between.
fn told(
    course: Course,
    errors: [f64; 4],
    amplitude: &[f64],
    unit: f64,
    window_s: [f64; 2],
) -> (Vec<AmplitudeChange>, Vec<AmplitudePoint>) {
    let [least, most] = quantiles(amplitude, TOLD);
    let ratio = (most / least.max(f64::MIN_POSITIVE)).max(1.0);
    let points = (0..POINTS)
        .map(|k| {
            let share = least * ratio.powf(f64::from(k) / f64::from(POINTS - 1));
            let [frequency_hz, damping_ratio] = course.point(share, errors);
            AmplitudePoint { amplitude: share * unit, window_s, frequency_hz, damping_ratio }
        })
        .collect();
    let [small, large] = quantiles(amplitude, SMALL_AND_LARGE);
    let (from, to) = (course.point(small, errors), course.point(large, errors));
    let (less, more) = (course.felt(small), course.felt(large));
    let [of_stiffness, of_damping] = [0, 1].map(|index: usize| (more[index] - less[index]).abs());
    let quantities = [
        (Quantity::FrequencyHz, 0.5 * errors[2] * of_stiffness),
        (Quantity::DampingRatio, errors[3] * of_damping),
    ];
    let changes = quantities.into_iter().zip(MATTERS).zip(from.into_iter().zip(to)).filter_map(
        |(((quantity, error), share), (small_value, large_value))| {
            let change = (large_value.value / small_value.value).ln().abs();
            (change > share && change > CLEAR * error).then_some(AmplitudeChange {
                quantity,
                small: small_value,
                large: large_value,
                small_amplitude: small * unit,
                large_amplitude: large * unit,
            })
        },
    );
    (changes.collect(), points)
}
