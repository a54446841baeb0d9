//! The results as sentences and tables, for the page in docs/results and for the report.

mod conclusions;
mod experiments;

use std::fmt::Write;

use stillbeam_identify::Estimate;

use super::PaperResult;

/// What of the result belongs to which curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Setpoint and tip of a sweep, Fig. 4's spectra.
    Spectra,
    /// The free vibration whose decrement is taken.
    FreeVibration,
    /// Fig. 5.
    Responses,
    /// Figs. 6 to 9.
    Moves,
}

/// A part of the results.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// Paragraphs before the table.
    pub text: Vec<String>,
    /// Its table, if it has one.
    pub table: Option<Table>,
    /// Paragraphs after the table.
    pub notes: Vec<String>,
    /// Its curves, if it has some.
    pub figure: Option<Figure>,
}

/// A table of text.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Column headings.
    pub head: Vec<String>,
    /// Rows, each as long as the heading.
    pub rows: Vec<Vec<String>>,
}

/// All parts in order.
pub fn sections(result: &PaperResult) -> Vec<Section> {
    vec![
        experiments::table_1(result),
        experiments::force(result),
        experiments::decrement(result),
        experiments::responses(result),
        experiments::table_2(result),
        conclusions::which_move(result),
        conclusions::model_errors(result),
        conclusions::testbed(result),
    ]
}

/// What is simulated and what is not.
pub fn introduction(result: &PaperResult) -> String {
    let modes: Vec<String> = result
        .true_modes
        .iter()
        .map(|mode| format!("{:.4} Hz with a damping ratio of {:.4}", mode.frequency_hz, mode.damping_ratio))
        .collect();
    format!(
        "The experiments of Pham, Kim, Nguyen and Hong (2021), made again. Every setpoint is computed by this project's firmware core and \
         streamed over its console. The beam (models/paper_beam.toml) and the camera (100 frames per second, 50 µm rms of noise) are \
         simulated, so the truth is known: {}, base held. The paper's numbers are measurements on its testbed; what its section, its \
         participations, its second damping ratio and its move were it does not print.",
        modes.join(" and ")
    )
}

/// The whole as Markdown: docs/results/paper.md.
pub fn results_page(result: &PaperResult) -> String {
    let mut page = String::from("# The paper, made again\n\n");
    page.push_str(
        "Made by `cargo stillbeam paper --results docs/results/paper.md`; a test fails when it is out of date. The same with the figures, as one HTML \
         file: `cargo stillbeam paper --out out/paper`, then out/paper/report.html. Every printed equation is checked in [../errata.md](../errata.md).\n\n",
    );
    page.push_str(&introduction(result));
    page.push('\n');
    for section in sections(result) {
        // Writing to a string does not fail.
        let _written = write!(page, "\n## {}\n", section.title);
        for paragraph in &section.text {
            let _written = write!(page, "\n{paragraph}\n");
        }
        if let Some(table) = &section.table {
            let _written = write!(page, "\n{}", table.markdown());
        }
        for paragraph in &section.notes {
            let _written = write!(page, "\n{paragraph}\n");
        }
    }
    page
}

impl Table {
    fn new<'h>(head: impl IntoIterator<Item = &'h str>, rows: Vec<Vec<String>>) -> Self {
        Self { head: head.into_iter().map(str::to_owned).collect(), rows }
    }

    fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let mut text = line(&self.head);
        text.push_str(&format!("|{}\n", "---|".repeat(self.head.len())));
        self.rows.iter().for_each(|row| text.push_str(&line(row)));
        text
    }
}

/// Half of a 95 % interval in standard errors.
const TWO_SIDED_95: f64 = 1.96;

/// `value ± half` with the 95 % interval to two digits.
fn interval(estimate: &Estimate) -> String {
    let half = TWO_SIDED_95 * estimate.stderr;
    if !(half.is_finite() && half > 0.0) {
        return format!("{}", estimate.value);
    }
    let decimals = (1.0 - half.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{:.decimals$} ± {half:.decimals$}", estimate.value)
}

/// Whether the 95 % interval holds the truth.
fn holds(estimate: &Estimate, truth: f64) -> bool {
    (estimate.value - truth).abs() <= TWO_SIDED_95 * estimate.stderr
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_have_two_digits() {
        let text = |value, stderr| interval(&Estimate { value, stderr });
        assert_eq!(text(1.0999662, 1.0e-6), "1.0999662 ± 0.0000020");
        assert_eq!(text(6.93916, 4.73e-3), "6.9392 ± 0.0093");
        assert!(holds(&Estimate { value: 1.0, stderr: 0.1 }, 1.19));
        assert!(!holds(&Estimate { value: 1.0, stderr: 0.1 }, 1.2));
    }
}
