//! The fit of one mode that depends on its amplitude, or on time, all other modes held.

use super::motion::{Drive, State};
use super::{Cause, Course, Dependence, LAWS, Law, Moment, told};
use crate::column::Column;
use crate::forced_model::{ForcedModel, MAX_DAMPING, MIN_DAMPING, pole};
use crate::levenberg_marquardt::{Minimum, Parameter};
use crate::modal_response::{Pole, free_response};
use crate::separable::{Projected, Separable, fit_covariance, fit_roughly};
use crate::tall::{Orthonormal, dot};

/// Relative changes of stiffness and of damping at the largest amplitude that the search starts from.
const STIFFNESS: [f64; 9] = [0.0, -0.02, 0.02, -0.06, 0.06, -0.15, 0.15, -0.3, 0.3];
const DAMPING: [f64; 2] = [0.0, 1.0];
/// Shares of the largest amplitude of which the linear mode may be the frequency.
const SEEN_AT: [f64; 3] = [0.4, 0.7, 1.0];
/// Share of what is left that the first order of a law must explain for the law to be fitted.
const FIRST_ORDER: f64 = 0.03;
/// Step of the first order, and of the differences of a fit.
const SMALL: f64 = 1e-3;
const DIFFERENCE: f64 = 1e-6;
const SIDES: [f64; 2] = [1.0, -1.0];
/// Starts whose motions are held in memory at once.
const SIDE_BY_SIDE: usize = 8;

/// One mode on a law, the others held.
pub(super) struct OneMode<'r> {
    /// The records with this mode alone.
    alone: ForcedModel<'r>,
    target: Vec<f64>,
    held: Vec<Column>,
    /// The held columns' span, and the target less its part there.
    basis: Orthonormal,
    left: Vec<f64>,
    drives: Vec<Drive>,
    delay_s: f64,
    pub(super) cause: Cause,
    reference: f64,
}

impl<'r> OneMode<'r> {
    pub(super) fn new(model: &ForcedModel<'r>, found: &Minimum<Projected>, mode: usize) -> Option<Self> {
        let own = pole(&found.parameters, mode);
        let delay_s = model.delay_s(&found.parameters);
        let drives = Drive::all(model.records, delay_s, 1.1 * own.frequency_hz);
        let amplitudes = drives.iter().flat_map(|drive| amplitude(&drive.linear(own), own));
        let reference = amplitudes.fold(0.0, f64::max);
        let others = found.point.blocks.iter().enumerate().filter(|(block, _)| *block != mode);
        // Beside a real pole the rate of the mode's response stays that of the linear mode.
        let rate = found.point.blocks.get(mode).and_then(|own| own.last()).filter(|_| model.real_pole);
        let held: Vec<Column> = others.flat_map(|(_, columns)| columns).chain(rate).cloned().collect();
        let alone = ForcedModel { modes: 1, delay: false, direct: false, real_pole: false, ..*model };
        let mut one = Self {
            alone,
            target: model.target(&found.parameters),
            held,
            basis: Orthonormal::default(),
            left: Vec::new(),
            drives,
            delay_s,
            cause: Cause::Amplitude(LAWS[0]),
            reference,
        };
        one.hold();
        (reference > 0.0 && reference.is_finite()).then_some(one)
    }

    /// Takes the held columns out of the target.
    fn hold(&mut self) {
        self.basis = Orthonormal::default();
        let mut order: Vec<&Column> = self.held.iter().collect();
        order.sort_by_key(|column| column.values.len());
        order.into_iter().for_each(|column| self.basis.push(column.clone()));
        self.left = self.target.clone();
        self.basis.remove_from(&mut self.left);
    }

    /// What a course with this motion leaves, to the accuracy of the steps.
    fn sum_with(&self, course: Course, motion: Vec<f64>) -> f64 {
        let mut own = Orthonormal::default();
        let mut push = |mut column: Column| {
            self.basis.remove_from_column(&mut column);
            own.push(column);
        };
        for (rows, record) in self.alone.rows() {
            let times_s = record.input_times(self.delay_s);
            let origin_s = times_s.first().copied().unwrap_or(0.0);
            let free = free_response(course.pole, origin_s, &times_s);
            free.into_iter().for_each(|values| push(Column { start: rows.start, values }));
        }
        push(Column::from(motion));
        let mut left = self.left.clone();
        own.remove_from(&mut left);
        dot(&left, &left)
    }

