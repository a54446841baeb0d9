//! The paper, made again: everything is written, the published page is up to date, and the results are what
//! the page says.

use crate::support;

use std::time::{Duration, Instant};

use stillbeam::paper::summary::Summary;
use support::stillbeam;

const PUBLISHED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/results/paper.md");

#[test]
fn the_paper_is_made_again_and_the_published_page_is_up_to_date() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("paper");
    let began = Instant::now();
    let run = stillbeam(&["paper", "--out", out.to_str().unwrap()]);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert!(began.elapsed() < Duration::from_secs(60), "{:?}", began.elapsed());
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();

    let published = std::fs::read_to_string(PUBLISHED).unwrap();
    assert_same(&read("results.md"), &published);
    let report = read("report.html");
    assert_eq!(report.matches("<svg").count(), 12, "Figs. 4 to 9 and the free vibration");

    let summary: Summary = serde_json::from_str(&read("summary.json")).unwrap();
    assert_eq!(summary.schema_version, 1);
    check_sweeps(&summary);
    check_moves(&summary);
}

/// Four sweeps on the held base, four on the free one, and what each has to find.
fn check_sweeps(summary: &Summary) {
    for (sweeps, truths, width) in
        [(&summary.sweeps, &summary.true_modes, 4.0), (&summary.force_sweeps, &summary.free_modes, 4.0)]
    {
        assert_eq!(sweeps.len(), 4);
        for sweep in sweeps {
            for (mode, (hz, damping)) in truths.iter().enumerate() {
                for (found, truth) in [(&sweep.frequency_hz[mode], hz), (&sweep.damping_ratio[mode], damping)]
                {
                    let off = (found.value - truth).abs();
                    assert!(off < width * found.stderr, "{}: {found:?}, truth {truth}", sweep.sweep);
                }
            }
        }
    }
    assert!((summary.true_modes[0].0 - 1.100).abs() < 1e-3);
    assert!((summary.free_modes[0].0 - 1.128).abs() < 1e-3);
    assert!((summary.sweeps[0].duration_s - 7.9).abs() < 1e-9);
}

/// The shaped commands are as long as the paper's settling times; two modes are stilled, one is not enough.
fn check_moves(summary: &Summary) {
    let [none, shaped @ ..] = summary.moves.as_slice() else { panic!("no moves") };
    assert!((none.percentage_vibration_pct - 100.0).abs() < 1e-9);
    assert_eq!(shaped.len(), 6);
    for row in shaped {
        let paper_s = row.paper_settling_time_s.unwrap();
        assert!((row.command_end_s - paper_s).abs() < 0.07, "{row:?}");
        assert!((row.overshoot_pct - row.paper_overshoot_pct.unwrap()).abs() < 2.0, "{row:?}");
    }
    assert!(shaped[..3].iter().all(|row| (3.0..6.0).contains(&row.percentage_vibration_pct)));
    assert!(shaped[3..].iter().all(|row| row.percentage_vibration_pct < 0.05));
}

/// The same words, and the same numbers to 2 % or one and a half of the last digit: mathematical functions
/// differ in their last bits from machine to machine.
fn assert_same(found: &str, published: &str) {
    let remedy = "regenerate it: cargo stillbeam paper --results docs/results/paper.md";
    let (found, published): (Vec<&str>, Vec<&str>) =
        (found.split_whitespace().collect(), published.split_whitespace().collect());
    assert_eq!(found.len(), published.len(), "docs/results/paper.md has other words; {remedy}");
    for (new, old) in found.iter().zip(&published) {
        let number = |word: &str| word.trim_end_matches([',', '.', ':', ';', ')']).parse::<f64>().ok();
        let same = match (number(new), number(old)) {
            (Some(a), Some(b)) => {
                let decimals = old.split_once('.').map_or(0, |(_, digits)| digits.len());
                (a - b).abs() <= 0.02 * b.abs() + 1.5 * 10_f64.powi(-(decimals as i32))
            }
            _ => new == old,
        };
        assert!(same, "docs/results/paper.md says `{old}`, now it is `{new}`; {remedy}");
    }
}
