//! Sums over scores.

use std::collections::BTreeMap;

use super::judge::{HeldOut, Mark, Score};
use crate::case::Concealment;

/// How often every mark was given.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    counts: [usize; Mark::ALL.len()],
}

impl Tally {
    /// Of a set of scores.
    pub fn of<'a>(scores: impl IntoIterator<Item = &'a Score>) -> Self {
        let mut tally = Self::default();
        for score in scores {
            if let Some(index) = Mark::ALL.iter().position(|mark| *mark == score.mark) {
                tally.counts[index] += 1;
            }
        }
        tally
    }

    /// How often one mark was given.
    pub fn count(&self, mark: Mark) -> usize {
        Mark::ALL.iter().position(|each| *each == mark).map_or(0, |index| self.counts[index])
    }

    /// All.
    pub fn total(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Share (0 to 1) of some marks; 0 of nothing.
    pub fn share(&self, marks: &[Mark]) -> f64 {
        let good: usize = marks.iter().map(|mark| self.count(*mark)).sum();
        if self.total() == 0 { 0.0 } else { good as f64 / self.total() as f64 }
    }
}

/// Fewer intervals than this cannot tell 95 % from all: even right ones would miss the goal half of the time.
const LEAST_INTERVALS: usize = 40;

/// A goal that the bench measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// What it says.
    pub words: &'static str,
    /// What was reached, as text with its numbers.
    pub reached: String,
    /// Whether that is enough; `None` where too few cases say anything about it.
    pub met: Option<bool>,
}

/// The goals of the bench with what was reached.
pub fn goals(scores: &[Score]) -> Vec<Goal> {
    // Who says nothing says nothing wrong: that is no merit.
    let answered = |kinds: &[Concealment]| {
        Tally::of(scores.iter().filter(|s| kinds.contains(&s.concealment) && s.mark != Mark::NoAnswer))
    };
    let at_least = |words, kinds: &[Concealment], marks: &[Mark], least: f64| {
        let chosen = scores.iter().filter(|score| kinds.contains(&score.concealment));
        goal(words, Tally::of(chosen), marks, |share| share >= least)
    };
    let buried = answered(&[Concealment::Buried]);
    let empty = answered(&[Concealment::Null, Concealment::Decoy]);
    vec![
        at_least("visible: at least 97 % right", &[Concealment::Visible], &[Mark::Right], 0.97),
        at_least("absorbed: at least 90 % right", &[Concealment::Absorbed], &[Mark::Right], 0.90),
        at_least("buried: at least 70 % right", &[Concealment::Buried], &[Mark::Right], 0.70),
        goal("buried, of those answered: at most 2 % wrong", buried, &[Mark::Wrong], |share| share <= 0.02),
        at_least(
            "masked: at least 80 % right or tied",
            &[Concealment::Masked],
            &[Mark::Right, Mark::Tied],
            0.80,
        ),
        goal("null and decoy, of those answered: at most 1 % named", empty, &[Mark::Wrong], |share| {
            share <= 0.01
        }),
        outside_goal(scores),
        held_out_goal(scores),
        coverage_goal(scores),
    ]
}

/// From so many cases on a share in per cent says something.
const LEAST_CASES: usize = 10;

fn goal(words: &'static str, tally: Tally, marks: &[Mark], enough: impl Fn(f64) -> bool) -> Goal {
    let total = tally.total();
    let count: usize = marks.iter().map(|mark| tally.count(*mark)).sum();
    let share = tally.share(marks);
    Goal {
        words,
        reached: format!("{count} of {total} ({:.0} %)", 100.0 * share),
        met: (total >= LEAST_CASES).then(|| enough(share)),
    }
}

/// A name under `improved` or `ambiguous` says itself that it is not all, or not the only one: it is wrong,
/// and given without confidence.
fn outside_goal(scores: &[Score]) -> Goal {
    let outside = scores.iter().filter(|s| s.concealment == Concealment::Outside && s.mark != Mark::NoAnswer);
    let answered: Vec<&Score> = outside.collect();
    let named = || answered.iter().filter(|score| score.mark == Mark::Wrong);
    let certain = named().filter(|score| score.verdict == CERTAIN).count();
    let (total, good) = (answered.len(), answered.len() - certain);
    let share = good as f64 / total.max(1) as f64;
    Goal {
        words: "outside the catalogue, of those answered: not named with confidence (`explained`) in at least 95 %",
        reached: format!(
            "{good} of {total} ({:.0} %); not named at all {} of {total}",
            100.0 * share,
            total - named().count()
        ),
        met: (total >= LEAST_CASES).then_some(share >= 0.95),
    }
}

/// The verdict under which what is named is all that is missing.
const CERTAIN: &str = "explained";

/// A held-out error within so many times the achievable floor is as good as it gets.
pub const NEAR_THE_FLOOR: f64 = 1.2;

fn held_out_goal(scores: &[Score]) -> Goal {
    let ratios = held_out_ratios(scores);
    let good = ratios.iter().filter(|ratio| **ratio <= NEAR_THE_FLOOR).count();
    Goal {
        words: "where rightly named: held-out error within 1.2 of the achievable floor (noise, an unrecorded force, and what the training recordings and the samples of the input leave open)",
        reached: format!("{good} of {} outputs", ratios.len()),
        met: (!ratios.is_empty()).then_some(good == ratios.len()),
    }
}

fn coverage_goal(scores: &[Score]) -> Goal {
    let all: Vec<bool> = scores.iter().flat_map(|s| &s.parameters).map(|p| p.covered).collect();
    let covered = all.iter().filter(|covered| **covered).count();
    let share = covered as f64 / all.len().max(1) as f64;
    Goal {
        words: "intervals of 1.96 standard errors hold the truth in 90 to 98 %",
        reached: format!("{covered} of {} parameters ({:.0} %)", all.len(), 100.0 * share),
        met: (all.len() >= LEAST_INTERVALS).then(|| (0.90..=0.98).contains(&share)),
    }
}

