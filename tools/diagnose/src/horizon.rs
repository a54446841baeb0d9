//! Fits over a lengthening horizon.
//!
//! Where a law decides when something happens, play that is crossed or a stop that is struck, a small error
//! of a parameter moves the first such moment a little, every later one by more, and in the end the whole
//! motion: over a long recording the sum of squares has a valley for every way in which the moments can fall,
//! and the right one is a needle. Over the first seconds hardly any moments have come, and its valley is as
//! wide as that of a smooth law. The fit there is a start for a stretch a little longer, and so on to the
//! end; where a longer stretch leaves more per sample than a shorter one, the step was too long and is
//! halved. Multiple shooting cuts a recording for the same reason (E. Baake, M. Baake, H. Bock and K. Briggs,
//! Fitting ordinary differential equations to chaotic data, Physical Review A 45, 1992); a machine that
//! begins at rest needs no states in between.

use crate::effort::Effort;
use crate::fit::{Fitted, fit};
use crate::record::Record;
use crate::stacking::Stack;

/// Share of every recording that is fitted to first, ...
const FIRST: f64 = 0.125;
/// ... or as many times this as give every parameter so many samples.
const SAMPLES_PER_PARAMETER: usize = 20;
/// There the laws are begun at these multiples of what they are: the shortest stretch has more than one
/// valley too, and a fit that ends in the wrong one seldom finds out of it on the way. ...
const BEGUN_AT: [f64; 3] = [1.0, 0.75, 1.3];
/// ... At these as well where those do not end alike, ...
const BEGUN_BETWEEN: [f64; 3] = [0.87, 1.15, 1.5];
/// ... to this share of what they leave.
const ALIKE: f64 = 0.01;
/// Each fit looks across the jags of the laws first, then closer.
const CLOSER_AND_CLOSER: [Effort; 3] = [Effort::ROUGH[0], Effort::ROUGH[1], Effort::BENT];
/// The largest and the smallest share of a recording by which the stretch is lengthened, ...
const LONGEST_STEP: f64 = 0.25;
const SHORTEST_STEP: f64 = 0.02;
/// ... and the fits made at most.
const MOST_FITS: usize = 24;
/// A longer stretch is off the way where it leaves more than so many times the least mean square of the
/// shorter ones.
const ASTRAY: f64 = 1.2;

impl Fitted {
    /// The same parameters fitted to the beginning of every recording, then to more and more of it; `None`
    /// where no fit comes to the end. What it leaves may be more than this fit leaves.
    ///
    /// A mean square of `allowed` is never off the way: where other laws are missing besides, a longer
    /// stretch always leaves more.
    pub(crate) fn over_a_lengthening_horizon(&self, stack: &Stack<'_>, allowed: f64) -> Option<Self> {
        let enough = SAMPLES_PER_PARAMETER * self.free.len();
        let mut share = FIRST * (enough as f64 / (FIRST * stack.present() as f64)).ceil().max(1.0);
        let mut step = share;
        let mut way = self.begun_up_to(share, stack)?;
        let mut least = way.mean_square;
        for _ in 0..MOST_FITS {
            if share >= 1.0 || stack.is_spent() {
                break;
            }
            let longer = if share + step > 1.0 - SHORTEST_STEP { 1.0 } else { share + step };
            let next = self.fitted_up_to(longer, stack, &way.fitted.values, &way.fitted.initial_states())?;
            if next.mean_square > (ASTRAY * least).max(allowed) && step > SHORTEST_STEP {
                step = (0.5 * (longer - share)).max(SHORTEST_STEP);
                continue;
            }
            least = least.min(next.mean_square);
            (way, share) = (next, longer);
            step = (2.0 * step).min(LONGEST_STEP);
        }
        (share >= 1.0).then_some(way.fitted)
    }

