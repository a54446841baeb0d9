//! The results as a page.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::parts::{Done, Plan};

const OUTCOMES: [&str; 9] =
    ["Right", "Twin", "Tied", "Unexplained", "Improved", "Missed", "Partly", "Wrong", "Failed"];

/// The exact set, as far as the recordings can tell.
const EXACT: &[&str] = &["Right", "Twin"];
/// The truth is among what is said.
const FOUND: &[&str] = &["Right", "Twin", "Tied"];
/// Of a law that is not in the catalogue: it is said that something is not explained.
const CAUTIOUS: &[&str] = &["Unexplained", "Improved"];
/// Of a machine of which nothing is missing: nothing is named.
const NAMELESS: &[&str] = &["Right", "Unexplained"];

fn count(done: &[&Done], outcomes: &[&str]) -> usize {
    done.iter().filter(|done| outcomes.contains(&done.outcome.as_str())).count()
}

fn reached(part: usize, whole: usize) -> String {
    format!("{part} of {whole} ({:.1} %)", percent(part, whole))
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole as f64
}

/// A row of the table of goals.
struct Goal {
    goal: &'static str,
    reached: String,
    is_met: bool,
}

impl Goal {
    fn at_least(goal: &'static str, part: usize, whole: usize, least_percent: f64) -> Self {
        Self { goal, reached: reached(part, whole), is_met: percent(part, whole) >= least_percent }
    }

    fn at_most(goal: &'static str, part: usize, whole: usize, most_percent: f64) -> Self {
        Self { goal, reached: reached(part, whole), is_met: percent(part, whole) <= most_percent }
    }
}

/// What was reached of each goal whose part was run.
fn goals(done: &[Done]) -> Vec<Goal> {
    let of = |part: &str| -> Vec<&Done> { done.iter().filter(|done| done.part == part).collect() };
    let mut goals = Vec::new();
    let laws = of("laws");
    if !laws.is_empty() {
        goals.extend([
            Goal::at_least(
                "one law: right, twin or tied in at least 97 %",
                count(&laws, FOUND),
                laws.len(),
                97.0,
            ),
            Goal::at_most("one law: a wrong name in at most 1 %", count(&laws, &["Wrong"]), laws.len(), 1.0),
        ]);
    }
    goals.extend(intervals(&laws));
    let composites = of("composites");
    if !composites.is_empty() {
        goals.push(Goal::at_least(
            "two or three laws: the exact set (right or twin) in at least 90 %",
            count(&composites, EXACT),
            composites.len(),
            90.0,
        ));
    }
    let left_out = of("left-out");
    if !left_out.is_empty() {
        let confident = left_out.iter().filter(|done| is_confidently_wrong(done)).count();
        goals.extend([
            Goal::at_least(
                "the law is not in the catalogue: unexplained or improved in at least 95 %",
                count(&left_out, CAUTIOUS),
                left_out.len(),
                95.0,
            ),
            Goal::at_most(
                "the law is not in the catalogue: no wrong name with the verdict explained",
                confident,
                left_out.len(),
                0.0,
            ),
        ]);
    }
    let absorbed = of("absorbed");
    if !absorbed.is_empty() {
        goals.push(Goal::at_least(
            "a refit hides it on any one recording: right, twin or tied",
            count(&absorbed, FOUND),
            absorbed.len(),
            100.0,
        ));
    }
    let null = of("null");
    if !null.is_empty() {
        goals.push(Goal::at_least("nothing missing: no name", count(&null, NAMELESS), null.len(), 100.0));
    }
    goals
}

fn intervals(done: &[&Done]) -> Option<Goal> {
    let (within, all) = covered(done);
    let is_met = (90.0..=98.0).contains(&percent(within, all));
    let goal = "95 % intervals hold the true value in 90 to 98 %";
    (all > 0).then(|| Goal { goal, reached: reached(within, all), is_met })
}

fn is_confidently_wrong(done: &Done) -> bool {
    done.outcome == "Wrong" && done.said.starts_with("Explained")
}

fn goal_table(page: &mut String, goals: &[Goal]) {
    if goals.is_empty() {
        return;
    }
    page.push_str("| goal | reached | met |\n|---|---|---|\n");
    for Goal { goal, reached, is_met } in goals {
        let met = if *is_met { "yes" } else { "**no**" };
        let _ = writeln!(page, "| {goal} | {reached} | {met} |");
    }
    page.push('\n');
}

