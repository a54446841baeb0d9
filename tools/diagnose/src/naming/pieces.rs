//! Where laws are looked for when the refit is out of phase with free decays.
//!
//! A pendulum swings slower the wider it swings. A linear model of whatever frequency is out of step with it
//! after some periods, and around a model that is out of step no law does what the recording shows: the
//! screen sees little of the true one and as much of many others. Over a few periods one frequency does for
//! all. The recordings are cut into pieces, every one with an initial state of its own, that show the machine
//! at large and at small amplitudes; what is missing there is missing everywhere. Multiple shooting cuts a
//! recording for the same reason (H. G. Bock, 1983). The laws found in the pieces are then followed through
//! the whole recordings over a lengthening horizon. Where something drives a machine, it is held to the
//! recorded motion instead ([`super::guided`]).

use stillbeam_plant::Model;
use stillbeam_recording::Role;

use super::rounds::Tried;
use super::screening::Screened;
use super::selection::Search;
use super::sets::Member;
use crate::comparison::compare;
use crate::effort::Effort;
use crate::fit::Fitted;
use crate::noise::NoiseFloor;
use crate::phase::OUT_OF_PHASE;
use crate::record::Record;
use crate::simulation::Hypothesis;
use crate::stacking::RecordFit;
use crate::study::{OnAll, Study, reach};

/// A refit is in phase where it leaves less than this share of every piece: what is missing looks like what
/// it is while the two are within a radian of each other.
const IN_PHASE: f64 = 0.6;
/// Lengths of the pieces in periods of the slowest motion, the longest first, ...
const LENGTHS: [f64; 4] = [16.0, 8.0, 4.0, 2.0];
/// ... of which so many are taken at most, spread evenly over the recording.
const MOST_PIECES: usize = 6;
/// Laws that are followed through the whole recordings: over a few periods several do the same.
const FOLLOWED: usize = 3;

/// A law found in pieces and fitted to the whole of the training recordings.
pub(super) struct FoundInPieces {
    pub(super) laws: Vec<usize>,
    pub(super) fitted: Fitted,
    /// The noise in units of which it was fitted.
    pub(super) floors: Vec<Option<NoiseFloor>>,
    /// States in which the held-out recordings begin beside it: from those of another machine no slope may
    /// lead to them.
    pub(super) held_out_starts: Vec<Vec<f64>>,
    /// What the screen saw of all laws in the pieces.
    pub(super) screened: Vec<Screened>,
    /// Sums of squares that the other laws leave of the whole recordings that were followed through them.
    pub(super) others_left: Vec<f64>,
}

impl Search<'_> {
    /// The law found in pieces of free decays, followed through the whole of them; `None` where something
    /// drives the recordings, where the refit is in phase, and where no law is found.
    pub(super) fn found_in_pieces(&self, refitted: &Member) -> Option<FoundInPieces> {
        if !self.study.is_free() || !self.is_out_of_phase(refitted) {
            return None;
        }
        LENGTHS.iter().take_while(|_| !self.is_over()).find_map(|&periods| self.found_in(periods))
    }

    /// Whether a refit is out of phase with some recording.
    pub(super) fn is_out_of_phase(&self, refitted: &Member) -> bool {
        self.study.most_left(&refitted.on_all()) > OUT_OF_PHASE
    }

    /// The same with pieces of one length; `None` also where the refit is out of phase in one of them.
    fn found_in(&self, periods: f64) -> Option<FoundInPieces> {
        let (mut study, [firsts, held_out_firsts]) = self.study.in_pieces(self.given, periods)?;
        let compared = compare(&mut study, &Hypothesis::given(self.given)).ok()?;
        if study.left_of_all(&compared.refitted_on_all) > IN_PHASE {
            return None;
        }
        let held_out = compared.refitted_on_all.held_out.clone();
        let search = Search {
            study: &mut study,
            floors: compared.floors.clone(),
            weighed_again: false,
            in_pieces: true,
            held_out_starts: held_out.iter().map(|fit| fit.initial.clone()).collect(),
            rounds: std::sync::Mutex::default(),
            ..*self
        };
        let refitted = Member { laws: Vec::new(), fitted: compared.refitted, held_out };
        let (screened, mut found) = search.round(&refitted);
        found.sort_by(|a, b| a.member.fitted.sum_of_squares.total_cmp(&b.member.fitted.sum_of_squares));
        let of_first = |fits: &[RecordFit], firsts: &[usize]| -> Vec<RecordFit> {
            firsts.iter().map(|&first| fits[first].clone()).collect()
        };
        if !found.iter().any(Tried::passes) {
            return None;
        }
        // Beside the best of them the noise is seen, in units of which the way is followed.
        let floors = search.study.floors(&found.first()?.member.on_all());
        let mut weighed = self.study.clone();
        let floors = if weighed.much_lower(&floors, &self.floors) { floors } else { self.floors.clone() };
        weighed.weigh_by_floors(&floors);
        let search =
            Search { study: &mut weighed, in_pieces: false, rounds: std::sync::Mutex::default(), ..search };
        let whole = search.study.stack(Role::Train);
        let followed = found.into_iter().take(FOLLOWED).filter_map(|found| {
            let Member { laws, fitted, held_out } = found.member;
            let begun = Fitted { records: of_first(&fitted.records, &firsts), ..fitted };
            let fitted = begun.over_a_lengthening_horizon(&whole, search.study.square_in_phase())?;
            // Which of them is it shows where they are fitted to the end.
            let finished = search.fitted_on(&fitted, Effort::FULL).unwrap_or(fitted);
            let held_out = of_first(&held_out, &held_out_firsts);
            let held_out_starts = held_out.into_iter().map(|fit| fit.initial).collect();
            Some((laws, finished, held_out_starts))
        });
        let mut followed: Vec<(Vec<usize>, Fitted, Vec<Vec<f64>>)> = followed.collect();
        followed.sort_by(|a, b| a.1.sum_of_squares.total_cmp(&b.1.sum_of_squares));
        let others_left = followed.iter().skip(1).map(|(_, fitted, _)| fitted.sum_of_squares).collect();
        let (laws, fitted, held_out_starts) = followed.into_iter().next()?;
        Some(FoundInPieces { laws, fitted, floors, held_out_starts, screened, others_left })
    }
}