    pub(super) fn course(&self, parameters: &[f64]) -> Course {
        let cause = match (self.cause, parameters.get(4)) {
            (Cause::Time(Moment::Around { width, .. }), Some(&moment)) => {
                Cause::Time(Moment::Around { moment, width })
            }
            (cause, _) => cause,
        };
        Course { cause, pole: pole(parameters, 0), stiffness: parameters[2], damping: parameters[3] }
    }

    /// The mode's forced responses on some courses, to the accuracy of the steps.
    fn motions(&self, courses: &[Course]) -> Vec<Vec<f64>> {
        let mut responses = vec![Vec::new(); courses.len()];
        for drive in &self.drives {
            let motions = drive.motions(courses, self.reference);
            for (response, states) in responses.iter_mut().zip(motions) {
                response.extend(states.into_iter().map(|state| drive.output(state)));
            }
        }
        responses
    }

    /// The mode's responses less those of the linear mode at no amplitude.
    fn beyond_linear(&self, courses: &[Course]) -> Vec<Vec<f64>> {
        let linear = |course: &Course| Course { stiffness: 0.0, damping: 0.0, ..*course };
        let both: Vec<Course> = courses.iter().copied().chain(courses.iter().map(linear)).collect();
        let mut own = self.motions(&both);
        let linear = own.split_off(courses.len());
        for (own, linear) in own.iter_mut().zip(linear) {
            own.iter_mut().zip(linear).for_each(|(own, linear)| *own -= linear);
        }
        own
    }

    /// The mode's columns on some courses.
    fn columns(&self, courses: &[Course]) -> Vec<Vec<Column>> {
        let beyond = self.beyond_linear(courses);
        let with = |(course, beyond): (&Course, Vec<f64>)| {
            let mut columns = self.alone.mode_columns(course.pole, self.delay_s);
            columns[0].values.iter_mut().zip(beyond).for_each(|(y, more)| *y += more);
            columns
        };
        courses.iter().zip(beyond).map(with).collect()
    }

    fn forced(&self, pole: Pole) -> Vec<f64> {
        self.alone.mode_columns(pole, self.delay_s).swap_remove(0).values
    }

    /// Starts of the search: the linear mode, moved so that the mean frequency stays.
    fn starts(own: Pole, law: Law) -> Vec<[f64; 4]> {
        let seen = SEEN_AT.map(|share| law.felt(share));
        let pairs = STIFFNESS.into_iter().flat_map(|k| DAMPING.map(|d| (k, d)));
        pairs
            .flat_map(|(k, d)| seen.map(|[spring, drag]| moved(own, [k * spring, d * drag], [k, d])))
            .collect()
    }

