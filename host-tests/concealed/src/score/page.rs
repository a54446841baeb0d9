//! The results page.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::judge::{Mark, Score};
use super::tables::{NEAR_THE_FLOOR, Tally, by_kind, by_law, confusion, goals, held_out_ratios, median};
use crate::seal::digest;

/// Cases of the whole bench.
const FULL: usize = 300;

/// What a page says about its own making.
#[derive(Debug, Clone, PartialEq)]
pub struct Making {
    /// Seed of the cases.
    pub seed: u64,
    /// Cases asked for.
    pub cases: usize,
    /// Processor seconds that the tool had per case.
    pub limit_s: f64,
    /// What the tool calls itself.
    pub tool_version: String,
    /// SHA-256 of the tool's program file.
    pub tool_digest: String,
}

/// The page in Markdown; scores in the order of their numbers. `table` is the file with every case
/// ([`every_case`]).
pub fn page(making: &Making, scores: &[Score], table: &str) -> String {
    let mut text = String::new();
    // Writing into a string cannot fail.
    let _ = head(&mut text, making, scores);
    let _ = failures(&mut text, scores, table);
    let _ = marks(&mut text, scores);
    let _ = numbers(&mut text, scores);
    let _ = matrix(&mut text, scores);
    text
}

fn head(text: &mut String, making: &Making, scores: &[Score]) -> std::fmt::Result {
    let all: String = scores.iter().map(|score| score.commitment.as_str()).collect();
    write!(
        text,
        "# Concealed physics: what `stillbeam diagnose` finds\n\n\
         Made by `cargo xtask prove --cases {} --seed {} --limit {:.0} --page docs/results/proof.md`; tool {} (program file SHA-256 {}...), \
         {}, one thread and at most {:.0} processor seconds each.\n\n\
         Every case is a machine from a simulator that shares no code with the tool ([how](../../host-tests/concealed/src/lib.rs)): \
         a lab's model with fewer modes and wrong parameters, three recordings to train on and two held out. The truth was sealed before the tool ran \
         (SHA-256 of all commitments in order: `{}`) and opened after it had answered.\n\n",
        making.cases,
        making.seed,
        making.limit_s,
        making.tool_version,
        &making.tool_digest[..making.tool_digest.len().min(12)],
        if scores.len() < making.cases {
            format!("**{} of {} cases ran** in the time that there was", scores.len(), making.cases)
        } else {
            format!("{} cases", scores.len())
        },
        making.limit_s,
        digest(all.as_bytes()),
    )?;
    text.push_str("| goal | reached | met |\n|---|---|---|\n");
    for goal in goals(scores) {
        let met = match goal.met {
            Some(true) => "yes",
            Some(false) => "**no**",
            None => "too few",
        };
        writeln!(text, "| {} | {} | {met} |", goal.words, goal.reached)?;
    }
    Ok(())
}

fn failures(text: &mut String, scores: &[Score], table: &str) -> std::fmt::Result {
    text.push_str("\n## What it fails at\n\n");
    let bad = |mark: Mark| scores.iter().filter(|score| score.mark == mark).count();
    let in_catalogue = |law: &str| scores.iter().any(|score| score.truth.iter().any(|each| each == law));
    let missing = scores.iter().filter(|score| !score.truth.is_empty()).count();
    writeln!(
        text,
        "Of {missing} cases with physics of the catalogue missing, {} were named rightly and {} were left in a tie that holds the truth. In all cases, {} answers name \
         something that is not there, {} times the tool took a model for adequate that is not, {} times it saw a mismatch and gave it no name, and {} times it gave no answer in the time.\n",
        scores.iter().filter(|s| s.mark == Mark::Right && !s.truth.is_empty()).count(),
        bad(Mark::Tied),
        bad(Mark::Wrong),
        bad(Mark::Missed),
        bad(Mark::Unexplained),
        bad(Mark::NoAnswer),
    )?;
    let answered = scores.iter().filter(|score| score.mark != Mark::NoAnswer).count();
    let right = bad(Mark::Right);
    writeln!(
        text,
        "Of the {answered} cases that were answered in the time, {right} were answered rightly, those with nothing missing and with laws of no catalogue included.{}\n",
        if scores.len() < FULL {
            format!(" These are {} cases; the whole bench has {FULL}.", scores.len())
        } else {
            String::new()
        }
    )?;
    writeln!(
        text,
        "Why, by cause: [known limits](../known-limits.md). Every case, with what was there and what was said: [{table}]({table}).\n"
    )?;
    let never: Vec<String> = by_law(scores)
        .into_iter()
        .filter(|(law, _)| in_catalogue(law))
        .filter(|(_, tally)| tally.count(Mark::Right) + tally.count(Mark::Tied) == 0)
        .map(|(law, tally)| format!("{law} ({})", tally.total()))
        .collect();
    if !never.is_empty() {
        writeln!(text, "Never right nor tied (cases): {}.", never.join(", "))?;
    }
    let wrong: Vec<String> = scores
        .iter()
        .filter(|score| score.mark == Mark::Wrong)
        .map(|score| {
            format!("{}: {} for {} ({})", score.number, names(&score.named), there(score), score.verdict)
        })
        .collect();
    if !wrong.is_empty() {
        writeln!(
            text,
            "\nWrong names, by case (`explained`: for certain; `improved`: with the words that a structured rest remains; `ambiguous`: as one of a tie):\n\n- {}",
            wrong.join("\n- ")
        )?;
    }
    far_from_the_floor(text, scores)
}