/// The whole page.
pub fn page(plan: &Plan, done: &[Done]) -> String {
    let mut page = String::from("# What diagnosis finds\n\n");
    let _ = writeln!(
        page,
        "Made by `cargo run --profile host -p stillbeam-diagnose --example diagnosis_results -- {}`.\n",
        plan.arguments.split(' ').filter(|a| !a.starts_with("keep=")).collect::<Vec<&str>>().join(" ").trim()
    );
    goal_table(&mut page, &goals(done));
    page.push_str(
        "The machine is the beam of `tools/diagnose/tests/truth`, moved (one output, the tip) or pushed by a force (tip and base); the \
         given model's parameters are up to 5 % wrong, its damping up to 20 %. Three runs of 30 s are trained on, one of 35 s at another amplitude is held out. \
         Where viscous friction is left out the model has none; where a mass at the tip or a soft clamp is, the model fixes the beam's measures, and is right about them. \
         A law is at its detection limit where its effect, once the machine's own parameters are refitted, is five standard errors, on the runs that are trained on and on the one held out. \
         Twins are laws that are less than that apart on these recordings, whatever their parameters: a tie of nothing but the truth and its twins \
         is right as far as the recordings can tell, and a law that is struck from the catalogue is struck with its twins.\n",
    );
    for (part, title) in [
        ("null", "Nothing is missing"),
        ("laws", "One law is missing"),
        ("composites", "Two or three laws are missing"),
        ("left-out", "The missing law is not in the catalogue"),
        ("absorbed", "A refit hides it on any one recording"),
    ] {
        let of_part: Vec<&Done> = done.iter().filter(|done| done.part == part).collect();
        if of_part.is_empty() {
            continue;
        }
        let _ = writeln!(page, "\n## {title}\n");
        table(&mut page, part, &of_part);
        if part == "left-out" {
            let cautious = reached(count(&of_part, CAUTIOUS), of_part.len());
            let _ = writeln!(page, "\nUnexplained or improved: {cautious}.");
        }
        if part == "laws" || part == "absorbed" {
            coverage(&mut page, &of_part);
        }
        rest(&mut page, part, &of_part);
    }
    let mut seconds: Vec<f64> = done.iter().map(|done| done.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    if let (Some(median), Some(most)) = (seconds.get(seconds.len() / 2), seconds.last()) {
        let _ = writeln!(page, "\nA case took {median:.0} s in the median and {most:.0} s at most.");
    }
    page
}

/// What a case is counted under: what stands before the first comma.
fn group(done: &Done) -> String {
    done.case.split(", ").next().unwrap_or_default().to_owned()
}

fn table(page: &mut String, part: &str, done: &[&Done]) {
    let mut groups: BTreeMap<String, Vec<&Done>> = BTreeMap::new();
    for one in done {
        groups.entry(group(one)).or_default().push(one);
    }
    let first = if part == "null" { "machine" } else { "missing" };
    let _ = writeln!(page, "| {first} | cases | {} |", OUTCOMES.join(" | ").to_lowercase());
    let _ = writeln!(page, "|---|---{}|", "|---".repeat(OUTCOMES.len()));
    let all = ("all".to_owned(), done.to_vec());
    for (name, of_group) in groups.into_iter().chain([all]) {
        let counts: Vec<String> = OUTCOMES
            .iter()
            .map(|outcome| of_group.iter().filter(|done| done.outcome == **outcome).count())
            .map(|count| if count == 0 { String::new() } else { count.to_string() })
            .collect();
        let _ = writeln!(page, "| {name} | {} | {} |", of_group.len(), counts.join(" | "));
    }
}

/// Parameters whose true value is in their 95 % interval, and all.
fn covered(done: &[&Done]) -> (usize, usize) {
    let errors = || done.iter().flat_map(|done| &done.errors);
    (errors().filter(|error| error.abs() < 1.96).count(), errors().count())
}

fn coverage(page: &mut String, done: &[&Done]) {
    let (within, all) = covered(done);
    if all > 0 {
        let _ = writeln!(
            page,
            "\n95 % intervals hold the true value of {within} of {all} parameters ({:.0} %).",
            percent(within, all)
        );
    }
}

fn rest(page: &mut String, part: &str, done: &[&Done]) {
    let good: &[&str] = match part {
        "left-out" => CAUTIOUS,
        "composites" => EXACT,
        "null" => NAMELESS,
        _ => FOUND,
    };
    let bad: Vec<&&Done> = done.iter().filter(|done| !good.contains(&done.outcome.as_str())).collect();
    if bad.is_empty() {
        return;
    }
    page.push_str("\nThe others, one by one:\n\n");
    for done in bad {
        let _ = writeln!(page, "- {}: {}; {}", done.case, done.outcome.to_lowercase(), done.said);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(part: &str, outcome: &str, errors: &[f64], said: &str) -> Done {
        Done {
            part: part.to_owned(),
            case: "a law".to_owned(),
            outcome: outcome.to_owned(),
            errors: errors.to_vec(),
            seconds: 1.0,
            said: said.to_owned(),
        }
    }

    #[test]
    fn goals_are_of_the_parts_that_were_run() {
        let mut cases = vec![
            done("left-out", "Wrong", &[], "Explained: another"),
            done("left-out", "Improved", &[], "Improved: another"),
        ];
        cases.extend((0..19).map(|_| done("laws", "Twin", &[0.5], "Ambiguous: a law")));
        cases.push(done("laws", "Right", &[3.0], "Explained: a law"));
        let found: Vec<(String, bool)> =
            goals(&cases).into_iter().map(|goal| (goal.reached, goal.is_met)).collect();
        let wanted = [
            ("20 of 20 (100.0 %)", true),
            ("0 of 20 (0.0 %)", true),
            ("19 of 20 (95.0 %)", true),
            ("1 of 2 (50.0 %)", false),
            ("1 of 2 (50.0 %)", false),
        ];
        assert_eq!(found, wanted.map(|(reached, is_met)| (reached.to_owned(), is_met)));
    }
}
