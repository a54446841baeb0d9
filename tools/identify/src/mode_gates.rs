//! What a further mode must stand before it counts: that it is none that is there already, that another part
//! of the record confirms it, and that it does not stand in for something that is not linear.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::decay_modes::Uniform;
use crate::forced_model::{ForcedModel, MIN_DAMPING, pole};
use crate::input_rest::blow_starts;
use crate::levenberg_marquardt::Minimum;
use crate::modal_response::Pole;
use crate::separable::Projected;
use crate::spectra::{Window, density};
use crate::tall::dot;

/// Poles nearer to each other than this share of the lesser decay rate are one.
const SAME_POLE: f64 = 0.1;
/// How near to each other, as a share of the frequency, two modes may be one that is not linear.
const NEAR: f64 = 0.06;
/// Half-power bands around overlapping modes in which what is left is compared with what is left beside them.
const WITHIN: f64 = 2.0;
/// How many times the power beside them may be left within: an average of a few bins of noise over a median
/// of many.
const ABOVE_FLOOR: f64 = 6.0;
/// Reach of the surroundings, as a ratio of frequencies, and the least number of bins on either side.
const BESIDE: f64 = 1.5;
const BESIDE_BINS: usize = 32;
/// Steps of the sensor that noise has at least where it makes motions visible that are smaller than one.
const HALF: f64 = 0.5;
/// Stretches of every record of which every other one is held out.
const STRETCHES: usize = 32;
/// Share of what a mode explains that it must explain of the stretches held out.
const CONFIRMED: f64 = 0.3;

/// Something that one mode does not explain and a second one must not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NotLinear {
    pub(crate) frequency_hz: f64,
    pub(crate) times_floor: f64,
}

/// Why the last mode of a fit is none of the structure's; with what the structure does instead where it does
/// something.
pub(crate) fn refusal_of_last(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
) -> Option<(String, Option<NotLinear>)> {
    let poles: Vec<Pole> = (0..model.modes).map(|mode| pole(&found.parameters, mode)).collect();
    if let Some(at_limit) = poles.iter().find(|pole| pole.damping_ratio <= 1.01 * MIN_DAMPING) {
        let reason = format!(
            "at {:.4} Hz the damping ratio would be the limit of the search: a line of this record, not a mode",
            at_limit.frequency_hz
        );
        return Some((reason, None));
    }
    if let Some(reason) = below_a_step(model, found, poles.len().saturating_sub(1)) {
        return Some((reason, None));
    }
    let pairs = (0..poles.len()).flat_map(|a| (0..a).map(move |b| [a, b]));
    pairs.map(|pair| pair.map(|mode| poles[mode])).find_map(|[a, b]| overlap(model, found, [a, b], 0.0))
}

/// Why a mode of a fit that is complete is none of the structure's. Where all is fitted, what is left near
/// two modes that are close is no third one.
pub(crate) fn refusal_within(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    mode: usize,
) -> Option<(String, Option<NotLinear>)> {
    let one = pole(&found.parameters, mode);
    if one.damping_ratio <= 1.01 * MIN_DAMPING {
        let reason = "its damping ratio would be the limit of the search: a line of this record, not a mode";
        return Some((reason.to_owned(), None));
    }
    if let Some(reason) = below_a_step(model, found, mode) {
        return Some((reason, None));
    }
    let mut others =
        (0..model.modes).filter(|other| *other != mode).map(|other| pole(&found.parameters, other));
    others.find_map(|other| overlap(model, found, [one, other], NEAR))
}

/// Why a mode that moves the output by less than a step of its sensor is none: what the steps leave goes with
/// the motion, and a further mode explains some of it. Noise of half a step makes smaller motions visible.
fn below_a_step(model: &ForcedModel<'_>, found: &Minimum<Projected>, mode: usize) -> Option<String> {
    let columns = found.point.blocks.get(mode)?;
    let before: usize = found.point.blocks[..mode].iter().map(Vec::len).sum();
    let mut own = vec![0.0; found.point.residuals.len()];
    for (column, coefficient) in columns.iter().zip(&found.point.coefficients[before..]) {
        column.add_to(&mut own, *coefficient);
    }
    let mut largest = 0.0_f64;
    for (rows, record) in model.rows() {
        let step = record.sensor_step;
        let left = &found.point.residuals[rows.clone()];
        let noise = (dot(left, left) / rows.len().max(1) as f64).sqrt();
        let top = own[rows].iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        if top >= step || noise > HALF * step {
            return None;
        }
        largest = largest.max(top / step);
    }
    let frequency_hz = pole(&found.parameters, mode).frequency_hz;
    Some(format!(
        "at {frequency_hz:.4} Hz it would move the output by {:.0} % of a step of the sensor at most: what the steps leave, not a mode",
        100.0 * largest
    ))
}

