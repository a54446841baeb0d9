//! One solved case as a picture: before, located, named, after.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::case::files::{MODEL, recording};
use crate::run::{ANSWER, EXTENDED, column_of};

/// Size of the drawing area of a panel, pixels.
const PANEL: (f64, f64) = (820.0, 104.0);
/// Left edge of the panels, top of the first one, distance from panel to panel.
const MARGIN: f64 = 85.0;
const TOP: f64 = 44.0;
const EVERY: f64 = 166.0;
/// Candidates shown beside the one that was named.
const RIVALS: usize = 4;
/// File of the extended model with its laws taken out.
const WITHOUT: &str = "without.toml";
/// Samples of an input per sample of the recording.
const FINER: usize = 5;
/// Colours for a light page, and for a dark one.
const STYLE: &str = "<style>\
    .page{fill:#fff}.area{fill:#f4f5f7}.words{fill:#1f2328}.small{fill:#57606a}.window{fill:#fde68a}\
    .before{stroke:#6b7280}.located{stroke:#c2410c}.after{stroke:#15803d}.bar{fill:#9ca3af}.named{fill:#15803d}\
    @media(prefers-color-scheme:dark){.page{fill:#0d1117}.area{fill:#161b22}.words{fill:#e6edf3}.small{fill:#9198a1}.window{fill:#6b4f00}\
    .before{stroke:#9ca3af}.located{stroke:#fb923c}.after{stroke:#4ade80}.bar{fill:#6b7280}.named{fill:#4ade80}}\
    </style>\n";

/// A residual over time, in the column's unit.
struct Curve {
    residual: Vec<f64>,
    class: &'static str,
}

/// Draws a case that the tool has answered, from its folder; `None` where something is missing or nothing was
/// named.
///
/// Before and located: the training recording in which the tool saw most of the mismatch, recorded minus the
/// lab's model and minus the fitted model without the law found. Named: the laws that it tried. After: the
/// held-out recording `check`.
pub fn picture(tool: &Path, folder: &Path, check: &str) -> Option<String> {
    let answer: Value = serde_json::from_str(&fs::read_to_string(folder.join(ANSWER)).ok()?).ok()?;
    let effect = answer["effects"].get(0)?;
    let extended = fs::read_to_string(folder.join(EXTENDED)).ok()?;
    fs::write(folder.join(WITHOUT), without_physics(&extended)).ok()?;
    let case = Case { tool, folder };
    let sentences: Vec<&str> =
        answer["mismatch"]["sentences"].as_array()?.iter().filter_map(Value::as_str).collect();
    let seen_in = sentences.iter().find_map(|text| recording_named(text)).unwrap_or(check);
    let (time_s, before) = case.residual(seen_in, MODEL)?;
    let (_, located) = case.residual(seen_in, WITHOUT)?;
    let (check_s, without) = case.residual(check, WITHOUT)?;
    let (_, after) = case.residual(check, EXTENDED)?;
    let windows: Vec<(f64, f64)> =
        answer["mismatch"]["time_windows_s"].as_array()?.iter().filter_map(window).collect();
    let errors = format!("{} → {}", millimetres(&without), millimetres(&after));

    let mut svg = beginning();
    let mut panel = Panel { svg: &mut svg, number: 0 };
    panel.title(&format!("Before: {seen_in}, recorded minus the lab's model, {} rms", millimetres(&before)));
    panel.curves(&time_s, &[], &[Curve { residual: before, class: "before" }]);
    panel.title(&format!(
        "Located: minus the fitted model without the law found, {} rms; marked: where most of the mismatch of a linear refit lies",
        millimetres(&located)
    ));
    panel.curves(&time_s, &windows, &[Curve { residual: located, class: "located" }]);
    panel.title(&format!("Named: {}{}", name(effect), in_words(effect)));
    panel.candidates(&answer);
    panel.title(&format!(
        "After: {check}, which the tool had not been fitted to; with the law found the error falls {errors}"
    ));
    let curves = [Curve { residual: without, class: "located" }, Curve { residual: after, class: "after" }];
    panel.curves(&check_s, &[], &curves);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// A case's folder, and the tool that simulates in it.
struct Case<'c> {
    tool: &'c Path,
    folder: &'c Path,
}

