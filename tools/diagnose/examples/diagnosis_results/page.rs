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

fn count(done: &[&Done], outcomes: &[&str]) -> usize {
    done.iter().filter(|done| outcomes.contains(&done.outcome.as_str())).count()
}

fn reached(part: usize, whole: usize) -> String {
    format!("{part} of {whole} ({:.1} %)", 100.0 * part as f64 / whole as f64)
}

/// The whole page.
pub fn page(plan: &Plan, done: &[Done]) -> String {
    let mut page = String::from("# What diagnosis finds\n\n");
    let _ = writeln!(
        page,
        "Made by `cargo run --profile host -p stillbeam-diagnose --example diagnosis_results -- {}`.\n",
        plan.arguments.split(' ').filter(|a| !a.starts_with("keep=")).collect::<Vec<&str>>().join(" ").trim()
    );
    page.push_str(
        "The machine is the beam of `tools/diagnose/tests/truth`, moved (one output, the tip) or pushed by a force (tip and base); the \
         given model's parameters are up to 5 % wrong, its damping up to 20 %. Three runs of 30 s are trained on, one of 35 s at another amplitude is held out. \
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

fn coverage(page: &mut String, done: &[&Done]) {
    let errors: Vec<f64> = done.iter().flat_map(|done| done.errors.iter().copied()).collect();
    let within = errors.iter().filter(|error| error.abs() < 1.96).count();
    if !errors.is_empty() {
        let _ = writeln!(
            page,
            "\n95 % intervals hold the true value of {within} of {} parameters ({:.0} %).",
            errors.len(),
            100.0 * within as f64 / errors.len() as f64
        );
    }
}

fn rest(page: &mut String, part: &str, done: &[&Done]) {
    let good: &[&str] = match part {
        "left-out" => CAUTIOUS,
        "composites" => EXACT,
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