impl Study {
    /// A study of pieces of the recordings, each so many periods of the slowest motion long; and which of its
    /// training recordings, and of its held-out ones, are the first pieces. `None` where nothing says how
    /// long a period is, and where a piece would be no piece or too short to be read.
    fn in_pieces(&self, model: &Model, periods: f64) -> Option<(Self, [Vec<usize>; 2])> {
        let length_s = periods / self.slowest_hz.filter(|hz| *hz > 0.0)?;
        let cut = |record: &Record| {
            record.pieces(length_s / record.duration_s(), MOST_PIECES, model, self.fastest_hz)
        };
        let train: Vec<Vec<Record>> = self.train.iter().map(cut).collect::<Option<_>>()?;
        let held_out: Vec<Vec<Record>> = self.held_out.iter().map(cut).collect::<Option<_>>()?;
        let firsts = [&train, &held_out].map(|cut| {
            let first = |number: usize| cut[..number].iter().map(Vec::len).sum();
            (0..cut.len()).map(first).collect()
        });
        let study = Self {
            train: train.concat(),
            held_out: held_out.concat(),
            weights: vec![1.0; self.weights.len()],
            ..self.clone()
        };
        Some((study, firsts))
    }

    /// Whether a model leaves so much of a free decay that the two are out of step: nothing but its initial
    /// state holds it to the recording, whereas what drives a machine keeps it in step.
    fn is_out_of_step(&self, on_all: &OnAll) -> bool {
        self.is_free() && self.most_left(on_all) > OUT_OF_PHASE
    }

    /// Whether nothing drives any of its recordings.
    pub(super) fn is_free(&self) -> bool {
        self.train.iter().all(|record| record.input.is_none())
    }

    /// A refit that is out of phase begun again from the model as given, over a lengthening horizon, where
    /// that leaves less: from a start a few periods off no slope leads back.
    pub(crate) fn in_phase(&self, refitted: Fitted, given: &Hypothesis) -> Fitted {
        let on_all = OnAll { train: refitted.records.clone(), held_out: Vec::new() };
        if !self.is_out_of_step(&on_all) {
            return refitted;
        }
        let values = refitted.free.iter().map(|parameter| parameter.given).collect();
        let begun = Fitted { values, hypothesis: given.clone(), ..refitted.clone() };
        let longer = begun.over_a_lengthening_horizon(&self.stack(Role::Train), self.square_in_phase());
        longer.filter(|longer| longer.sum_of_squares < refitted.sum_of_squares).unwrap_or(refitted)
    }

    /// The mean square of weighted residuals at which a model is in phase with every output.
    fn square_in_phase(&self) -> f64 {
        let outputs = self.train.iter().flat_map(|record| &record.outputs);
        let shares = outputs.map(|output| IN_PHASE * self.weights[output.index] * reach(&output.samples));
        shares.fold(f64::INFINITY, f64::min).powi(2)
    }
}