impl Case<'_> {
    /// Stamps, and recorded minus simulated of the first output.
    fn residual(&self, run: &str, model: &str) -> Option<(Vec<f64>, Vec<f64>)> {
        let text = fs::read_to_string(recording(self.folder, run)).ok()?;
        let column = text.lines().next()?.split(',').nth(2)?.to_owned();
        let (time_s, recorded) = (column_of(&text, "time_s")?, column_of(&text, &column)?);
        let (finer, out) = (format!("picture_{run}.csv"), format!("picture_{model}.csv"));
        let input = text.lines().next()?.split(',').nth(1)?.to_owned();
        fs::write(self.folder.join(&finer), finely(&time_s, &input, &column_of(&text, &input)?)).ok()?;
        let done = Command::new(self.tool)
            .current_dir(self.folder)
            .args(["simulate", model, "--input", &finer, "--out", &out])
            .output()
            .ok()?;
        let text = done.status.success().then(|| fs::read_to_string(self.folder.join(&out)).ok())??;
        let simulated: Vec<f64> = column_of(&text, &column)?.into_iter().step_by(FINER).collect();
        let differ = recorded.iter().zip(&simulated).map(|(one, other)| one - other).collect();
        (simulated.len() == recorded.len()).then_some((time_s, differ))
    }
}

/// An input as CSV with [`FINER`] times as many samples, by cubics through its own: the simulation joins
/// samples by straight lines, and the machine did not.
fn finely(time_s: &[f64], column: &str, input: &[f64]) -> String {
    let at = |k: usize| input.get(k).or(input.last()).copied().unwrap_or(0.0);
    // Derivatives per sample, of fourth order inside.
    let slope = |k: usize| match k.checked_sub(2) {
        Some(before) if k + 2 < input.len() => {
            (8.0 * (at(k + 1) - at(k - 1)) - (at(k + 2) - at(before))) / 12.0
        }
        _ => 0.5 * (at(k + 1) - at(k.saturating_sub(1))),
    };
    let mut text = format!("time_s,{column}\n");
    for (k, pair) in time_s.windows(2).enumerate() {
        let (from, to, way) = (slope(k), slope(k + 1), at(k + 1) - at(k));
        for part in 0..FINER {
            let s = part as f64 / FINER as f64;
            let value = at(k) + s * (from + s * (3.0 * way - 2.0 * from - to + s * (from + to - 2.0 * way)));
            // Writing into a string cannot fail.
            let _ = writeln!(text, "{:.6},{value:e}", pair[0] + s * (pair[1] - pair[0]));
        }
    }
    let _ = writeln!(text, "{:.6},{:e}", time_s.last().copied().unwrap_or(0.0), at(input.len()));
    text
}

/// The recording that a sentence names as `... of NAME.csv lies at ...`.
fn recording_named(text: &str) -> Option<&str> {
    text.split_whitespace().find_map(|word| word.strip_suffix(".csv"))
}

fn window(value: &Value) -> Option<(f64, f64)> {
    Some((value.get(0)?.as_f64()?, value.get(1)?.as_f64()?))
}

fn millimetres(residual: &[f64]) -> String {
    let square = residual.iter().map(|y| y * y).sum::<f64>() / residual.len().max(1) as f64;
    format!("{:.3} mm", 1e3 * square.sqrt())
}

fn name(law: &Value) -> String {
    let word = |key: &str| law[key].as_str().unwrap_or_default().replace('_', " ");
    format!("{} at {}", word("id"), word("location"))
}