fn overlap(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    [a, b]: [Pole; 2],
    near: f64,
) -> Option<(String, Option<NotLinear>)> {
    let away_hz = (a.lambda() - b.lambda()).norm() / std::f64::consts::TAU;
    let [half_a, half_b] = [a, b].map(|pole| pole.damping_ratio * pole.frequency_hz);
    if away_hz < SAME_POLE * half_a.min(half_b) {
        return Some((format!("it is the mode at {:.4} Hz once more", b.frequency_hz), None));
    }
    if away_hz > (half_a + half_b).max(near * a.frequency_hz) {
        return None;
    }
    let [low, high] = if a.frequency_hz < b.frequency_hz { [a, b] } else { [b, a] };
    let band_hz = [low, high].map(|pole| WITHIN * pole.damping_ratio * pole.frequency_hz);
    let band_hz = [low.frequency_hz - band_hz[0], high.frequency_hz + band_hz[1]];
    let times_floor = left_within(model, &found.point.residuals, band_hz)?;
    (times_floor > ABOVE_FLOOR).then(|| {
        let frequency_hz = if half_a * a.damping_ratio < half_b * b.damping_ratio { a } else { b }.frequency_hz;
        let reason = format!(
            "it overlaps the mode at {:.4} Hz, and both together still leave {times_floor:.0} times as much there as beside them: they stand in for something that is not linear",
            b.frequency_hz
        );
        (reason, Some(NotLinear { frequency_hz, times_floor }))
    })
}

/// Power left within a band over the power left beside it; of the record in which that is most.
pub(crate) fn left_within(model: &ForcedModel<'_>, residuals: &[f64], band_hz: [f64; 2]) -> Option<f64> {
    let of_record = |rows: Range<usize>, time_s: &[f64]| {
        let uniform = Uniform::new(time_s, &residuals[rows]);
        let signal = uniform.without_mean();
        let spectrum = density(&signal, uniform.interval_s, signal.len(), Window::Hann);
        let bin_hz = *spectrum.frequency_hz.get(1)?;
        let top = spectrum.density.len() - 1;
        let bin = |hz: f64| ((hz / bin_hz).round().max(1.0) as usize).min(top);
        let inner = bin(band_hz[0])..=bin(band_hz[1]);
        let width = inner.end() - inner.start() + 1;
        let outer = bin(band_hz[0] / BESIDE).min(inner.start().saturating_sub(BESIDE_BINS + width)).max(1)
            ..=bin(band_hz[1] * BESIDE).max((inner.end() + BESIDE_BINS + width).min(top));
        let gap = width / 2;
        let mut beside: Vec<f64> = outer
            .filter(|k| k + gap < *inner.start() || *k > inner.end() + gap)
            .map(|k| spectrum.density[k])
            .collect();
        if beside.len() < BESIDE_BINS {
            return None;
        }
        let middle = beside.len() / 2;
        let floor = *beside.select_nth_unstable_by(middle, f64::total_cmp).1;
        let within = spectrum.density[inner].iter().sum::<f64>() / width as f64;
        // The median of a density is ln 2 of its mean.
        Some(within * std::f64::consts::LN_2 / floor.max(f64::MIN_POSITIVE))
    };
    model.rows().filter_map(|(rows, record)| of_record(rows, &record.time_s)).reduce(f64::max)
}

