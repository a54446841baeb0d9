//! Output-error fit of a model's parameters, and of laws added to it, to all recordings jointly.
//!
//! What is made small is the difference between simulation and recording, never an equation error: an inverse
//! model is biased by noise in what it differentiates. Offsets and initial states are solved for inside every
//! evaluation (variable projection with Kaufman's Jacobian), so the search sees only the parameters proper.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use stillbeam_identify::levenberg_marquardt::{LeastSquares, Minimum, Parameter, minimise_to};
use stillbeam_identify::tall::{Orthonormal, add_scaled, dot};

use crate::effort::{DIFFERENCE, Effort, ROUGH_DIFFERENCE};
use crate::moving_starts::{MovingStart, moved_start};
use crate::one_mode::OneMode;
use crate::parameters::FreeParameter;
use crate::simulation::Hypothesis;
use crate::stacking::{RecordFit, Stack};

/// Laws are begun this many times as large where they are.
const LARGER: [f64; 2] = [1.0, 1.3];
/// A parameter's small differences have this many times the slope of its large ones where it is jagged.
const JAGGED: f64 = 2.0;
/// What is left is more than noise where it has this many times its power.
pub(crate) const LOUD: f64 = 1.1;

/// Share of a step over which the second derivative along it is taken.
const BEND: f64 = 0.1;

/// A hypothesis whose parameters have been fitted.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) hypothesis: Hypothesis,
    /// The parameters that were free: the model's, then the laws'.
    pub(crate) free: Vec<FreeParameter>,
    /// Their values.
    pub(crate) values: Vec<f64>,
    /// One per recording.
    pub(crate) records: Vec<RecordFit>,
    /// Sum of the squared weighted residuals.
    pub(crate) sum_of_squares: f64,
}

/// The sum of squares as a function of the search coordinates.
struct Problem<'p, 'r> {
    stack: &'p Stack<'r>,
    hypothesis: &'p Hypothesis,
    free: &'p [FreeParameter],
    /// Fits of the recordings nearby, from whose initial states everything is simulated.
    near: Vec<RecordFit>,
    /// Initial values that are searched too; their coordinates follow those of the parameters.
    moving: Vec<MovingStart>,
    /// Directions that other parameters would absorb, over all recordings.
    absorbing: Option<&'p Orthonormal>,
    /// Evaluations that are left: a candidate that wanders along a flat valley is not worth more.
    budget: AtomicUsize,
    /// Whether differences are taken to both sides: what two parameters do alike cancels only then.
    central: bool,
    /// See [`Effort`].
    kept_steps: usize,
    /// See [`Effort`].
    difference: f64,
    /// Derivatives by the model's own parameters, and the steps for which they may still be used.
    kept: Mutex<(usize, Vec<Vec<f64>>)>,
    /// The Jacobian made last, where steps bend.
    fresh: Mutex<Vec<Vec<f64>>>,
}

struct Point {
    records: Vec<RecordFit>,
    residuals: Vec<f64>,
}

impl Problem<'_, '_> {
    fn moved(&self, search: &[f64]) -> Option<Hypothesis> {
        let values: Vec<f64> = self.free.iter().zip(search).map(|(p, s)| p.to_value(*s)).collect();
        self.hypothesis.with_values(self.free, &values)
    }

    /// Derivatives of the residuals, one column per parameter over all recordings.
    fn jacobian(&self, search: &[f64], point: &Point) -> Vec<Vec<f64>> {
        self.columns(search, point, &(0..search.len()).collect::<Vec<usize>>())
    }

    /// The same, those by the model's own parameters a few steps old where a law's parameters are searched
    /// with them.
    fn jacobian_mostly_kept(&self, search: &[f64], point: &Point) -> Vec<Vec<f64>> {
        let (laws, own): (Vec<usize>, Vec<usize>) =
            (0..search.len()).partition(|&index| self.free.get(index).is_none_or(|free| free.is_added));
        let Ok(mut kept) = self.kept.lock() else { return self.jacobian(search, point) };
        if laws.is_empty() || own.is_empty() || kept.0 == 0 {
            let all = self.jacobian(search, point);
            *kept = (self.kept_steps, own.iter().map(|&index| all[index].clone()).collect());
            return all;
        }
        kept.0 -= 1;
        let mut all = vec![Vec::new(); search.len()];
        for (&index, column) in laws.iter().zip(self.columns(search, point, &laws)) {
            all[index] = column;
        }
        for (&index, column) in own.iter().zip(&kept.1) {
            all[index].clone_from(column);
        }
        all
    }

