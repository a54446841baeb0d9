//! One case: right, tied, partly, wrong, missed.

use serde::{Deserialize, Serialize};

use super::answer::{Answer, Effect};
use crate::case::{Concealment, Truth};
use crate::truth::law::Physics;

/// Half width of an interval in standard errors: 95 % of a normal distribution.
const INTERVAL: f64 = 1.96;

/// What an answer is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// Exactly what was left out, at its place; or nothing, where nothing was.
    Right,
    /// Candidates that cannot be told apart hold the truth.
    Tied,
    /// Some of several, and nothing else.
    Partly,
    /// A mismatch, located, without a name: honest where the law is in the catalogue, right where it is not.
    Unexplained,
    /// Taken for adequate although something is missing.
    Missed,
    /// Something is named that is not there.
    Wrong,
    /// No answer in the time given, or the tool failed.
    NoAnswer,
}

impl Mark {
    /// All marks, in the order of the tables.
    pub const ALL: [Self; 7] =
        [Self::Right, Self::Tied, Self::Partly, Self::Unexplained, Self::Missed, Self::Wrong, Self::NoAnswer];

    /// Its words in tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Tied => "tied",
            Self::Partly => "partly",
            Self::Unexplained => "unexplained",
            Self::Missed => "missed",
            Self::Wrong => "wrong",
            Self::NoAnswer => "no answer",
        }
    }
}

/// A parameter that was estimated of a law rightly named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterScore {
    /// `id.name`.
    pub name: String,
    /// Its true value.
    pub truth: f64,
    /// Relative error; of a true value of zero the value itself.
    pub error: f64,
    /// Whether the truth is within 1.96 standard errors.
    pub covered: bool,
}

/// The held-out error of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Column.
    pub output: String,
    /// Root mean square of recorded minus noise-free truth: nobody gets below.
    pub floor: f64,
    /// Of the given model against the recorded readings.
    pub given: Option<f64>,
    /// Of the linear refit.
    pub refitted: Option<f64>,
    /// Of the extended model, if anything was named.
    pub extended: Option<f64>,
    /// Of the extended model's free run against the noise-free truth.
    pub extended_to_truth: Option<f64>,
}

impl HeldOut {
    /// The extended model's error over the floor; `None` where nothing was named.
    pub fn over_the_floor(&self) -> Option<f64> {
        Some(self.extended? / self.floor)
    }
}

/// The score of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Number of the case.
    pub number: usize,
    /// Published before the tool ran.
    pub commitment: String,
    /// How the effect is concealed.
    pub concealment: Concealment,
    /// Which machine.
    pub machine: String,
    /// What was left out, as `id at location`.
    pub truth: Vec<String>,
    /// What no catalogue has, in the same form.
    pub outside: Vec<String>,
    /// The mark.
    pub mark: Mark,
    /// The tool's verdict, or why there is none.
    pub verdict: String,
    /// What it named.
    pub named: Vec<String>,
    /// Parameters of what it named rightly.
    pub parameters: Vec<ParameterScore>,
    /// Held-out errors.
    pub held_out: Vec<HeldOut>,
    /// What a linear refit leaves over the noise, from the seal.
    pub left_over_noise: f64,
    /// Processor seconds of the tool, on one thread.
    pub seconds: f64,
}

/// Judges an answer.
pub fn mark(truth: &Truth, answer: Option<&Answer>) -> Mark {
    let Some(answer) = answer else { return Mark::NoAnswer };
    let tied = || answer.ties.iter().any(|tie| tie.candidates.iter().any(|set| holds(set, truth)));
    if truth.physics.is_empty() {
        return if !answer.effects.is_empty() {
            Mark::Wrong
        } else if answer.verdict == "adequate" {
            if truth.outside.is_empty() { Mark::Right } else { Mark::Missed }
        } else if truth.outside.is_empty() {
            // An alarm without a name is an alarm still, but it names nothing that is not there.
            Mark::Unexplained
        } else {
            Mark::Right
        };
    }
    let right = |effect: &Effect| {
        truth.physics.iter().any(|law| law.id == effect.id && same_place(&law.location, &effect.location))
    };
    let found = |law: &Physics| {
        answer.effects.iter().any(|effect| law.id == effect.id && same_place(&law.location, &effect.location))
    };
    if answer.effects.iter().all(right) && !answer.effects.is_empty() {
        return if truth.physics.iter().all(found) {
            Mark::Right
        } else if tied() {
            Mark::Tied
        } else {
            Mark::Partly
        };
    }
    if tied() {
        return Mark::Tied;
    }
    match (answer.effects.is_empty(), answer.verdict.as_str()) {
        (false, "ambiguous") | (false, _) => Mark::Wrong,
        (true, "adequate") => Mark::Missed,
        (true, _) => Mark::Unexplained,
    }
}