/// The sum of squares of stretches held out: participations are found in every other stretch of the records
/// and tried on those between, and the other way round. Poles, initial states and offsets stay as the whole
/// record has them; only in an impact test a mode that is judged has to do without an initial state: before
/// the first blow there is little to tell it from, and it could stand in for what the blows' noise makes the
/// others ring.
pub(crate) fn held_out_sum(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    judged: Option<usize>,
) -> Option<f64> {
    let parts = stretches(model);
    if parts.rows.len() < 2 {
        return None;
    }
    let mut target = found.point.residuals.clone();
    let mut forced = Vec::new();
    let mut index = 0;
    for (block, columns) in found.point.blocks.iter().enumerate() {
        let is_linear = |at: usize| match block.cmp(&model.modes) {
            std::cmp::Ordering::Less => at == 0 || (model.real_pole && at + 1 == columns.len()),
            std::cmp::Ordering::Equal => false,
            std::cmp::Ordering::Greater => at == 0,
        };
        for (at, column) in columns.iter().enumerate() {
            let coefficient = found.point.coefficients[index + at];
            if is_linear(at) {
                forced.push((column, coefficient));
            } else if parts.are_blows && judged == Some(block) {
                column.add_to(&mut target, coefficient);
            }
        }
        index += columns.len();
    }
    let rows = found.point.residuals.len();
    let dense: Vec<Vec<f64>> = forced
        .iter()
        .map(|(column, coefficient)| {
            column.add_to(&mut target, *coefficient);
            let mut values = vec![0.0; rows];
            column.add_to(&mut values, 1.0);
            values
        })
        .collect();
    let sums: Vec<Normal> =
        [0, 1].map(|fold| Normal::of(&dense, &target, parts.rows.iter().skip(fold).step_by(2))).into();
    Some(sums[0].error_with(&sums[1].solution()?) + sums[1].error_with(&sums[0].solution()?))
}

/// Whether a wider model explains of held-out stretches a fair part of what it explains of the whole.
pub(crate) fn is_confirmed(narrow: f64, wide: f64, share: f64) -> bool {
    1.0 - wide / narrow.max(f64::MIN_POSITIVE) > CONFIRMED * share
}

/// Parts of the records of which every other one is held out.
struct Parts {
    rows: Vec<Range<usize>>,
    /// Whether they go from blow to blow.
    are_blows: bool,
}

/// Parts to hold out: from blow to blow of an impact test, else stretches of equal
/// length. A single blow is one part: what rings after it is no second witness.
fn stretches(model: &ForcedModel<'_>) -> Parts {
    let mut all = Vec::new();
    let mut are_blows = false;
    for (rows, record) in model.rows() {
        let input = record.input.sample(record.time_s.iter().copied());
        let input: Vec<f64> = input.into_iter().map(|value| value[0]).collect();
        let blows = blow_starts(&input);
        if !blows.is_empty() {
            are_blows = true;
            // What comes before the first blow goes with it.
            let ends = blows.iter().skip(1).map(|start| rows.start + start).chain([rows.end]);
            let mut from = rows.start;
            for end in ends {
                all.push(from..end);
                from = end;
            }
            continue;
        }
        let length = rows.len().div_ceil(STRETCHES).max(1);
        all.extend(rows.clone().step_by(length).map(|from| from..(from + length).min(rows.end)));
    }
    Parts { rows: all, are_blows }
}

/// Whether the records are those of an impact test.
pub(crate) fn is_impact_test(model: &ForcedModel<'_>) -> bool {
    stretches(model).are_blows
}

/// Normal equations of some stretches.
struct Normal {
    products: DMatrix<f64>,
    right: DVector<f64>,
    energy: f64,
}

impl Normal {
    fn of<'p>(columns: &[Vec<f64>], target: &[f64], parts: impl Iterator<Item = &'p Range<usize>>) -> Self {
        let count = columns.len();
        let mut sums =
            Self { products: DMatrix::zeros(count, count), right: DVector::zeros(count), energy: 0.0 };
        for part in parts {
            let here = &target[part.clone()];
            sums.energy += dot(here, here);
            for (i, left) in columns.iter().enumerate() {
                sums.right[i] += dot(&left[part.clone()], here);
                for (j, right) in columns.iter().enumerate().take(i + 1) {
                    let product = dot(&left[part.clone()], &right[part.clone()]);
                    sums.products[(i, j)] += product;
                    if i != j {
                        sums.products[(j, i)] += product;
                    }
                }
            }
        }
        sums
    }

    fn solution(&self) -> Option<DVector<f64>> {
        self.products.clone().cholesky().map(|cholesky| cholesky.solve(&self.right))
    }

    /// What is left of these stretches with participations found elsewhere.
    fn error_with(&self, x: &DVector<f64>) -> f64 {
        self.energy - 2.0 * self.right.dot(x) + (&self.products * x).dot(x)
    }
}