    /// Whether steps bend with the valley. Second derivatives need first ones of the very point, and a
    /// simulation that does not jump: not that of readings in steps, nor a law's that is searched, play and
    /// stops above all. And along a valley what several parameters do all but cancels, which differences to
    /// one side do not show.
    fn bends(&self) -> bool {
        let is_smooth = self.hypothesis.unrounded().is_none() && self.free.iter().all(|p| !p.is_added);
        is_smooth && self.free.len() > 1 && self.absorbing.is_none() && self.moving.is_empty()
    }

    /// Some of the Jacobian's columns.
    fn columns(&self, search: &[f64], point: &Point, columns: &[usize]) -> Vec<Vec<f64>> {
        let parts: Vec<(usize, usize)> = columns
            .iter()
            .flat_map(|&column| (0..point.records.len()).map(move |record| (column, record)))
            .collect();
        let tangents: Vec<Vec<f64>> = parts
            .par_iter()
            .map(|&(column, record)| {
                let fit = &point.records[record];
                let mut tangent = self
                    .tangent(search, column, record, fit)
                    .unwrap_or_else(|| vec![0.0; fit.residuals.len()]);
                fit.nuisances.remove_from(&mut tangent);
                tangent.iter_mut().for_each(|value| *value = -*value);
                tangent
            })
            .collect();
        tangents.chunks(point.records.len().max(1)).map(<[Vec<f64>]>::concat).collect()
    }

    /// Change of the weighted prediction of one recording per unit of one search coordinate.
    fn tangent(&self, search: &[f64], column: usize, record: usize, fit: &RecordFit) -> Option<Vec<f64>> {
        if let Some(number) = column.checked_sub(self.free.len()) {
            return self.tangent_of_a_start(search, number, record, fit);
        }
        let parameter = self.free[column].as_search(self.free[column].to_value(search[column]));
        let length = self.free[column].difference(search[column], self.difference);
        // At a bound only what lies inside is a machine: a sensor cannot lose more of a sign than all of it.
        let [is_ahead, is_behind] =
            [search[column] + length <= parameter.upper, search[column] - length >= parameter.lower];
        let step = if is_ahead || !is_behind { length } else { -length };
        if let Some(change) = self.tangent_of_one_mode(search, column, record, fit) {
            return Some(change);
        }
        let moved = |step: f64| {
            let mut moved = search.to_vec();
            moved[column] += step;
            let hypothesis = self.moved(&moved)?;
            let hypothesis = hypothesis.unrounded().unwrap_or(hypothesis);
            self.stack.prediction(record, &hypothesis, &fit.initial)
        };
        let mut change = moved(step)?;
        let both = (self.central || self.bends() || self.hypothesis.unrounded().is_some())
            && (is_ahead == is_behind);
        let (base, length) = match both.then(|| moved(-step)).flatten() {
            Some(before) => (before, 2.0 * step),
            None => (self.stack.weighted(record, &fit.simulated), step),
        };
        add_scaled(&mut change, -1.0, &base);
        change.iter_mut().for_each(|value| *value /= length);
        Some(change)
    }
}

impl Problem<'_, '_> {
    /// The same by an initial value, which moves its own recording only.
    fn tangent_of_a_start(
        &self,
        search: &[f64],
        number: usize,
        record: usize,
        fit: &RecordFit,
    ) -> Option<Vec<f64>> {
        let start = self.moving.get(number).filter(|start| start.record == record)?;
        let hypothesis = self.moved(search)?;
        let hypothesis = hypothesis.unrounded().unwrap_or(hypothesis);
        let moved = moved_start(std::slice::from_ref(start), &[start.difference], record, &fit.initial);
        let mut change = self.stack.prediction(record, &hypothesis, &moved)?;
        add_scaled(&mut change, -1.0, &self.stack.weighted(record, &fit.simulated));
        change.iter_mut().for_each(|value| *value /= start.difference);
        Some(change)
    }

