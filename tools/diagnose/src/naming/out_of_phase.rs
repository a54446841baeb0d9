//! Where the first law is looked for when the refit is out of phase with the recordings.
//!
//! A pendulum swings slower the wider it swings. A linear model of whatever frequency is out of step with it
//! after some periods, and around a model that is out of step no law does what the recording shows: the
//! screen sees little of the true one and as much of many others. Over the first periods one frequency does
//! for all; what is missing there is what is missing everywhere. The law is looked for there, and its fit
//! then follows the recordings to their ends over a lengthening horizon.

use stillbeam_identify::tall::dot;

use super::rounds::{Beside, Tried};
use super::selection::Search;
use super::sets::Member;
use crate::parameters::free_parameters;
use crate::record::Record;
use crate::refit::refit;
use crate::simulation::Hypothesis;
use crate::study::{Study, reach};

/// A refit is out of phase where it leaves more than this share of a recording.
const OUT_OF_PHASE: f64 = 0.4;
/// It is in phase where it leaves less than this share of the beginnings.
const IN_PHASE: f64 = 0.25;
/// Beginnings, as shares of every recording, the longest first, ...
const BEGINNINGS: [f64; 4] = [0.25, 0.125, 0.0625, 0.03];
/// ... that have at least so many samples.
const LEAST_SAMPLES: usize = 150;
/// Laws found there that are followed to the end.
const FOLLOWED: usize = 3;

impl Search<'_> {
    /// Laws found at the beginnings of the recordings, fitted to all of them.
    pub(super) fn tried_at_the_beginnings(&self, refitted: &Member) -> Vec<Tried> {
        if self.patience.is_spent() || !self.study.is_out_of_phase(refitted) {
            return Vec::new();
        }
        BEGINNINGS.iter().find_map(|&share| self.tried_over(share, refitted)).unwrap_or_default()
    }

    /// The same over one share; `None` where the model refitted to it is out of phase there too.
    fn tried_over(&self, share: f64, refitted: &Member) -> Option<Vec<Tried>> {
        let mut study = self.study.up_to(share)?;
        let given = Hypothesis::given(self.given);
        let begun = Search {
            study: &mut study,
            given: self.given,
            candidates: self.candidates,
            options: self.options,
            given_laws: self.given_laws,
            floors: self.floors.clone(),
            weighed_again: true,
            held_out_starts: self.held_out_starts.clone(),
            patience: self.patience,
            rounds: std::sync::Mutex::default(),
        };
        let (fitted, _) = refit(&begun.train(), &given, &free_parameters(&given)).ok()?;
        let base = begun.member(Vec::new(), fitted)?;
        if begun.study.most_left(&base) > IN_PHASE {
            return None;
        }
        begun.study.weigh_by_own_noise();
        let base = begun.reweighted(base)?;
        let (_, mut found) = begun.tried_around(&base, Beside { rival: &base, drawing: None, place: None });
        found.sort_by(|a, b| a.member.fitted.sum_of_squares.total_cmp(&b.member.fitted.sum_of_squares));
        let all = self.train();
        let followed = found.into_iter().take(FOLLOWED).filter_map(|found| {
            let fitted = found.member.fitted.over_a_lengthening_horizon(&all)?;
            let member = self.member(found.member.laws, fitted)?;
            Some(self.judged_on(refitted, member, found.candidate))
        });
        Some(followed.collect())
    }
}

impl Study {
    /// The training recordings' beginnings; `None` where they are too short.
    fn up_to(&self, share: f64) -> Option<Self> {
        let train: Vec<Record> = self.train.iter().map(|record| record.up_to(share)).collect();
        let mut outputs = train.iter().flat_map(|record| &record.outputs);
        outputs.all(|output| output.samples.len() >= LEAST_SAMPLES).then(|| Self { train, ..self.clone() })
    }

    /// The largest share, root mean square, that a set leaves of any output of any training recording.
    fn most_left(&self, member: &Member) -> f64 {
        let on_all = member.on_all();
        let parts = (0..self.weights.len()).flat_map(|output| self.parts(&on_all, output));
        let shares = parts.filter(|part| part.record.role == stillbeam_recording::Role::Train).map(|part| {
            let left = dot(&part.residual, &part.residual) / part.residual.len().max(1) as f64;
            left.sqrt() / reach(&part.record.outputs[part.output].samples).max(f64::MIN_POSITIVE)
        });
        shares.fold(0.0, f64::max)
    }

    /// Whether a set leaves so much of a recording that nothing but its initial state moves that the two are
    /// out of step.
    fn is_out_of_phase(&self, member: &Member) -> bool {
        let rings = self.train.iter().any(|record| record.input.is_none());
        rings && self.most_left(member) > OUT_OF_PHASE
    }
}