/// Whether a tied set of `id at location`, or `id at sensor (column)` where several are read, is the truth;
/// the truth's laws of a sensor are those of the first output.
fn holds(set: &[String], truth: &Truth) -> bool {
    let reads_it = |column: &str| {
        let mut first = truth.channels.iter().filter(|channel| channel.output == 0);
        first.any(|channel| channel.column == column.trim_end_matches(')'))
    };
    let is = |name: &str, law: &Physics| {
        let Some((id, place)) = name.split_once(" at ") else { return false };
        let (place, column) = place.split_once(" (").map_or((place, None), |(place, c)| (place, Some(c)));
        id == law.id && same_place(&law.location, place) && column.is_none_or(reads_it)
    };
    set.len() == truth.physics.len() && truth.physics.iter().all(|law| set.iter().any(|name| is(name, law)))
}

/// The deflection relative to the base (`beam`) and the tip against the ground (`tip`) are one place here:
/// where the base moves a hundredth of what the tip does, no recording tells them apart.
fn same_place(one: &str, other: &str) -> bool {
    let place = |name: &str| if name == "tip" { "beam" } else { name }.to_owned();
    place(one) == place(other)
}

/// Parameters of laws rightly named.
pub fn parameters(truth: &Truth, answer: &Answer) -> Vec<ParameterScore> {
    let mut scores = Vec::new();
    for law in &truth.physics {
        let same = |effect: &&Effect| effect.id == law.id && same_place(&law.location, &effect.location);
        let Some(effect) = answer.effects.iter().find(same) else { continue };
        for (name, truth) in &law.parameters {
            let Some(estimate) = effect.parameters.get(name) else { continue };
            let Some(value) = estimate.value else { continue };
            let miss = value - truth;
            scores.push(ParameterScore {
                name: format!("{}.{name}", law.id),
                truth: *truth,
                error: if *truth == 0.0 { miss } else { miss / truth },
                covered: estimate.stderr.is_some_and(|stderr| miss.abs() <= INTERVAL * stderr),
            });
        }
    }
    scores
}