    /// The same by a parameter of one of several independent modes, simulated alone; `None` for all others.
    fn tangent_of_one_mode(
        &self,
        search: &[f64],
        column: usize,
        record: usize,
        fit: &RecordFit,
    ) -> Option<Vec<f64>> {
        let free = &self.free[column];
        if !self.stack.adds_free_responses(record, self.hypothesis) {
            return None;
        }
        let one = OneMode::of(self.hypothesis, free)?;
        let hypothesis = self.moved(search)?;
        let step = free.difference(search[column], self.difference);
        let at = |search: f64| {
            let moved = one.alone(&hypothesis, free.to_value(search))?;
            self.stack.prediction(record, &moved, one.initial(&fit.initial))
        };
        let (mut change, before) = (at(search[column] + step)?, at(search[column] - step)?);
        add_scaled(&mut change, -1.0, &before);
        change.iter_mut().for_each(|value| *value /= 2.0 * step);
        Some(change)
    }
}

impl Problem<'_, '_> {
    /// Where a search from these values starts.
    fn search_from(&self, values: &[f64]) -> Vec<Parameter> {
        let parameters = self.free.iter().zip(values).map(|(p, value)| p.as_search(*value));
        parameters.chain(self.moving.iter().map(|_| MovingStart::as_search())).collect()
    }

    /// The fit that a search ended at. Initial values that were searched are settled there, and what they
    /// could change is taken out of the residuals as everywhere else.
    fn ended_at(&self, minimum: Minimum<Point>) -> Option<Fitted> {
        let searched = self.free.iter().zip(&minimum.parameters);
        let values: Vec<f64> = searched.map(|(p, s)| p.to_value(*s)).collect();
        let hypothesis = self.hypothesis.with_values(self.free, &values)?;
        let (mut records, mut sum_of_squares) = (minimum.point.records, minimum.sum_of_squares);
        if !self.moving.is_empty() {
            let starts: Vec<Vec<f64>> = records.into_iter().map(|fit| fit.initial).collect();
            records = self.stack.evaluate(&hypothesis, &starts)?;
            sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
        }
        Some(Fitted { hypothesis, free: self.free.to_vec(), values, records, sum_of_squares })
    }
}

impl LeastSquares for Problem<'_, '_> {
    type Point = Point;

    fn at(&self, search: &[f64]) -> Option<Point> {
        let left = |left: usize| left.checked_sub(1);
        self.budget.fetch_update(Ordering::Relaxed, Ordering::Relaxed, left).ok()?;
        let moved = self.moved(search)?;
        let records = if self.moving.is_empty() {
            self.stack.evaluate_at(&moved, &self.near)?
        } else {
            let starts = &search[self.free.len()..];
            let at = |(index, near): (usize, &RecordFit)| {
                let start = moved_start(&self.moving, starts, index, &near.initial);
                Some(self.stack.evaluate_from(index, &moved, &start, &near.nuisances)?.0)
            };
            self.near.par_iter().enumerate().map(at).collect::<Option<_>>()?
        };
        let mut residuals: Vec<f64> = records.iter().flat_map(|fit| fit.residuals.iter().copied()).collect();
        if let Some(absorbing) = self.absorbing {
            absorbing.remove_from(&mut residuals);
        }
        Some(Point { records, residuals })
    }

    fn residuals<'p>(&self, point: &'p Point) -> &'p [f64] {
        &point.residuals
    }

    fn curvature(&self, search: &[f64], point: &Point) -> (DMatrix<f64>, DVector<f64>) {
        if self.stack.is_spent() {
            // No direction leads anywhere: the search ends here.
            return (DMatrix::zeros(search.len(), search.len()), DVector::zeros(search.len()));
        }
        let mut columns = self.jacobian_mostly_kept(search, point);
        if let Some(absorbing) = self.absorbing {
            columns.par_iter_mut().for_each(|column| {
                absorbing.remove_from(column);
            });
        }
        let gradient = columns.iter().map(|column| dot(column, &point.residuals));
        let curvature = (gram(&columns), DVector::from_iterator(columns.len(), gradient));
        if let Ok(mut fresh) = self.fresh.lock() {
            *fresh = if self.bends() { columns } else { Vec::new() };
        }
        curvature
    }

    fn bend(&self, search: &[f64], point: &Point, direction: &[f64]) -> Option<DVector<f64>> {
        let fresh = self.fresh.lock().ok().filter(|fresh| !fresh.is_empty())?;
        let moved: Vec<f64> = search.iter().zip(direction).map(|(at, along)| at + BEND * along).collect();
        let moved = self.moved(&moved)?;
        let changes: Option<Vec<Vec<f64>>> = (0..point.records.len())
            .into_par_iter()
            .map(|record| {
                let fit = &point.records[record];
                let mut change = self.stack.prediction(record, &moved, &fit.initial)?;
                add_scaled(&mut change, -1.0, &self.stack.weighted(record, &fit.simulated));
                fit.nuisances.remove_from(&mut change);
                Some(change)
            })
            .collect();
        // Residuals are recorded less simulated.
        let mut second = changes?.concat();
        second.iter_mut().for_each(|value| *value /= -BEND);
        for (column, along) in fresh.iter().zip(direction) {
            add_scaled(&mut second, -along, column);
        }
        let products = fresh.iter().map(|column| 2.0 / BEND * dot(column, &second));
        Some(DVector::from_iterator(fresh.len(), products))
    }
}