    /// The best of several fits to this share of every recording.
    fn begun_up_to(&self, share: f64, stack: &Stack<'_>) -> Option<OnTheWay> {
        let begun = |times: &f64| {
            self.fitted_up_to(share, stack, &self.with_larger_laws(*times), &self.initial_states())
        };
        let mut all: Vec<OnTheWay> = BEGUN_AT.iter().filter_map(begun).collect();
        let [least, most] = [f64::min, f64::max].map(|of| all.iter().map(|way| way.mean_square).reduce(of));
        if most? - least? > ALIKE * least? {
            all.extend(BEGUN_BETWEEN.iter().filter_map(begun));
        }
        all.into_iter().min_by(|a, b| a.mean_square.total_cmp(&b.mean_square))
    }

    /// Fitted to this share of every recording, from these values and initial states.
    fn fitted_up_to(
        &self,
        share: f64,
        stack: &Stack<'_>,
        values: &[f64],
        starts: &[Vec<f64>],
    ) -> Option<OnTheWay> {
        let on = |stack: &Stack<'_>| {
            let mut best: Option<Self> = None;
            for effort in CLOSER_AND_CLOSER {
                let from = best.as_ref().map(|best| (best.values.clone(), best.initial_states()));
                let (values, starts) = from.unwrap_or_else(|| (values.to_vec(), starts.to_vec()));
                let before = best.as_ref().map_or(f64::INFINITY, |best| best.sum_of_squares);
                let found = fit(stack, &self.hypothesis, &self.free, &values, &starts, effort);
                best = found.filter(|found| found.sum_of_squares < before).or(best);
            }
            let fitted = best?;
            let mean_square = fitted.sum_of_squares / stack.present().max(1) as f64;
            Some(OnTheWay { fitted, mean_square })
        };
        if share >= 1.0 {
            return on(stack);
        }
        let parts: Vec<Record> = stack.records.iter().map(|record| record.up_to(share)).collect();
        on(&Stack { records: parts.iter().collect(), ..stack.clone() })
    }
}

/// A fit to a part of the recordings.
struct OnTheWay {
    fitted: Fitted,
    /// Of its weighted residuals.
    mean_square: f64,
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Role;

    use super::{BEGUN_AT, BEGUN_BETWEEN, CLOSER_AND_CLOSER, FIRST};
    use crate::fit::Fitted;
    use crate::naming::on_a_spring::{fitted_with, searched_beside_a_hardening_spring};
    use crate::stacking::Stack;
    use crate::two_bodies::{played, stuck_in_a_jag};

    /// Starts that were taken for the first stretch of the recordings.
    fn starts(fitted: &Fitted, stack: &Stack<'_>) -> u64 {
        let fits = || stack.records[0].work.so_far().fits;
        let before = fits();
        fitted.begun_up_to(FIRST, stack).unwrap();
        (fits() - before) / CLOSER_AND_CLOSER.len() as u64
    }

    #[test]
    fn more_starts_are_taken_only_where_the_first_ones_end_in_different_valleys() {
        searched_beside_a_hardening_spring(|search, refitted, spring| {
            let smooth = fitted_with(search, &refitted, spring).fitted;
            assert_eq!(starts(&smooth, &search.study.stack(Role::Train)), BEGUN_AT.len() as u64);
        });
        let study = played(6.6e-4);
        let all = (BEGUN_AT.len() + BEGUN_BETWEEN.len()) as u64;
        assert_eq!(starts(&stuck_in_a_jag(&study), &study.stack(Role::Train)), all);
    }

    #[test]
    fn play_that_a_fit_to_whole_recordings_misses_is_found_from_their_beginnings() {
        for gap_m in [6.6e-4, 3.6e-4, 2.8e-4] {
            let study = played(gap_m);
            let stack = study.stack(Role::Train);
            let stuck = stuck_in_a_jag(&study);
            let gap =
                |fitted: &Fitted| fitted.hypothesis.model.setup().physics[0].parameters["gap"] / gap_m - 1.0;
            assert!(gap(&stuck).abs() > 0.05, "not stuck: {}", gap(&stuck));
            let found = stuck.over_a_lengthening_horizon(&stack, 0.0).unwrap();
            let ratio = found.sum_of_squares / stuck.sum_of_squares;
            assert!(gap(&found).abs() < 0.02 && ratio < 0.1, "{} ({ratio})", gap(&found));
        }
    }
}