/// Held-out errors as the tool reports them, next to the floor.
pub fn held_out(truth: &Truth, answer: &Answer) -> Vec<HeldOut> {
    let channels = truth.channels.iter().zip(&truth.held_out_floor);
    channels
        .map(|(channel, floor)| {
            let pooled =
                answer.fit.pooled.iter().find(|fit| fit.role == "held_out" && fit.output == channel.column);
            HeldOut {
                output: channel.column.clone(),
                floor: *floor,
                given: pooled.and_then(|fit| fit.given.rms),
                refitted: pooled.and_then(|fit| fit.refitted_linear.rms),
                extended: pooled.and_then(|fit| fit.extended.and_then(|quality| quality.rms)),
                extended_to_truth: None,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Channel, Measured};
    use crate::truth::devices::Device;

    fn truth(laws: &[(&str, &str)], outside: bool) -> Truth {
        Truth {
            number: 0,
            seed: 1,
            concealment: Concealment::Visible,
            machine: String::new(),
            physics: laws.iter().map(|(id, place)| Physics::new(id, place, &[("force", 2.0)])).collect(),
            outside: if outside { vec![Physics::new("outside:play", "sensor", &[])] } else { Vec::new() },
            without_encoder: false,
            rate_hz: 100.0,
            channels: Vec::new(),
            runs: Vec::new(),
            measured: Measured::default(),
            held_out_floor: Vec::new(),
            redrawn: 0,
        }
    }

    fn answer(verdict: &str, effects: &[(&str, &str)], ties: &[&[&str]]) -> Answer {
        let effects: Vec<String> = effects
            .iter()
            .map(|(id, place)| {
                format!(r#"{{"id":"{id}","location":"{place}","parameters":{{"force":{{"value":2.1,"stderr":0.06,"unit":"N"}}}}}}"#)
            })
            .collect();
        let ties = serde_json::to_string(ties).unwrap();
        let text = format!(
            r#"{{"verdict":"{verdict}","effects":[{}],"ties":[{{"candidates":{ties},"sentence":""}}],"seconds":1.0}}"#,
            effects.join(",")
        );
        Answer::read(&text).unwrap()
    }

    #[test]
    fn a_law_is_right_only_with_its_place_and_nothing_else() {
        let one = truth(&[("coulomb_friction", "base")], false);
        let judge = |effects: &[(&str, &str)]| mark(&one, Some(&answer("explained", effects, &[])));
        assert_eq!(judge(&[("coulomb_friction", "base")]), Mark::Right);
        assert_eq!(judge(&[("coulomb_friction", "beam")]), Mark::Wrong);
        assert_eq!(judge(&[("stribeck_friction", "base")]), Mark::Wrong);
        assert_eq!(judge(&[("coulomb_friction", "base"), ("delay", "sensor")]), Mark::Wrong);
        assert_eq!(mark(&one, Some(&answer("adequate", &[], &[]))), Mark::Missed);
        assert_eq!(mark(&one, Some(&answer("unexplained", &[], &[]))), Mark::Unexplained);
        assert_eq!(mark(&one, None), Mark::NoAnswer);
    }

    #[test]
    fn of_two_laws_one_is_partly_and_a_tie_must_hold_the_truth() {
        let two = truth(&[("coulomb_friction", "base"), ("delay", "sensor")], false);
        assert_eq!(mark(&two, Some(&answer("improved", &[("delay", "sensor")], &[]))), Mark::Partly);
        let tie: &[&[&str]] = &[&["dead_time at drive"], &["delay at sensor", "coulomb_friction at base"]];
        assert_eq!(mark(&two, Some(&answer("ambiguous", &[("dead_time", "drive")], tie))), Mark::Tied);
        assert_eq!(mark(&two, Some(&answer("ambiguous", &[("dead_time", "drive")], &tie[..1]))), Mark::Wrong);
    }

    #[test]
    fn a_tied_law_of_one_of_several_sensors_is_the_truth_where_it_is_that_of_the_first_output() {
        let mut one = truth(&[("delay", "sensor")], false);
        let device = Device { rate_hz: 100.0, noise_rms: 0.0, noise_correlation: 0.0, quantum: 0.0 };
        let channel = |output: usize, column: &str| Channel { output, column: column.to_owned(), device };
        one.channels = vec![channel(0, "tip_deflection_m"), channel(1, "base_position_m")];
        let judged =
            |tie: &str| mark(&one, Some(&answer("ambiguous", &[("exposure_blur", "sensor")], &[&[tie]])));
        assert_eq!(judged("delay at sensor (tip_deflection_m)"), Mark::Tied);
        assert_eq!(judged("delay at sensor (base_position_m)"), Mark::Wrong);
        assert_eq!(judged("delay at sensor"), Mark::Tied);
    }

    #[test]
    fn nothing_missing_and_nothing_known_have_answers_of_their_own() {
        let (null, unknown) = (truth(&[], false), truth(&[], true));
        let judge = |truth: &Truth, verdict: &str, effects: &[(&str, &str)]| {
            mark(truth, Some(&answer(verdict, effects, &[])))
        };
        assert_eq!(judge(&null, "adequate", &[]), Mark::Right);
        assert_eq!(judge(&null, "unexplained", &[]), Mark::Unexplained);
        assert_eq!(judge(&null, "explained", &[("delay", "sensor")]), Mark::Wrong);
        assert_eq!(judge(&unknown, "unexplained", &[]), Mark::Right);
        assert_eq!(judge(&unknown, "adequate", &[]), Mark::Missed);
        assert_eq!(judge(&unknown, "improved", &[("delay", "sensor")]), Mark::Wrong);
    }

    #[test]
    fn intervals_are_checked_against_the_truth() {
        let one = truth(&[("coulomb_friction", "base")], false);
        let scores = parameters(&one, &answer("explained", &[("coulomb_friction", "base")], &[]));
        assert_eq!(scores.len(), 1);
        assert!(scores[0].covered && (scores[0].error - 0.05).abs() < 1e-12);
    }
}
