//! What an answer reaches of what was aimed at.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::force_balance::force_error_percent;
use super::machines::{Machine, Part, Target, make};
use crate::run::{EXTENDED, column_of};

/// An answer and where it is.
pub(super) struct Found<'f> {
    pub(super) tool: &'f Path,
    pub(super) data: &'f Path,
    pub(super) folder: &'f Path,
    pub(super) machine: &'f Machine,
    pub(super) answer: &'f Value,
}

/// Whether a target is reached, and the number or names behind it.
pub(super) fn judged(found: &Found<'_>, target: &Target) -> (bool, String) {
    let number = |value: Option<f64>, most: f64, show: &dyn Fn(f64) -> String| match value {
        Some(value) => (value <= most, show(value)),
        None => (
            false,
            "not known: nothing was named, or a law that is no function of place and speed".to_owned(),
        ),
    };
    match *target {
        Target::Named(laws) => {
            let words = found.said_of(laws);
            (words.is_some(), words.unwrap_or_else(|| format!("named: {}", listed(&found.named()))))
        }
        Target::NamedOrOpen(laws) => {
            let open = found.left_open();
            let is_among =
                open.iter().any(|place| place.split(" at ").next().is_some_and(|id| laws.contains(&id)));
            let words =
                found.said_of(laws).or_else(|| is_among.then(|| format!("left open: {}", open.join(" or "))));
            (words.is_some(), words.unwrap_or_else(|| format!("named: {}", listed(&found.named()))))
        }
        Target::NotNamed(laws) => {
            let named = found.named();
            (!named.iter().any(|id| laws.contains(&id.as_str())), format!("named: {}", listed(&named)))
        }
        Target::Further(part, most) => number(found.further(&part), most, &|value| format!("{value:.3e}")),
        Target::Force(most) => {
            let extended = fs::read_to_string(found.folder.join(EXTENDED)).ok();
            let error = extended.and_then(|model| force_error_percent(found.data, &model));
            number(error, most, &|value| format!("{value:.2} %"))
        }
        Target::OpenLoop(most) => {
            number(found.open_loop(), most, &|value| format!("{:.2} mm rms", 1e3 * value))
        }
    }
}