/// The parameters of an effect with their standard errors.
fn in_words(effect: &Value) -> String {
    let Some(parameters) = effect["parameters"].as_object() else { return String::new() };
    parameters.iter().fold(String::new(), |mut text, (name, estimate)| {
        if let (Some(value), Some(stderr)) = (estimate["value"].as_f64(), estimate["stderr"].as_f64()) {
            let unit = estimate["unit"].as_str().unwrap_or_default();
            // Writing into a string cannot fail.
            let decimals =
                if stderr > 0.0 { (1.0 - stderr.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 };
            let name = name.replace('_', " ");
            let _ = write!(text, ", {name} {value:.decimals$} ± {stderr:.decimals$} {unit}");
        }
        text
    })
}

/// A model file without its `[[physics]]` tables.
fn without_physics(model: &str) -> String {
    let mut kept = String::new();
    let mut inside = false;
    for line in model.lines() {
        if line.starts_with('[') {
            inside = line.starts_with("[[physics]]") || line.starts_with("[physics");
        }
        if !inside {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

fn beginning() -> String {
    let (width, height) = (PANEL.0 + 2.0 * MARGIN, TOP + 4.0 * EVERY - 20.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         {STYLE}<rect class=\"page\" width=\"{width}\" height=\"{height}\"/>\n"
    )
}

/// Panels one below the other.
struct Panel<'p> {
    svg: &'p mut String,
    number: usize,
}

// Writing into a string cannot fail.
impl Panel<'_> {
    fn top(&self) -> f64 {
        TOP + EVERY * self.number as f64
    }

    fn title(&mut self, words: &str) {
        let (first, rest) = words.split_once(':').unwrap_or((words, ""));
        let y = self.top() - 12.0;
        let (first, rest) = (escaped(first), escaped(rest));
        let _ = writeln!(
            self.svg,
            "<text class=\"words\" x=\"{MARGIN}\" y=\"{y}\"><tspan font-weight=\"bold\">{first}</tspan>:{rest}</text>"
        );
    }

    /// Curves on one scale over the same stamps, windows behind them.
    fn curves(&mut self, time_s: &[f64], windows: &[(f64, f64)], curves: &[Curve]) {
        let (top, end_s) = (self.top(), time_s.last().copied().unwrap_or(1.0));
        let most =
            curves.iter().flat_map(|curve| &curve.residual).fold(1e-12_f64, |most, y| most.max(y.abs()));
        let (middle, scale) = (top + 0.5 * PANEL.1, 0.5 * PANEL.1 / most);
        self.area(top);
        for (from_s, to_s) in windows {
            let (x, to) = (MARGIN + PANEL.0 * from_s / end_s, MARGIN + PANEL.0 * to_s.min(end_s) / end_s);
            let _ = writeln!(
                self.svg,
                "<rect class=\"window\" x=\"{x:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"{}\"/>",
                to - x,
                PANEL.1
            );
        }
        for curve in curves {
            let path = outline(time_s, &curve.residual, end_s, |y| middle - scale * y);
            let _ = writeln!(
                self.svg,
                "<path class=\"{}\" d=\"{path}\" fill=\"none\" stroke-width=\"1\"/>",
                curve.class
            );
        }
        let left = MARGIN - 6.0;
        let _ = writeln!(
            self.svg,
            "<g class=\"small\" font-size=\"11\"><text x=\"{left}\" y=\"{}\" text-anchor=\"end\">{2:.1} mm</text>\
             <text x=\"{left}\" y=\"{}\" text-anchor=\"end\">−{2:.1} mm</text>\
             <text x=\"{MARGIN}\" y=\"{3}\">0 s</text><text x=\"{4}\" y=\"{3}\" text-anchor=\"end\">{end_s:.0} s</text></g>",
            top + 10.0,
            top + PANEL.1,
            1e3 * most,
            top + PANEL.1 + 15.0,
            MARGIN + PANEL.0,
        );
        self.number += 1;
    }

    /// The laws that were tried: how clearly each shows beside what a refit would hide of it.
    fn candidates(&mut self, answer: &Value) {
        let top = self.top();
        self.area(top);
        let clear = |law: &Value| law["screen_t"].as_f64().map(f64::abs);
        let mut laws: Vec<(&Value, f64)> = answer["candidates"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|law| Some((law, clear(law)?)))
            .collect();
        laws.sort_by(|a, b| (b.0["named"] == true).cmp(&(a.0["named"] == true)).then(b.1.total_cmp(&a.1)));
        laws.truncate(1 + RIVALS);
        let most = laws.iter().fold(1.0_f64, |most, (_, clear)| most.max(*clear));
        for (row, (law, clear)) in laws.iter().enumerate() {
            let y = top + 6.0 + 19.0 * row as f64;
            let class = if law["named"] == true { "named" } else { "bar" };
            let _ = writeln!(
                self.svg,
                "<text class=\"words\" x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"12\">{}</text>\
                 <rect class=\"{class}\" x=\"{}\" y=\"{y}\" width=\"{:.1}\" height=\"13\"/>\
                 <text class=\"small\" x=\"{:.1}\" y=\"{}\" font-size=\"11\">{clear:.1}</text>",
                MARGIN + 215.0,
                y + 11.0,
                escaped(&name(law)),
                MARGIN + 225.0,
                540.0 * clear / most,
                MARGIN + 231.0 + 540.0 * clear / most,
                y + 11.0,
            );
        }
        let _ = writeln!(
            self.svg,
            "<text class=\"small\" x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"11\">how clearly each law shows on the training recordings, in standard errors, what a refit would hide of it taken out</text>",
            MARGIN + PANEL.0,
            top + PANEL.1 + 15.0,
        );
        self.number += 1;
    }

    fn area(&mut self, top: f64) {
        let _ = writeln!(
            self.svg,
            "<rect class=\"area\" x=\"{MARGIN}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>",
            PANEL.0, PANEL.1
        );
    }
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;")
}

/// A path through the least and the greatest value of every pixel.
fn outline(time_s: &[f64], values: &[f64], end_s: f64, y_of: impl Fn(f64) -> f64) -> String {
    let pixel = |t: f64| (PANEL.0 * t / end_s).round();
    let mut path = String::new();
    let mut points = time_s.iter().zip(values).peekable();
    while let Some((t, first)) = points.next() {
        let x = pixel(*t);
        let (mut least, mut most) = (*first, *first);
        while let Some((_, value)) = points.next_if(|(t, _)| pixel(**t) == x) {
            least = least.min(*value);
            most = most.max(*value);
        }
        let x = MARGIN + x;
        let _ = write!(path, "{}{x} {:.1}", if path.is_empty() { 'M' } else { 'L' }, y_of(least));
        if most > least {
            let _ = write!(path, "V{:.1}", y_of(most));
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_taken_out_of_a_model_and_nothing_else() {
        let model = "schema = 1\n[base]\nmass_kg = 2.0\n\n[[physics]]\nid = \"x\"\n[physics.parameters]\nforce = 1.0\n\n[input]\ncolumn = \"force_N\"\n";
        let kept = without_physics(model);
        assert_eq!(kept, "schema = 1\n[base]\nmass_kg = 2.0\n\n[input]\ncolumn = \"force_N\"\n");
    }

    #[test]
    fn an_input_is_made_finer_by_smooth_curves_through_its_samples() {
        let time_s: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.01).collect();
        let input: Vec<f64> = time_s.iter().map(|t| (30.0 * t).sin()).collect();
        let fine = finely(&time_s, "force_N", &input);
        let (t, u) = (column_of(&fine, "time_s").unwrap(), column_of(&fine, "force_N").unwrap());
        assert_eq!(t.len(), 49 * FINER + 1);
        assert!((0..50).all(|k| u[k * FINER] == input[k]));
        let inside = t.iter().zip(&u).skip(3 * FINER).take(44 * FINER);
        assert!(inside.clone().all(|(t, u)| (u - (30.0 * t).sin()).abs() < 1e-4));
    }

    #[test]
    fn an_outline_has_the_extremes_of_every_pixel() {
        let time_s: Vec<f64> = (0..8200).map(|k| f64::from(k) * 1e-3).collect();
        let values: Vec<f64> = (0..8200).map(|k| if k == 4107 { 9.0 } else { f64::from(k % 2) }).collect();
        let path = outline(&time_s, &values, 8.2, |y| y);
        assert!(path.contains("V9.0") && path.starts_with("M85 0.0V1.0L86 0.0V1.0"), "{path:.60}");
        assert!(path.len() < 20 * 821);
        assert_eq!(
            recording_named("62 % of what is left in tip_deflection_m of third.csv lies at 8 s."),
            Some("third")
        );
    }
}