/// Held-out error of the extended model over the floor, per output of every case rightly named.
pub fn held_out_ratios(scores: &[Score]) -> Vec<f64> {
    let right = scores.iter().filter(|score| score.mark == Mark::Right);
    right.flat_map(|score| &score.held_out).filter_map(HeldOut::over_the_floor).collect()
}

/// Marks by kind of concealment.
pub fn by_kind(scores: &[Score]) -> Vec<(Concealment, Tally)> {
    Concealment::ALL
        .into_iter()
        .map(|kind| (kind, Tally::of(scores.iter().filter(|score| score.concealment == kind))))
        .filter(|(_, tally)| tally.total() > 0)
        .collect()
}

/// Marks by law and place; a case with two laws counts for both.
pub fn by_law(scores: &[Score]) -> BTreeMap<String, Tally> {
    let mut laws: BTreeMap<String, Vec<&Score>> = BTreeMap::new();
    for score in scores {
        for law in score.truth.iter().chain(&score.outside) {
            laws.entry(law.clone()).or_default().push(score);
        }
    }
    laws.into_iter().map(|(law, scores)| (law, Tally::of(scores))).collect()
}

/// What was said (columns) of what was there (rows), single laws and none: counts by id.
pub fn confusion(scores: &[Score]) -> BTreeMap<String, BTreeMap<String, usize>> {
    let mut matrix: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for score in scores {
        let there: Vec<&String> = score.truth.iter().chain(&score.outside).collect();
        let row = match there.as_slice() {
            [] => "(nothing)".to_owned(),
            [law] => id_of(law),
            _ => continue,
        };
        let said = match (score.mark, score.named.as_slice()) {
            (Mark::NoAnswer, _) => vec!["(no answer)".to_owned()],
            (Mark::Tied, _) => vec!["(tie with truth)".to_owned()],
            (_, []) => vec![format!("({})", score.verdict)],
            (_, named) => named.iter().map(|law| id_of(law)).collect(),
        };
        for column in said {
            *matrix.entry(row.clone()).or_default().entry(column).or_default() += 1;
        }
    }
    matrix
}

fn id_of(law: &str) -> String {
    law.split(" at ").next().unwrap_or(law).to_owned()
}

/// The middle of a list; `None` of an empty one.
pub fn median(mut list: Vec<f64>) -> Option<f64> {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn score(kind: Concealment, truth: &[&str], named: &[&str], mark: Mark) -> Score {
        Score {
            number: 0,
            commitment: "00".to_owned(),
            concealment: kind,
            machine: String::new(),
            truth: truth.iter().map(|law| (*law).to_owned()).collect(),
            outside: Vec::new(),
            mark,
            verdict: "explained".to_owned(),
            named: named.iter().map(|law| (*law).to_owned()).collect(),
            parameters: Vec::new(),
            held_out: Vec::new(),
            left_over_noise: 5.0,
            seconds: 1.0,
        }
    }

    #[test]
    fn goals_are_met_or_missed_by_their_numbers() {
        let right = score(Concealment::Visible, &["delay at sensor"], &["delay at sensor"], Mark::Right);
        let wrong = score(Concealment::Visible, &["delay at sensor"], &["dead_time at drive"], Mark::Wrong);
        let mut scores = vec![right; 97];
        scores.extend(vec![wrong.clone(); 3]);
        assert_eq!(goals(&scores)[0].met, Some(true));
        scores.push(wrong);
        assert_eq!(goals(&scores)[0].met, Some(false));
        // One case says nothing yet, nor does none.
        assert_eq!(goals(&scores[..1])[0].met, None);
        // No case says anything about what is absorbed.
        assert_eq!(goals(&scores)[1].met, None);
    }

    #[test]
    fn outside_the_catalogue_a_name_counts_as_confident_only_where_nothing_is_said_to_remain() {
        let named = score(Concealment::Outside, &[], &["delay at sensor"], Mark::Wrong);
        let doubted = Score { verdict: "improved".to_owned(), ..named.clone() };
        let honest = score(Concealment::Outside, &[], &[], Mark::Right);
        let of = |wrong: &Score, times: usize| {
            let mut scores = vec![honest.clone(); 20 - times];
            scores.extend(vec![wrong.clone(); times]);
            outside_goal(&scores)
        };
        assert_eq!(of(&named, 1).met, Some(true));
        assert_eq!(of(&named, 2).met, Some(false));
        let doubted = of(&doubted, 2);
        assert_eq!(doubted.met, Some(true));
        assert!(doubted.reached.ends_with("not named at all 18 of 20"), "{}", doubted.reached);
    }

    #[test]
    fn the_confusion_matrix_counts_what_was_said_of_what_was_there() {
        let scores = [
            score(Concealment::Visible, &["delay at sensor"], &["dead_time at drive"], Mark::Wrong),
            score(Concealment::Visible, &["delay at sensor"], &["delay at sensor"], Mark::Right),
            score(Concealment::Null, &[], &["cogging at base"], Mark::Wrong),
            score(Concealment::Masked, &["a at b", "c at d"], &["a at b"], Mark::Partly),
        ];
        let matrix = confusion(&scores);
        assert_eq!(matrix["delay"]["dead_time"], 1);
        assert_eq!(matrix["delay"]["delay"], 1);
        assert_eq!(matrix["(nothing)"]["cogging"], 1);
        assert_eq!(matrix.len(), 2);
        assert_eq!(by_law(&scores)["c at d"].count(Mark::Partly), 1);
    }
}
