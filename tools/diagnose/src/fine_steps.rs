//! Sub-steps as fine as the noise asks.
//!
//! What sub-steps get wrong of a law's force is a rest like any other: where the noise is small beside the
//! motion, a further law may seem to explain it, the more so one that is simulated in shorter steps. So they
//! are halved until that changes what a machine does by next to nothing of the noise.

use stillbeam_recording::Role;

use crate::fit::Fitted;
use crate::record::Record;
use crate::simulation::simulate;
use crate::study::Study;

/// What one more halving may change, in shares of the noise's power. Errors of steps along smooth forces fall
/// to a sixteenth with it, those of dry friction to a quarter.
const NOTHING: f64 = 1e-3;
/// Halvings at most: every one costs as much time again.
const MOST_HALVINGS: u32 = 4;
/// One that leaves more than this share of what the one before changed leads nowhere: the machine chatters.
const NO_USE: f64 = 0.5;

impl Study {
    /// Halves the sub-steps of all recordings as the noise asks beside the laws of this fit, outputs being
    /// weighted by it; whether that was needed.
    pub(crate) fn halve_steps(&mut self, fitted: &Fitted) -> bool {
        let before = self.halvings();
        let mut changed_before = f64::INFINITY;
        while !fitted.hypothesis.is_linear() && self.halvings() < MOST_HALVINGS {
            let Some(changed) = self.changed_by_halving(fitted) else { break };
            if changed <= NOTHING || changed > NO_USE * changed_before {
                break;
            }
            changed_before = changed;
            for record in self.train.iter_mut().chain(&mut self.held_out) {
                record.sub_steps = record.sub_steps.halved();
            }
        }
        self.halvings() > before
    }

    fn halvings(&self) -> u32 {
        self.train.first().map_or(0, |record| record.sub_steps.halvings)
    }

    /// Mean square of what halved steps change in the training recordings, in units of the noise's.
    fn changed_by_halving(&self, fitted: &Fitted) -> Option<f64> {
        let stack = self.stack(Role::Train);
        let mut sum = 0.0;
        for (index, (record, fit)) in self.train.iter().zip(&fitted.records).enumerate() {
            let finer = Record { sub_steps: record.sub_steps.halved(), ..record.clone() };
            let [whole, half] =
                [record, &finer].map(|record| simulate(&fitted.hypothesis, record, &fit.initial));
            let changed = whole?
                .into_iter()
                .zip(half?)
                .map(|(whole, half)| whole.into_iter().zip(half).map(|(a, b)| b - a).collect::<Vec<f64>>());
            let changed = stack.weighted(index, &changed.collect::<Vec<_>>());
            sum += changed.iter().map(|value| value * value).sum::<f64>();
        }
        Some(sum / stack.present().max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Hold;

    use crate::comparison::compare;
    use crate::naming::on_a_spring::{hardening, machine, noisy_runs};
    use crate::simulation::Hypothesis;
    use crate::study::Study;

    #[test]
    fn steps_are_halved_where_the_noise_shows_what_they_get_wrong_and_nowhere_else() {
        // Forces in straight lines, as they are simulated: nothing else is wrong.
        let given = hardening(machine(), 3e4).with_hold(Hold::FirstOrder);
        for (noise_m, is_halved) in [(1e-3, false), (1e-7, true)] {
            let noisy = |amplitudes: &[f64]| noisy_runs(&given, amplitudes, noise_m);
            let mut study = Study::new(&given, &noisy(&[20.0, 30.0]), &noisy(&[25.0])).unwrap();
            compare(&mut study, &Hypothesis::given(&given)).unwrap();
            assert_eq!(study.halvings() > 0, is_halved, "{} times at {noise_m} m", study.halvings());
            let of_all = study.train.iter().chain(&study.held_out);
            assert!(of_all.clone().all(|record| record.sub_steps.halvings == study.halvings()));
        }
    }

    #[test]
    fn a_machine_without_laws_needs_no_steps() {
        let noisy = |amplitudes: &[f64]| noisy_runs(&machine(), amplitudes, 1e-9);
        let mut study = Study::new(&machine(), &noisy(&[20.0, 30.0]), &noisy(&[25.0])).unwrap();
        compare(&mut study, &Hypothesis::given(&machine())).unwrap();
        assert_eq!(study.halvings(), 0);
    }
}