/// Inner products of all pairs of columns.
pub(crate) fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(columns.len(), columns.len());
    for (i, left) in columns.iter().enumerate() {
        for (j, right) in columns.iter().enumerate().take(i + 1) {
            products[(i, j)] = dot(left, right);
        }
    }
    products.fill_upper_triangle_with_lower_triangle();
    products
}

/// Fits the free parameters from `start` (values); initial states are searched from `starts`.
pub(crate) fn fit(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    free: &[FreeParameter],
    start: &[f64],
    starts: &[Vec<f64>],
    effort: Effort,
) -> Option<Fitted> {
    let near = stack.evaluate(&hypothesis.with_values(free, start)?, starts)?;
    fit_near(stack, hypothesis, free, start, near, Others::Searched, effort)
}

/// What is done about the parameters that are not the laws'.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Others<'o> {
    /// They are searched like all.
    Searched,
    /// They are held, and what they would absorb, one direction each, is taken out.
    Absorb(&'o Orthonormal),
    /// They are searched, beginning with derivatives that are known from a fit nearby: one column each.
    Known(&'o [Vec<f64>]),
}

/// The same from fits of the recordings nearby, whose initial states and what those could change are good
/// enough to begin with. Where other parameters absorb, the sum of squares is what is left once they have
/// been refitted, as far as straight lines go: a few simulations instead of hundreds.
pub(crate) fn fit_near(
    stack: &Stack<'_>,
    hypothesis: &Hypothesis,
    free: &[FreeParameter],
    start: &[f64],
    mut near: Vec<RecordFit>,
    others: Others<'_>,
    effort: Effort,
) -> Option<Fitted> {
    if let Some(record) = stack.records.first() {
        record.work.fitted();
    }
    let mut values = start.to_vec();
    let mut best: Option<Fitted> = None;
    let (absorbing, mut kept) = match others {
        Others::Searched => (None, None),
        Others::Absorb(directions) => (Some(directions), None),
        Others::Known(columns) => (None, Some(columns)),
    };
    let moving = match absorbing {
        Some(_) => Vec::new(),
        None => stack.moving_starts(&hypothesis.with_values(free, start)?)?,
    };
    if !moving.is_empty() {
        // Derivatives of a fit whose states were taken out say nothing of one whose states are moved.
        kept = None;
    }
    for _ in 0..effort.rounds {
        if !moving.is_empty() {
            near = stack.with_starts_to_move(&hypothesis.with_values(free, &values)?, near, &moving)?;
        }
        let known = kept.take().map(|columns| (effort.kept_steps, columns.to_vec()));
        let problem = Problem {
            stack,
            hypothesis,
            free,
            near: near.clone(),
            moving: moving.clone(),
            absorbing,
            budget: AtomicUsize::new(effort.evaluations),
            central: false,
            kept_steps: effort.kept_steps,
            difference: effort.difference,
            kept: Mutex::new(known.unwrap_or_default()),
            fresh: Mutex::default(),
        };
        let Some(minimum) = minimise_to(&problem, &problem.search_from(&values), effort.tolerance) else {
            break;
        };
        let before = best.as_ref().map_or(f64::INFINITY, |best| best.sum_of_squares);
        if minimum.sum_of_squares >= before {
            break;
        }
        let fitted = problem.ended_at(minimum)?;
        values.clone_from(&fitted.values);
        // What is kept of the derivatives may end a search early; the next one starts with all of them.
        let gained = 1.0 - fitted.sum_of_squares / before;
        let is_cut = effort.rounds > 1 && problem.budget.load(Ordering::Relaxed) == 0;
        // Where all are added up a search is not begun anew for its initial states' sake, but for what it had
        // no evaluations left for.
        let settled = (!is_cut && stack.all_add_free_responses(&fitted.hypothesis))
            || (before.is_finite() && gained < 10.0 * effort.tolerance);
        if !settled && !moving.is_empty() {
            near.clone_from(&fitted.records);
        } else if !settled && effort.rounds > 1 {
            near = stack.evaluate(&fitted.hypothesis, &fitted.initial_states())?;
        }
        best = Some(fitted);
        if settled {
            break;
        }
    }
    best
}

impl Fitted {
    /// Initial states, to start another fit from.
    pub(crate) fn initial_states(&self) -> Vec<Vec<f64>> {
        self.records.iter().map(|record| record.initial.clone()).collect()
    }

    /// Derivatives of the weighted prediction with respect to the free parameters *in search coordinates*,
    /// nuisances taken out; one column per parameter over all recordings. Of a jagged fit that leaves more
    /// than noise by large differences: which jag it ended in says nothing of the machine.
    pub(crate) fn sensitivities(&self, stack: &Stack<'_>) -> Vec<Vec<f64>> {
        self.sensitivities_by(stack, true)
    }

    /// The same by differences to one side.
    pub(crate) fn rough_sensitivities(&self, stack: &Stack<'_>) -> Vec<Vec<f64>> {
        self.sensitivities_by(stack, false)
    }

    /// Whether a small change of a law's parameter changes the motion by far more than its share of a larger
    /// one: after play is crossed a little earlier, or a stop touched, everything later comes at another
    /// moment. Small differences know nothing of where such a fit improves then.
    pub(crate) fn is_jagged(&self, stack: &Stack<'_>) -> bool {
        let laws: Vec<usize> =
            (0..self.free.len()).filter(|&index| self.free[index].path.starts_with("physics.")).collect();
        let [fine, rough] = [DIFFERENCE, ROUGH_DIFFERENCE]
            .map(|difference| self.differences(stack, &laws, false, difference));
        let length = |column: &Vec<f64>| dot(column, column).sqrt();
        fine.iter().zip(&rough).any(|(fine, rough)| length(fine) > JAGGED * length(rough))
    }

    /// The same fit carried on by differences so large that they look across jags: from where it is, and from
    /// where its laws are larger, since the jag that a fit has ended in is lower than all around it, and
    /// while a law was missing the model's own parameters have made up for a part of it.
    pub(crate) fn across_the_jags(&self, stack: &Stack<'_>) -> Self {
        let from = |times: &f64| {
            let (mut values, mut starts) = (self.with_larger_laws(*times), self.initial_states());
            let mut best: Option<Self> = None;
            for effort in Effort::ROUGH {
                let found = fit(stack, &self.hypothesis, &self.free, &values, &starts, effort);
                let before = best.as_ref().map_or(f64::INFINITY, |best| best.sum_of_squares);
                if let Some(found) = found.filter(|found| found.sum_of_squares < before) {
                    (values, starts) = (found.values.clone(), found.initial_states());
                    best = Some(found);
                }
            }
            best
        };
        let found = LARGER.iter().filter_map(from);
        let best = found.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
        best.filter(|best| best.sum_of_squares < self.sum_of_squares).unwrap_or_else(|| self.clone())
    }

    /// The values, every one of a law's so many times as large, within its bounds.
    pub(crate) fn with_larger_laws(&self, times: f64) -> Vec<f64> {
        let rows = self.free.iter().zip(&self.values);
        let larger = rows.map(|(free, value)| {
            let larger = if free.path.starts_with("physics.") { times * value } else { *value };
            larger.max(free.lower).min(free.upper)
        });
        larger.collect()
    }

    fn sensitivities_by(&self, stack: &Stack<'_>, central: bool) -> Vec<Vec<f64>> {
        // By innovations what is left is as loud as noise by definition.
        let is_loud = stack.even_square(&self.records) > LOUD * stack.present() as f64;
        let difference = if is_loud && self.is_jagged(stack) { ROUGH_DIFFERENCE } else { DIFFERENCE };
        let all: Vec<usize> = (0..self.free.len()).collect();
        self.differences(stack, &all, central, difference)
    }

    fn differences(
        &self,
        stack: &Stack<'_>,
        parameters: &[usize],
        central: bool,
        difference: f64,
    ) -> Vec<Vec<f64>> {
        let problem = Problem {
            stack,
            hypothesis: &self.hypothesis,
            free: &self.free,
            near: self.records.clone(),
            moving: Vec::new(),
            absorbing: None,
            budget: AtomicUsize::new(0),
            central,
            kept_steps: 0,
            difference,
            kept: Mutex::default(),
            fresh: Mutex::default(),
        };
        let search: Vec<f64> = self.free.iter().zip(&self.values).map(|(p, v)| p.to_search(*v)).collect();
        let point = Point { records: self.records.clone(), residuals: Vec::new() };
        let mut jacobian = problem.columns(&search, &point, parameters);
        jacobian.iter_mut().flatten().for_each(|value| *value = -*value);
        jacobian
    }

    /// All residuals, recording after recording.
    pub(crate) fn residuals(&self) -> Vec<f64> {
        self.records.iter().flat_map(|record| record.residuals.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;
    use stillbeam_recording::Role;

    use super::*;
    use crate::noise::{NoiseFloor, NoiseSource};
    use crate::parameters::free_parameters;
    use crate::study::{OnAll, Study};
    use crate::two_bodies::{NOISE_M, played, slide, stuck_in_a_jag};

    /// By innovations what is left is as loud as noise by definition.
    #[test]
    fn errors_are_of_large_differences_in_a_jag_where_readings_are_weighted_by_innovations_too() {
        let mut study = played(6.6e-4);
        let fine = stuck_in_a_jag(&study);
        let floor = NoiseFloor { rms: NOISE_M, source: NoiseSource::Repeats, samples: 4000.0 };
        study.weigh_by_floors(&[Some(floor.clone()), Some(floor)]);
        let weighted = |study: &Study| {
            let stack = study.stack(Role::Train);
            let records = stack.evaluate(&fine.hypothesis, &fine.initial_states()).unwrap();
            let sum_of_squares = records.iter().map(|fit| dot(&fit.residuals, &fit.residuals)).sum();
            Fitted { records, sum_of_squares, ..fine.clone() }
        };
        let left = OnAll { train: weighted(&study).records, held_out: Vec::new() };
        assert!(study.weigh_by_innovations(&left));
        let (stack, by_innovations) = (study.stack(Role::Train), weighted(&study));
        assert!(by_innovations.sum_of_squares < LOUD * stack.present() as f64);
        assert!(by_innovations.is_jagged(&stack));
        let all: Vec<usize> = (0..fine.free.len()).collect();
        let large = by_innovations.differences(&stack, &all, true, ROUGH_DIFFERENCE);
        assert!(by_innovations.sensitivities(&stack) == large);
    }

    #[test]
    fn large_differences_lead_across_the_jags_that_play_makes() {
        let study = played(6.6e-4);
        let stack = study.stack(Role::Train);
        let fine = stuck_in_a_jag(&study);
        let rough = fine.across_the_jags(&stack);
        assert!(fine.is_jagged(&stack));
        let gap = |fitted: &Fitted| fitted.hypothesis.model.setup().physics[0].parameters["gap"];
        let told = format!(
            "{} {:.3e}; {} {:.3e}",
            rough.sum_of_squares,
            gap(&rough),
            fine.sum_of_squares,
            gap(&fine)
        );
        assert!(rough.sum_of_squares < 0.75 * fine.sum_of_squares, "{told}");
        assert!((gap(&rough) / 6.6e-4 - 1.0).abs() < 0.1, "{told}");
        let cubic = Physics::new("cubic_stiffness", "motor").with("stiffness", 1e6);
        let smooth = slide(30200.0, &[cubic]);
        let hypothesis = Hypothesis::given(&smooth);
        let free = free_parameters(&hypothesis);
        let start: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
        let fitted = fit(&stack, &hypothesis, &free, &start, &[], Effort::TRIAL).unwrap();
        assert!(!fitted.is_jagged(&stack), "a smooth law");
    }
}
