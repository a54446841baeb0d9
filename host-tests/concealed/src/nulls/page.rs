//! What was said of cases in which nothing is missing, as a page.

use std::fmt::Write;

use super::ask::{Heard, Said};

/// Tables over all cases, by what drives the machine and by rate, and a list of those that were wrong.
/// `about` says how they were made.
pub fn page(about: &str, heard: &[Heard]) -> String {
    let mut text = format!("## {about}\n\n");
    text.push_str(&heading());
    text.push_str(&row("all", &heard.iter().collect::<Vec<_>>()));
    let mut drives: Vec<&str> = heard.iter().map(|one| one.drive).collect();
    drives.sort_unstable();
    drives.dedup();
    for drive in drives {
        text.push_str(&row(drive, &heard.iter().filter(|one| one.drive == drive).collect::<Vec<_>>()));
    }
    let mut rates: Vec<f64> = heard.iter().map(|one| one.rate_hz).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    for rate_hz in rates {
        let those: Vec<&Heard> = heard.iter().filter(|one| one.rate_hz == rate_hz).collect();
        text.push_str(&row(&format!("{rate_hz} Hz"), &those));
    }
    let wrong: Vec<&Heard> = heard.iter().filter(|one| !one.said.is_right()).collect();
    if !wrong.is_empty() {
        text.push_str("\nNot right:\n\n");
        for one in wrong {
            // Writing into a string cannot fail.
            let _ = writeln!(
                text,
                "- case {}: {}: {} ({}), {:.0} s",
                one.number,
                one.machine,
                one.said.words(),
                one.details,
                one.seconds
            );
        }
    }
    text
}

fn heading() -> String {
    let words: Vec<&str> = Said::ALL.iter().map(|said| said.words()).collect();
    format!(
        "| | cases | {} | median, 90 %, most processor seconds |\n|---|---|{}---|\n",
        words.join(" | "),
        "---|".repeat(Said::ALL.len())
    )
}

fn row(name: &str, those: &[&Heard]) -> String {
    let counts: Vec<String> = Said::ALL
        .iter()
        .map(|said| those.iter().filter(|one| one.said == *said).count().to_string())
        .collect();
    let mut seconds: Vec<f64> = those.iter().map(|one| one.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (share * seconds.len().saturating_sub(1) as f64).round() as usize;
        seconds.get(place).copied().unwrap_or(0.0)
    };
    format!(
        "| {name} | {} | {} | {:.1}, {:.1}, {:.1} |\n",
        those.len(),
        counts.join(" | "),
        at(0.5),
        at(0.9),
        at(1.0)
    )
}
