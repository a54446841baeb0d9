//! The printed table: this run beside the paper's Table 2.

use super::DemoResult;

/// The table as text, the definitions below it.
pub fn results_table(result: &DemoResult) -> String {
    let summary = result.summary();
    let mut lines = vec![
        format!("{:18}|{:^29}|{:^29}", "50 mm move", "this run (simulated beam)", "the paper, measured"),
        format!(
            "{:18}|{:>9}{:>10}{:>9} |{:>9}{:>10}{:>9} ",
            "shaper", "settling", "overshoot", "vibr.", "settling", "overshoot", "vibr."
        ),
        format!("{:18}|{:>9}{:>10}{:>9} |{:>9}{:>10}{:>9} ", "", "s", "%", "%", "s", "%", "%"),
        format!("{}+{}+{}", "-".repeat(18), "-".repeat(29), "-".repeat(29)),
    ];
    for (row, outcome) in summary.moves.iter().zip(&result.moves) {
        let paper = match outcome.case.paper {
            Some(paper) => format!(
                "{:>9.2}{:>10.2}{:>9.2}",
                paper.settling_time_s, paper.overshoot_pct, paper.percentage_vibration_pct
            ),
            None => format!("{:>9}{:>10}{:>9}", "-", "-", "-"),
        };
        let line = format!(
            "{:18}|{:>9}{:>10.2}{:>9.4} |{paper} ",
            row.shaper,
            row.settling_time_s.map_or_else(|| "never".to_owned(), |seconds| format!("{seconds:.2}")),
            row.overshoot_pct,
            row.percentage_vibration_pct
        );
        lines.push(line.trim_end().to_owned());
    }
    lines.push(String::new());
    lines.extend(DEFINITIONS.map(|(name, meaning)| format!("{name}: {meaning}")));
    lines.join("\n") + "\n"
}

/// What the columns mean.
pub(crate) const DEFINITIONS: [(&str, &str); 3] = [
    (
        "settling",
        "from the command's start until the tip's absolute position stays within 2 % of the move (1 mm) around its target",
    ),
    ("overshoot", "the furthest that the tip goes beyond its target, in percent of the move"),
    (
        "vibration",
        "the tip's largest deflection after the setpoint has come to rest, in percent of that after the unshaped move",
    ),
];