/// Outputs of cases rightly named whose held-out error is not within 1.2 of the floor.
fn far_from_the_floor(text: &mut String, scores: &[Score]) -> std::fmt::Result {
    let right = scores.iter().filter(|score| score.mark == Mark::Right);
    let far: Vec<String> = right
        .flat_map(|score| score.held_out.iter().map(move |held_out| (score, held_out)))
        .filter_map(|(score, held_out)| Some((score, held_out, held_out.over_the_floor()?)))
        .filter(|(_, _, ratio)| *ratio > NEAR_THE_FLOOR)
        .map(|(score, held_out, ratio)| {
            let refit = held_out
                .refitted
                .map_or(String::new(), |rms| format!(", a linear refit {:.1}", rms / held_out.floor));
            format!(
                "{}: {} with {}: {ratio:.2} times the floor{refit}",
                score.number,
                held_out.output,
                there(score)
            )
        })
        .collect();
    if far.is_empty() {
        return Ok(());
    }
    writeln!(
        text,
        "\nRightly named, and held out beyond {NEAR_THE_FLOOR} of the floor:\n\n- {}",
        far.join("\n- ")
    )
}

fn marks(text: &mut String, scores: &[Score]) -> std::fmt::Result {
    let rows = |text: &mut String, title: &str, rows: Vec<(String, Tally)>| -> std::fmt::Result {
        let heads: Vec<&str> = Mark::ALL.iter().map(|mark| mark.words()).collect();
        writeln!(text, "| {title} | cases | {} |", heads.join(" | "))?;
        writeln!(text, "|---|{}", "---|".repeat(Mark::ALL.len() + 1))?;
        for (name, tally) in rows {
            let counts: Vec<String> = Mark::ALL
                .iter()
                .map(|mark| match tally.count(*mark) {
                    0 => String::new(),
                    count => count.to_string(),
                })
                .collect();
            writeln!(text, "| {name} | {} | {} |", tally.total(), counts.join(" | "))?;
        }
        Ok(())
    };
    text.push_str("\n## By kind of concealment\n\n");
    let kinds = by_kind(scores).into_iter().map(|(kind, tally)| (kind.word().to_owned(), tally));
    rows(text, "kind", kinds.collect())?;
    text.push_str(
        "\nVisible: a linear refit leaves at least three times the noise. Absorbed: a refit of any single recording hides at least 70 % of the effect. Buried: a refit of all leaves \
         between half and twice the noise. Masked: a second effect, an unknown disturbance, or the tell-tale channel not recorded (no base encoder). Null: nothing missing. Decoy: only parameters wrong, \
         up to 6 % in Young's modulus and 24 % in damping. Outside: a law in no catalogue. \"Unexplained\" is right for the last and honest elsewhere.\n\n## By law\n\n",
    );
    rows(text, "law", by_law(scores).into_iter().collect())
}

fn numbers(text: &mut String, scores: &[Score]) -> std::fmt::Result {
    let share = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
    let errors: Vec<f64> =
        scores.iter().flat_map(|s| &s.parameters).filter(|p| p.truth != 0.0).map(|p| p.error.abs()).collect();
    let right = || scores.iter().filter(|score| score.mark == Mark::Right).flat_map(|s| &s.held_out);
    let over_refit: Vec<f64> = right().filter_map(|h| Some(h.extended? / h.refitted?)).collect();
    let to_truth: Vec<f64> = right().filter_map(|h| Some(h.extended_to_truth? / h.floor)).collect();
    let count = errors.len();
    writeln!(text, "\n## Numbers where rightly named\n\n| | median | cases |\n|---|---|---|")?;
    writeln!(text, "| relative error of a parameter | {} | {count} |", share(median(errors)))?;
    let ratios = held_out_ratios(scores);
    let count = ratios.len();
    writeln!(text, "| held-out error over the achievable floor | {} | {count} |", share(median(ratios)))?;
    let count = over_refit.len();
    writeln!(
        text,
        "| held-out error over that of the linear refit | {} | {count} |",
        share(median(over_refit))
    )?;
    let count = to_truth.len();
    writeln!(
        text,
        "| extended model against the noise-free truth, over the achievable floor | {} | {count} |",
        share(median(to_truth))
    )?;
    let seconds: Vec<f64> = scores.iter().map(|score| score.seconds).collect();
    writeln!(text, "| processor seconds per case | {} | {} |", share(median(seconds)), scores.len())
}

