//! A look at what a model leaves where its frequencies are other ones, before anything is fitted.
//!
//! A lightly damped structure responds in a narrow band, and a start beside it may end in the wrong valley:
//! every frequency of the model's own is first looked for around its drawn value, the others standing still.

use rayon::prelude::*;
use stillbeam_identify::tall::dot;

use crate::parameters::FreeParameter;
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::{RecordFit, Stack};

/// A scan is thinned out where it would look at more samples than this, every frequency's counted.
const MUCH_TO_SCAN: usize = 300_000;
/// Logarithms of frequencies are scanned in steps of this size: half the valley of a mode damped by half a
/// per cent, or of one that is seen for a hundred periods.
const SCAN_STEP: f64 = 0.005;
/// How far from the drawn value a frequency is looked for, each round nearer to where the last one ended: as
/// a drawing is usually wrong, ...
pub(crate) const SCAN_REACHES: [f64; 2] = [0.12, 0.024];
/// ... and where a refit from there fails: masses and stiffnesses a third off both ways.
pub(crate) const WIDE_SCAN_REACHES: [f64; 3] = [0.4, 0.12, 0.024];
/// Steps to either side at least.
const FEWEST_STEPS: i32 = 24;

/// These values with the frequencies that leave least within so wide reaches of them.
pub(crate) fn scanned(
    stack: &Stack<'_>,
    given: &Hypothesis,
    free: &[FreeParameter],
    drawn: &[f64],
    reaches: &[f64],
) -> Vec<f64> {
    let frequencies: Vec<usize> =
        (0..free.len()).filter(|&index| !free[index].is_added && free[index].sets_frequency()).collect();
    // Many modes on long recordings are looked at in fewer samples, and from the initial states of the given
    // model.
    let work = stack.present() * frequencies.len();
    let is_driven = stack.records.iter().all(|record| record.input.is_some());
    let is_large = work > MUCH_TO_SCAN && is_driven && stack.is_even();
    let nth = if is_large { 2 * work / MUCH_TO_SCAN } else { 1 };
    let thin: Vec<Record> = stack.records.iter().map(|record| record.thinned(nth)).collect();
    let stack = &Stack { records: thin.iter().collect(), ..stack.clone() };
    // Those of decays every look would find in many simulations beside laws.
    let finds_states = !is_driven && !given.is_linear();
    let near = given.with_values(free, drawn).filter(|_| is_large || finds_states);
    let near = near.and_then(|given| stack.evaluate(&given, &[]));
    Scan { stack, given, free, near }.around(drawn, &frequencies, reaches)
}

/// A model that leaves more than this share of an output is out of step with it.
pub(crate) const IN_STEP: f64 = 0.6;

/// The largest share of an output that a fit leaves of a recording, root mean square.
pub(crate) fn largest_share(stack: &Stack<'_>, records: &[RecordFit]) -> f64 {
    let shares = records.iter().enumerate().map(|(index, fit)| {
        let nothing: Vec<Vec<f64>> = fit.simulated.iter().map(|signal| vec![0.0; signal.len()]).collect();
        let mut recorded = stack.departure(index, &nothing);
        fit.nuisances.remove_from(&mut recorded);
        (dot(&fit.residuals, &fit.residuals) / dot(&recorded, &recorded)).sqrt()
    });
    shares.fold(0.0, f64::max)
}

struct Scan<'s> {
    stack: &'s Stack<'s>,
    given: &'s Hypothesis,
    free: &'s [FreeParameter],
    /// Fits whose initial states are used; without, every look finds its own.
    near: Option<Vec<RecordFit>>,
}

impl Scan<'_> {
    fn around(&self, start: &[f64], frequencies: &[usize], reaches: &[f64]) -> Vec<f64> {
        let mut values = start.to_vec();
        for reach in reaches {
            let steps = ((reach / SCAN_STEP) as i32).max(FEWEST_STEPS);
            for &index in frequencies {
                if self.stack.is_spent() {
                    return values;
                }
                let (centre, free) = (values[index], &self.free[index]);
                // Frequencies go with the root of a stiffness.
                let power = if free.path.ends_with("frequency_hz") { 1.0 } else { 2.0 };
                let sums = (-steps..=steps).into_par_iter().filter_map(|step| {
                    let value = centre * (power * reach * f64::from(step) / f64::from(steps)).exp();
                    let mut trial = values.clone();
                    trial[index] = value;
                    let sum = self.sum_of_squares(&trial)?;
                    (value >= free.lower && value <= free.upper).then_some((sum, value))
                });
                if let Some((_, best)) = sums.min_by(|a, b| a.0.total_cmp(&b.0)) {
                    values[index] = best;
                }
            }
        }
        values
    }

    fn sum_of_squares(&self, values: &[f64]) -> Option<f64> {
        let moved = self.given.with_values(self.free, values)?;
        let seen = match &self.near {
            Some(near) => self.stack.seen_from(&moved, near),
            None => self.stack.evaluate(&moved, &[]),
        };
        Some(seen?.iter().map(|record| dot(&record.residuals, &record.residuals)).sum())
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Physics;
    use stillbeam_recording::Role;

    use super::*;
    use crate::naming::on_a_spring::{let_go, machine, searched_around, unpushed};
    use crate::parameters::free_parameters;

    const STIFFNESS: &str = "spring.mass-ground.stiffness";

    #[test]
    fn beside_a_law_a_decay_is_looked_at_once_for_every_frequency() {
        let friction = Physics::new("coulomb_friction", "mass").with("force", 0.05);
        let mut truth = machine();
        truth.set_parameter(STIFFNESS, 318.0).unwrap();
        truth.setup_mut().physics = vec![friction.clone()];
        let decays = |from_m: &[f64]| let_go(&truth, from_m, 1e-6);
        searched_around(&unpushed(), &decays(&[0.02, 0.01]), &decays(&[0.015]), |search, _| {
            let mut beside = Hypothesis::given(search.given);
            beside.model.setup_mut().physics = vec![friction];
            let free = free_parameters(&beside);
            let drawn: Vec<f64> = free.iter().map(|parameter| parameter.given).collect();
            let stack = search.study.stack(Role::Train);
            let simulations = || stack.records.iter().map(|r| r.work.so_far().simulations).sum::<u64>();
            let before = simulations();
            let found = scanned(&stack, &beside, &free, &drawn, &SCAN_REACHES);
            let place = free.iter().position(|parameter| parameter.path == STIFFNESS).unwrap();
            assert!((found[place] / 318.0 - 1.0).abs() < 0.01, "{} N/m", found[place]);
            let looks = 2 * (2 * FEWEST_STEPS as u64 + 1) * SCAN_REACHES.len() as u64;
            let made = simulations() - before;
            assert!(made < 2 * looks, "{made} simulations for {looks} looks at a recording");
        });
    }
}