fn listed(names: &[String]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

impl Found<'_> {
    fn named(&self) -> Vec<String> {
        let effects = self.answer["effects"].as_array().into_iter().flatten();
        effects.filter_map(|effect| effect["id"].as_str().map(str::to_owned)).collect()
    }

    /// Which of these laws are named, or else tied; `None` where none is.
    fn said_of(&self, laws: &[&str]) -> Option<String> {
        let among = |said: &[String]| {
            let here: Vec<&str> =
                laws.iter().copied().filter(|law| said.iter().any(|id| id == law)).collect();
            (!here.is_empty()).then(|| here.join(", "))
        };
        among(&self.named()).or_else(|| among(&self.tied()).map(|laws| format!("tied: {laws}")))
    }

    /// Laws with their places that would explain what was trained on, and that what was held out does not
    /// confirm.
    fn left_open(&self) -> Vec<String> {
        let open = self.answer["unconfirmed"].as_array().into_iter().flatten();
        open.filter_map(|place| place.as_str().map(str::to_owned)).collect()
    }

    /// Laws in ties, as words of their sentences.
    fn tied(&self) -> Vec<String> {
        let ties = self.answer["ties"].as_array().into_iter().flatten();
        let sentences = ties.filter_map(|tie| tie["sentence"].as_str());
        let is_part_of_name = |c: char| c.is_ascii_lowercase() || c == '_';
        sentences.flat_map(|text| text.split(move |c| !is_part_of_name(c)).map(str::to_owned)).collect()
    }

    /// The tool in the answer's folder; `None` when it fails.
    fn run(&self, arguments: impl Iterator<Item = String>) -> Option<()> {
        let done = Command::new(self.tool).current_dir(self.folder).args(arguments).output().ok()?;
        done.status.success().then_some(())
    }

    /// The extended model is given to the tool as a model, and its error before any refit is read: start and
    /// offset are fitted as in every other number here, and the input between its samples is made in the same
    /// way.
    fn further(&self, (name, made): &Part) -> Option<f64> {
        let (first, _) = self.machine.train.first()?;
        let recording = format!("{name}.csv");
        fs::write(self.folder.join(&recording), make(self.data, made).ok()?.to_csv()).ok()?;
        let first = format!("{first}.csv");
        let again = ["diagnose", EXTENDED, &first, "--held-out", &recording, "--json", "further.json"];
        self.run(again.iter().map(|word| (*word).to_owned()))?;
        let text = fs::read_to_string(self.folder.join("further.json")).ok()?;
        let answer: Value = serde_json::from_str(&text).ok()?;
        let mut fits = answer["fit"]["recordings"].as_array()?.iter();
        fits.find(|fit| fit["role"] == "held_out")?["given"]["rms"].as_f64()
    }

    /// Root mean square of the held-out recording minus the extended model's free run on the recorded force,
    /// mean taken off; its numbers are refitted to free runs of the training recordings before: a loop hides
    /// what makes a slide wander off.
    fn open_loop(&self) -> Option<f64> {
        let (name, _) = self.machine.held_out.first()?;
        let train = self.machine.train.iter().map(|(name, _)| format!("{name}.csv"));
        let (input, out, refitted) = (format!("{name}.csv"), "open_loop.csv", "open_loop.toml");
        let fit =
            ["diagnose", EXTENDED, "--open-loop", "--refitted-model", refitted, "--processor-limit", "5"];
        let fit = fit.iter().map(|word| (*word).to_owned()).chain(train);
        self.run(fit.chain(["--held-out".to_owned(), input.clone()]))?;
        let again = ["simulate", refitted, "--open-loop", "--input", &input, "--out", out];
        self.run(again.iter().map(|word| (*word).to_owned()))?;
        let read = |file: &str| column_of(&fs::read_to_string(self.folder.join(file)).ok()?, "position_m");
        let (recorded, run) = (read(&input)?, read(out)?);
        let differ: Vec<f64> = recorded.iter().zip(&run).map(|(a, b)| a - b).collect();
        let mean = differ.iter().sum::<f64>() / differ.len().max(1) as f64;
        Some((differ.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / differ.len().max(1) as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::real::machines::MACHINES;

    fn judgement(answer: &Value, target: &Target) -> (bool, String) {
        let machine = MACHINES.iter().find(|machine| machine.name == "cantilever").expect("it is listed");
        let nowhere = Path::new("");
        judged(&Found { tool: nowhere, data: nowhere, folder: nowhere, machine, answer }, target)
    }

    #[test]
    fn a_law_that_is_left_open_is_not_called_named() {
        let laws: &[&str] = &["hysteresis"];
        let open = json!({"effects": [], "ties": [], "unconfirmed": ["hysteresis at mode 1", "parameter_drift at environment"]});
        assert!(!judgement(&open, &Target::Named(laws)).0);
        let (is_reached, words) = judgement(&open, &Target::NamedOrOpen(laws));
        assert!(is_reached);
        assert_eq!(words, "left open: hysteresis at mode 1 or parameter_drift at environment");
        assert!(!judgement(&open, &Target::NamedOrOpen(&["coulomb_friction"])).0);
    }

    #[test]
    fn what_is_named_or_tied_is_said_before_what_is_left_open() {
        let laws: &[&str] = &["hysteresis"];
        let named = json!({"effects": [{"id": "hysteresis"}], "ties": [], "unconfirmed": []});
        assert_eq!(judgement(&named, &Target::NamedOrOpen(laws)), (true, "hysteresis".to_owned()));
        let tie = json!({"effects": [{"id": "quadratic_drag"}], "unconfirmed": [],
            "ties": [{"sentence": "cannot tell apart: hysteresis at mode 1; or quadratic_drag at mode 1."}]});
        assert_eq!(judgement(&tie, &Target::Named(laws)), (true, "tied: hysteresis".to_owned()));
        let none = json!({"effects": [], "ties": [], "unconfirmed": []});
        assert_eq!(judgement(&none, &Target::NamedOrOpen(laws)), (false, "named: nothing".to_owned()));
    }
}