fn matrix(text: &mut String, scores: &[Score]) -> std::fmt::Result {
    let matrix = confusion(scores);
    let said: BTreeSet<&String> = matrix.values().flat_map(|row| row.keys()).collect();
    text.push_str("\n## What was said of what was there\n\nCases with one law or none; a case with two names counts twice.\n\n| there |");
    for column in &said {
        write!(text, " {} |", column.replace('_', " "))?;
    }
    writeln!(text, "\n|---|{}", "---|".repeat(said.len()))?;
    for (row, counts) in &matrix {
        write!(text, "| {row} |")?;
        for column in &said {
            match counts.get(*column) {
                Some(count) => write!(text, " {count} |")?,
                None => text.push_str(" |"),
            }
        }
        text.push('\n');
    }
    Ok(())
}

/// Every case as CSV: `left_over_noise` is what a linear refit leaves of the truth, over the noise; of the
/// commitment the first digits.
pub fn every_case(scores: &[Score]) -> String {
    let mut text =
        String::from("case,kind,machine,left_over_noise,there,answer,mark,processor_s,commitment\n");
    for score in scores {
        let said = if score.named.is_empty() { score.verdict.clone() } else { names(&score.named) };
        let cells = [
            score.number.to_string(),
            score.concealment.word().to_owned(),
            score.machine.clone(),
            format!("{:.1}", score.left_over_noise),
            there(score),
            said,
            score.mark.words().to_owned(),
            format!("{:.0}", score.seconds),
            score.commitment[..score.commitment.len().min(8)].to_owned(),
        ];
        text.push_str(&cells.map(|cell| quoted(&cell)).join(","));
        text.push('\n');
    }
    text
}

/// A cell of a CSV file.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

fn names(laws: &[String]) -> String {
    laws.join(" + ")
}

fn there(score: &Score) -> String {
    let all: Vec<String> = score.truth.iter().chain(&score.outside).cloned().collect();
    if all.is_empty() { "nothing".to_owned() } else { names(&all) }
}

#[cfg(test)]
mod tests {
    use super::super::judge::HeldOut;
    use super::super::tables::tests::score;
    use super::*;
    use crate::case::Concealment;

    fn making() -> Making {
        Making {
            seed: 1,
            cases: 3,
            limit_s: 40.0,
            tool_version: "a tool".to_owned(),
            tool_digest: "0123456789abcdef".to_owned(),
        }
    }

    fn held_out(extended: f64) -> HeldOut {
        HeldOut {
            output: "tip_deflection_m".to_owned(),
            floor: 1e-4,
            given: Some(5e-3),
            refitted: Some(4e-4),
            extended: Some(extended),
            extended_to_truth: None,
        }
    }

    #[test]
    fn a_wrong_name_is_printed_with_the_verdict_under_which_it_was_given() {
        let mut wrong = score(Concealment::Outside, &[], &["coulomb_friction at tip"], Mark::Wrong);
        wrong.verdict = "improved".to_owned();
        wrong.outside = vec!["outside:loaded_friction at beam".to_owned()];
        let page = page(&making(), &[wrong], "proof.csv");
        assert!(
            page.contains("0: coulomb_friction at tip for outside:loaded_friction at beam (improved)"),
            "{page}"
        );
    }

    #[test]
    fn outputs_far_from_the_floor_are_listed_and_those_near_it_are_not() {
        let mut far = score(Concealment::Visible, &["delay at sensor"], &["delay at sensor"], Mark::Right);
        far.held_out = vec![held_out(1.5e-4)];
        let near = Score { number: 7, held_out: vec![held_out(1.1e-4)], ..far.clone() };
        let page = page(&making(), &[far, near], "proof.csv");
        assert!(
            page.contains(
                "0: tip_deflection_m with delay at sensor: 1.50 times the floor, a linear refit 4.0"
            ),
            "{page}"
        );
        assert!(!page.contains("7: tip_deflection_m"), "{page}");
    }

    #[test]
    fn a_case_is_a_row_whose_cells_are_quoted_where_they_have_a_comma() {
        let mut one = score(Concealment::Visible, &["delay at sensor"], &[], Mark::Unexplained);
        one.machine = "beam, base motion measured".to_owned();
        one.verdict = "unexplained".to_owned();
        let table = every_case(&[one]);
        let (head, row) = table.split_once('\n').unwrap_or_default();
        assert_eq!(head.matches(',').count(), 8);
        assert!(row.contains("visible,\"beam, base motion measured\","), "{row}");
        assert!(row.contains(",delay at sensor,unexplained,unexplained,"), "{row}");
        assert!(page(&making(), &[], "proof.csv").contains("[proof.csv](proof.csv)"));
    }
}