    /// The best of some starts, and what it leaves.
    pub(super) fn best<const N: usize>(&self, starts: Vec<[f64; N]>) -> Option<(f64, [f64; N])> {
        let sums = starts.chunks(SIDE_BY_SIDE).flat_map(|some| {
            let courses: Vec<Course> = some.iter().map(|start| self.course(start)).collect();
            let motions = self.motions(&courses);
            let sums = courses.into_iter().zip(motions).map(|(course, motion)| self.sum_with(course, motion));
            some.iter().zip(sums.collect::<Vec<f64>>()).map(|(start, sum)| (sum, *start))
        });
        sums.filter(|(sum, _)| sum.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The fit from a start.
    pub(super) fn fitted<const N: usize>(&self, start: [f64; N]) -> Option<Minimum<Projected>> {
        let frequency = start[0];
        let bounds = [
            [frequency - 0.3, frequency + 0.3, 0.02],
            [MIN_DAMPING.ln(), MAX_DAMPING.ln(), 0.7],
            [-0.8, 4.0, 0.05],
            [-0.95, 100.0, 1.0],
            [0.0, 1.0, 0.02],
        ];
        let range = start.into_iter().zip(bounds);
        let range =
            range.map(|(start, [lower, upper, max_step])| Parameter { start, lower, upper, max_step });
        fit_roughly(self, &range.collect::<Vec<Parameter>>())
    }

    /// What a fit says.
    fn told(&self, minimum: &Minimum<Projected>) -> Option<Dependence> {
        let covariance = fit_covariance(self, minimum)?;
        let errors = [0, 1, 2, 3].map(|index| covariance[(index, index)].max(0.0).sqrt());
        let course = self.course(&minimum.parameters);
        let motions = self.drives.iter().flat_map(|drive| drive.motion(course, self.reference));
        let amplitudes = amplitude(&motions.collect::<Vec<State>>(), course.pole);
        let shares: Vec<f64> = amplitudes.iter().map(|a| a / self.reference).collect();
        let weight = shares.iter().map(|a| a * a).sum::<f64>().max(f64::MIN_POSITIVE);
        let felt = [0, 1]
            .map(|index: usize| shares.iter().map(|a| a * a * course.felt(*a)[index]).sum::<f64>() / weight);
        let mean = course.feeling(felt);
        let participation = minimum.point.coefficients[0];
        let own = &minimum.point.blocks[0][0].values;
        let linear = self.forced(mean);
        let correction = own.iter().zip(linear).map(|(own, linear)| participation * (own - linear)).collect();
        let largest = own.iter().fold(0.0_f64, |top, y| top.max(y.abs()));
        let top_share = shares.iter().fold(f64::MIN_POSITIVE, |top, a| top.max(*a));
        let unit = participation.abs() * largest / top_share;
        let first = self.alone.records.first()?;
        let window_s = [first.time_s.first()?, first.time_s.last()?].map(|t| t + first.origin_s);
        let (changes, points) = told(course, errors, &shares, unit, window_s);
        let sum_of_squares = minimum.sum_of_squares;
        let reference = self.reference;
        Some(Dependence {
            mean,
            is_unclear: false,
            changes,
            points,
            course,
            reference,
            sum_of_squares,
            correction,
        })
    }
}

/// A start of the search: the linear mode moved by what its stiffness and damping feel of a change of k and
/// d.
pub(super) fn moved(own: Pole, [of_stiffness, of_damping]: [f64; 2], [k, d]: [f64; 2]) -> [f64; 4] {
    let frequency = own.frequency_hz.ln() - 0.5 * of_stiffness.ln_1p();
    let damping = own.damping_ratio.ln() - of_damping.ln_1p();
    [frequency, damping.max(MIN_DAMPING.ln()), k, d]
}

fn amplitude(states: &[State], own: Pole) -> Vec<f64> {
    states.iter().map(|[q, v, _]| q.hypot(v / own.omega())).collect()
}

impl Separable for OneMode<'_> {
    fn target(&self, _: &[f64]) -> Vec<f64> {
        self.target.clone()
    }

    fn blocks(&self) -> usize {
        2
    }

    fn block(&self, block: usize, parameters: &[f64]) -> Vec<Column> {
        if block > 0 {
            return self.held.clone();
        }
        self.columns(&[self.course(parameters)]).swap_remove(0)
    }

    fn depends(&self, block: usize, _: usize) -> bool {
        block == 0
    }

    /// Differences; what changes only the motion beyond the linear one needs only that anew.
    fn tangents(
        &self,
        block: usize,
        parameters: &[f64],
        _: &[Column],
        coefficients: &[f64],
    ) -> Vec<(usize, Column)> {
        if block > 0 {
            return Vec::new();
        }
        let moved: Vec<Course> = (0..parameters.len())
            .flat_map(|parameter| {
                SIDES.map(|side| {
                    let mut moved = parameters.to_vec();
                    moved[parameter] += side * DIFFERENCE;
                    self.course(&moved)
                })
            })
            .collect();
        let (by_pole, by_law) = moved.split_at(4);
        let by_law = self.motions(by_law).into_iter().map(|motion| vec![Column::from(motion)]);
        let columns: Vec<Vec<Column>> = self.columns(by_pole).into_iter().chain(by_law).collect();
        let tangent = |(parameter, sides): (usize, &[Vec<Column>])| {
            let mut tangent = Column::default();
            for (side, columns) in SIDES.iter().zip(sides) {
                for (column, coefficient) in columns.iter().zip(coefficients) {
                    tangent.add(side * coefficient / (2.0 * DIFFERENCE), column);
                }
            }
            (parameter, tangent)
        };
        columns.chunks(2).enumerate().map(tangent).collect()
    }
}

/// Whether the first order of some law explains a noticeable share of what is left.
pub(crate) fn may_depend(model: &ForcedModel<'_>, found: &Minimum<Projected>, mode: usize) -> bool {
    let Some(mut one) = OneMode::new(model, found, mode) else { return false };
    let own = pole(&found.parameters, mode);
    let share = |one: &OneMode<'_>| {
        let mut basis = Orthonormal::default();
        found.point.blocks.iter().flatten().for_each(|column| basis.push(column.clone()));
        let shift = |by: [f64; 2]| {
            let moved = Pole {
                frequency_hz: own.frequency_hz * (1.0 + by[0]),
                damping_ratio: own.damping_ratio * (1.0 + by[1]),
            };
            one.forced(moved)
        };
        let unmoved = shift([0.0, 0.0]);
        for by in [[1e-6, 0.0], [0.0, 1e-4]] {
            let slope: Vec<f64> = shift(by).iter().zip(&unmoved).map(|(a, b)| (a - b) * 1e4).collect();
            basis.push(Column::from(slope));
        }
        let mut left = found.point.residuals.clone();
        basis.remove_from(&mut left);
        let before = dot(&left, &left);
        for [stiffness, damping] in [[SMALL * own.damping_ratio, 0.0], [0.0, SMALL]] {
            let course = Course { cause: one.cause, pole: own, stiffness, damping };
            let beyond = one.beyond_linear(&[course]).swap_remove(0);
            let scale = 1.0 / SMALL;
            basis.push(Column::from(beyond.into_iter().map(|y| y * scale).collect::<Vec<f64>>()));
        }
        basis.remove_from(&mut left);
        1.0 - dot(&left, &left) / before.max(f64::MIN_POSITIVE)
    };
    LAWS.into_iter().any(|law| {
        one.cause = Cause::Amplitude(law);
        share(&one) > FIRST_ORDER
    })
}

