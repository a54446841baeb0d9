//! The recommendation and its reasons in sentences.

use super::between_recordings::Movement;
use super::figures::{percent, seconds};
use super::outcome::Tuning;
use super::shaper_names::shaper_name;

/// What to take and why, one sentence or two each.
#[derive(Clone, Debug, PartialEq)]
pub struct Reasons {
    /// The shaper to take, its length and what it leaves.
    pub take: String,
    /// What speaks for it: the others, and the recordings.
    pub because: Vec<String>,
}

impl Reasons {
    /// Of a recommendation.
    pub fn of(tuning: &Tuning) -> Self {
        let recommendation = &tuning.recommendation;
        let best = recommendation.best();
        let take = format!(
            "Take {}. It is {} long and leaves at most {} of the vibration while every mode stays in its box ({}).",
            shaper_name(best),
            seconds(best.table.duration_s()),
            percent(best.worst()),
            reach(tuning)
        );
        let shorter = recommendation.next_shorter().map(|shorter| {
            format!(
                "The next shorter one is {}. It would be {} long and leave up to {}; at most {} may be left (--tolerance).",
                shaper_name(shorter),
                seconds(shorter.table.duration_s()),
                percent(shorter.worst()),
                percent(recommendation.tolerance())
            )
        });
        let textbook = recommendation.shortest_textbook().map(|textbook| {
            format!(
                "The shortest textbook shaper that is robust enough is {}: {} long, it leaves at most {}.",
                shaper_name(textbook),
                seconds(textbook.table.duration_s()),
                percent(textbook.worst())
            )
        });
        let because = shorter.into_iter().chain(textbook).chain([movement(tuning)]);
        Self { take, because: because.collect() }
    }

    /// All sentences, the recommendation first.
    pub fn all(&self) -> Vec<String> {
        std::iter::once(&self.take).chain(&self.because).cloned().collect()
    }
}

/// How far either way every frequency may be off.
fn reach(tuning: &Tuning) -> String {
    let ends = tuning.modes.modes.iter().flat_map(|mode| {
        let hz = mode.area.nominal_hz();
        mode.area.frequency_hz().map(|end_hz| (end_hz / hz - 1.0).abs())
    });
    let [least, most] = ends.fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], fraction| {
        [least.min(fraction), most.max(fraction)]
    });
    match percent(least) == percent(most) {
        true => format!("±{} of its frequency", percent(least)),
        false => format!("±{} of its frequency, or more", percent(least)),
    }
}

/// How far the frequencies moved between the recordings.
fn movement(tuning: &Tuning) -> String {
    if tuning.recordings < 2 {
        return "There is one recording: it does not say how far the frequencies move with load, position or \
                temperature. A second recording would."
            .to_owned();
    }
    let largest = |among: &mut dyn Iterator<Item = &Movement>| {
        among.max_by(|a, b| a.fraction().total_cmp(&b.fraction())).cloned()
    };
    let clear = largest(&mut tuning.movements.iter().filter(|movement| movement.is_clear()));
    let Some(most) = clear else {
        return match largest(&mut tuning.movements.iter()) {
            Some(most) => format!(
                "Your machine's frequencies did not move between the recordings: they differ by {} at most, which is within their errors.",
                percent(most.fraction())
            ),
            None => "No mode shows in two recordings: how far the frequencies move is not known.".to_owned(),
        };
    };
    format!(
        "Your machine's frequencies moved by {} between recordings: mode {} is at {:.4} Hz in {} and at {:.4} Hz in {}.",
        percent(most.fraction()),
        most.number,
        most.lowest.frequency_hz.value,
        most.lowest.recording,
        most.highest.frequency_hz.value,
        most.highest.recording
    )
}
