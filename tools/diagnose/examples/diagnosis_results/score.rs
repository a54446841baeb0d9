//! What became of a case.

use stillbeam_diagnose::{Diagnosis, Verdict};
use stillbeam_plant::Physics;

/// The outcome of one case, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Exactly the laws that are there, at their places; nothing where nothing is missing.
    Right,
    /// Right as far as these recordings can tell: a tie that holds the laws that are there, and beside them
    /// nothing but twins of theirs.
    Twin,
    /// A tie that holds exactly the laws that are there.
    Tied,
    /// Said to be there, located and unexplained.
    Unexplained,
    /// Of a law that is not in the catalogue: something else is named, with the words that a structured rest
    /// remains.
    Improved,
    /// Nothing was seen.
    Missed,
    /// Right, and something besides; or a part of it.
    Partly,
    /// Something that is not there is named, and nothing that is.
    Wrong,
}

/// The names of laws, sorted.
fn names(laws: &[Physics]) -> Vec<String> {
    let mut names: Vec<String> = laws.iter().map(|law| format!("{} at {}", law.id, law.location)).collect();
    names.sort();
    names
}

fn without_column(name: &str) -> String {
    name.split(" (").next().unwrap_or(name).to_owned()
}

/// Friction that differs by direction is the same force as even friction with a constant one: one of them is
/// a part of it.
fn is_half_of(name: &str, laws: &[Physics]) -> bool {
    laws.iter().filter(|law| law.id == "asymmetric_friction").any(|law| {
        ["coulomb_friction", "constant_force"].iter().any(|id| name == format!("{id} at {}", law.location))
    })
}

/// What was named, sorted.
fn named(found: &Diagnosis) -> Vec<String> {
    let mut named: Vec<String> =
        found.effects.iter().map(|effect| format!("{} at {}", effect.id, effect.location)).collect();
    named.sort();
    named
}

/// Every set of every tie, sorted.
fn tied_sets(found: &Diagnosis) -> impl Iterator<Item = Vec<String>> {
    found.ties.iter().flat_map(|tie| &tie.candidates).map(|set| {
        let mut set: Vec<String> = set.iter().map(|name| without_column(name)).collect();
        set.sort();
        set
    })
}

/// Whether what was named and every set tied with it is one of these.
pub fn holds_only(found: &Diagnosis, sets: &[Vec<Physics>]) -> bool {
    let sets: Vec<Vec<String>> = sets.iter().map(|set| names(set)).collect();
    std::iter::once(named(found)).chain(tied_sets(found)).all(|set| sets.contains(&set))
}

/// What becomes of a law that is not in the catalogue: every name is wrong, and better than none only if it
/// says itself that it is not all.
pub fn outcome_without(found: &Diagnosis) -> Outcome {
    match found.verdict {
        Verdict::Unexplained => Outcome::Unexplained,
        _ if found.effects.is_empty() => Outcome::Missed,
        Verdict::Improved => Outcome::Improved,
        _ => Outcome::Wrong,
    }
}

/// Compares a diagnosis with the truth.
pub fn outcome(found: &Diagnosis, laws: &[Physics]) -> Outcome {
    let truth = names(laws);
    let named = named(found);
    let tied = tied_sets(found).any(|set| set == truth);
    if named == truth && !(truth.is_empty() && found.verdict == Verdict::Unexplained) {
        return Outcome::Right;
    }
    match found.verdict {
        Verdict::Ambiguous if tied => Outcome::Tied,
        Verdict::Unexplained => Outcome::Unexplained,
        _ if named.is_empty() => Outcome::Missed,
        _ if tied => Outcome::Tied,
        _ if named.iter().any(|name| truth.contains(name) || is_half_of(name, laws)) => Outcome::Partly,
        _ => Outcome::Wrong,
    }
}

/// For every parameter of a law that was rightly named: its error in standard errors.
pub fn errors(found: &Diagnosis, laws: &[Physics]) -> Vec<f64> {
    let mut errors = Vec::new();
    for effect in &found.effects {
        let Some(law) = laws.iter().find(|law| law.id == effect.id && law.location == effect.location) else {
            continue;
        };
        for (name, estimate) in &effect.parameters {
            let truth = law.parameters.get(name).copied().unwrap_or(0.0);
            errors.push((estimate.value - truth) / estimate.stderr);
        }
    }
    errors
}

/// What was said, in one line.
pub fn said(found: &Diagnosis) -> String {
    let effects: Vec<String> = found
        .effects
        .iter()
        .map(|effect| {
            let parameters: Vec<String> = effect
                .parameters
                .iter()
                .map(|(name, p)| format!("{name}={:.4e}±{:.1e}", p.value, p.stderr))
                .collect();
            format!("{}@{}[{}]", effect.id, effect.location, parameters.join(" "))
        })
        .collect();
    let ties: Vec<String> =
        found.ties.iter().flat_map(|tie| tie.candidates.iter().skip(1).map(|set| set.join("+"))).collect();
    format!(
        "{:?}: {}{}",
        found.verdict,
        effects.join(", "),
        if ties.is_empty() { String::new() } else { format!(" tied {}", ties.join(" | ")) }
    )
}