/// The mode on the law that leaves least; `None` where none can be fitted.
pub(crate) fn dependence(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    mode: usize,
) -> Option<Dependence> {
    let mut one = OneMode::new(model, found, mode)?;
    let own = pole(&found.parameters, mode);
    let mut best: Option<(Law, Minimum<Projected>)> = None;
    for law in LAWS {
        one.cause = Cause::Amplitude(law);
        if let Some((_, start)) = one.best(OneMode::starts(own, law))
            && let Some(found) = one.fitted(start)
            && best.as_ref().is_none_or(|(_, best)| found.sum_of_squares < best.sum_of_squares)
        {
            best = Some((law, found));
        }
    }
    let (law, minimum) = best?;
    one.cause = Cause::Amplitude(law);
    one.told(&minimum)
}

/// The same dependence once more, beside the modes that the model has by now.
pub(crate) fn again(
    model: &ForcedModel<'_>,
    found: &Minimum<Projected>,
    mode: usize,
    known: &Dependence,
) -> Option<Dependence> {
    let mut one = OneMode::new(model, found, mode)?;
    (one.cause, one.reference) = (known.course.cause, known.reference);
    one.target.iter_mut().zip(&known.correction).for_each(|(y, c)| *y += c);
    one.hold();
    let Course { pole, stiffness, damping, .. } = known.course;
    let start = [pole.frequency_hz.ln(), pole.damping_ratio.ln(), stiffness, damping];
    let is_unclear = known.is_unclear;
    Some(Dependence { is_unclear, ..one.told(&one.fitted(start)?)? })
}
