//! The shortest shaper that is robust enough, and its neighbours.

use stillbeam_shape::StageType;

use super::error::TuningError;
use super::figures::{percent, seconds};
use super::shaper_names::{kind, shaper_name};
use crate::shaping::Candidate;

/// All shapers that there are, and which of them to take.
#[derive(Clone, Debug, PartialEq)]
pub struct Recommendation {
    /// Shortest first.
    candidates: Vec<Candidate>,
    best: usize,
    tolerance: f64,
}

impl Recommendation {
    /// Takes the shortest that leaves at most the tolerance, a fraction, of every mode anywhere in its box.
    ///
    /// # Errors
    /// [`TuningError`] when there is none.
    pub fn among(mut candidates: Vec<Candidate>, tolerance: f64, rate_hz: f64) -> Result<Self, TuningError> {
        candidates.sort_by(|a, b| a.table.duration_s().total_cmp(&b.table.duration_s()));
        // For one mode the shortest possible shaper is that of specified insensitivity.
        candidates.dedup_by(|later, earlier| later.table == earlier.table);
        if let Some(best) = candidates.iter().position(|candidate| candidate.holds(tolerance)) {
            return Ok(Self { candidates, best, tolerance });
        }
        let least = candidates.iter().min_by(|a, b| a.worst().total_cmp(&b.worst()));
        Err(match least {
            None => TuningError::NothingRuns { rate_hz },
            Some(least) => TuningError::NothingHolds {
                tolerance: percent(tolerance),
                name: shaper_name(least),
                worst: percent(least.worst()),
                length: seconds(least.table.duration_s()),
            },
        })
    }

    /// The one to take.
    pub fn best(&self) -> &Candidate {
        &self.candidates[self.best]
    }

    /// The next shorter one, which leaves more than the tolerance.
    pub fn next_shorter(&self) -> Option<&Candidate> {
        self.candidates[..self.best].last()
    }

    /// The shortest textbook shaper that is robust enough, where the one to take is none.
    pub fn shortest_textbook(&self) -> Option<&Candidate> {
        let is_textbook = |candidate: &&Candidate| matches!(kind(candidate), Some(StageType::Textbook(_)));
        let robust = self.candidates[self.best..].iter().filter(|one| one.holds(self.tolerance));
        let shortest = robust.clone().find(is_textbook)?;
        (!is_textbook(&self.best())).then_some(shortest)
    }

    /// All of them, shortest first.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// The most that may be left, a fraction.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_firmware::shaper::{Mode, ShaperType};
    use stillbeam_shape::{ModeBox, ShaperDesign, StagePlan};

    use super::*;

    fn textbook(kinds: &[ShaperType]) -> Vec<Candidate> {
        let boxes = [ModeBox::around(2.0, 0.01, 0.05, 0.05).unwrap()];
        let candidate = |kind: &ShaperType| {
            let plan = StagePlan::textbook(Mode::new(2.0, 0.01, *kind).unwrap());
            let design = ShaperDesign::cascade(&[plan], 1000.0, &boxes).unwrap();
            Candidate::new(kind.name(), design).unwrap()
        };
        kinds.iter().map(candidate).collect()
    }

    #[test]
    fn the_shortest_within_the_tolerance_is_taken() {
        let all = textbook(&[ShaperType::Zvdd, ShaperType::Zv, ShaperType::Zvd]);
        let taken = Recommendation::among(all.clone(), 0.05, 1000.0).unwrap();
        assert_eq!(taken.best().name, "zvd");
        assert_eq!(taken.next_shorter().unwrap().name, "zv");
        assert!(taken.shortest_textbook().is_none(), "it is one itself");
        let taken = Recommendation::among(all, 0.5, 1000.0).unwrap();
        assert_eq!(taken.best().name, "zv");
        assert!(taken.next_shorter().is_none());
    }

    #[test]
    fn without_one_the_error_names_what_comes_nearest() {
        let refused = |kinds: &[ShaperType]| {
            Recommendation::among(textbook(kinds), 0.001, 1000.0).unwrap_err().to_string()
        };
        let said = refused(&[ShaperType::Zvd, ShaperType::Zv]);
        assert!(said.contains("within 0.1 %") && said.contains("the ZVD leaves least, 0.5"), "{said}");
        assert!(said.contains("--tolerance") && said.contains("--box-floor"), "{said}");
        assert!(refused(&[]).contains("1000 Hz"));
    }
}
