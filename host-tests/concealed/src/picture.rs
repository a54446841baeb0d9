//! One solved case as a picture: before, located, named, after.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::case::files::{MODEL, recording};
use crate::run::{ANSWER, EXTENDED, column_of};

/// Size of the drawing area of a panel, pixels.
const PANEL: (f64, f64) = (820.0, 120.0);
/// Left edge of the panels and distance from panel to panel.
const MARGIN: f64 = 85.0;
const EVERY: f64 = 185.0;
/// File of the extended model with its laws taken out.
const WITHOUT: &str = "without.toml";

/// A panel: title, residual in metres (or the column's unit), its colour.
struct Panel {
    title: String,
    residual: Vec<f64>,
    colour: &'static str,
}

/// Draws a case that the tool has answered, from its folder; `None` where something is missing or nothing was named.
///
/// Shown is the held-out recording `run`, its first output: recorded minus the given model, minus the refitted model without
/// the law found, and minus the whole extended model.
pub fn picture(tool: &Path, folder: &Path, run: &str) -> Option<String> {
    let answer: Value = serde_json::from_str(&fs::read_to_string(folder.join(ANSWER)).ok()?).ok()?;
    let effect = answer["effects"].get(0)?;
    let name = format!("{} at {}", effect["id"].as_str()?.replace('_', " "), effect["location"].as_str()?);
    let extended = fs::read_to_string(folder.join(EXTENDED)).ok()?;
    fs::write(folder.join(WITHOUT), without_physics(&extended)).ok()?;
    let text = fs::read_to_string(recording(folder, run)).ok()?;
    let column = text.lines().next()?.split(',').nth(2)?.to_owned();
    let (time_s, recorded) = (column_of(&text, "time_s")?, column_of(&text, &column)?);
    let residual = |model: &str| -> Option<Vec<f64>> {
        let out = format!("picture_{model}.csv");
        let done = Command::new(tool)
            .current_dir(folder)
            .args(["simulate", model, "--input", &format!("{run}.csv"), "--out", &out])
            .output()
            .ok()?;
        let text = done.status.success().then(|| fs::read_to_string(folder.join(&out)).ok())??;
        let simulated = column_of(&text, &column)?;
        (simulated.len() == recorded.len())
            .then(|| recorded.iter().zip(&simulated).map(|(one, other)| one - other).collect())
    };
    let panels = [
        Panel {
            title: "Before: recorded minus the lab's model".to_owned(),
            residual: residual(MODEL)?,
            colour: "#8a8f98",
        },
        Panel {
            title: "Located: what the fitted parameters cannot explain without the law found".to_owned(),
            residual: residual(WITHOUT)?,
            colour: "#c2410c",
        },
        Panel {
            title: format!("After: with {name}{}", in_words(effect)),
            residual: residual(EXTENDED)?,
            colour: "#15803d",
        },
    ];
    Some(drawing(&panels, &time_s))
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

fn drawing(panels: &[Panel], time_s: &[f64]) -> String {
    let end_s = time_s.last().copied().unwrap_or(1.0);
    let height = EVERY * panels.len() as f64 + 40.0;
    let width = PANEL.0 + 2.0 * MARGIN;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    // All panels on one scale: that what is left becomes small is the point.
    let most = panels.iter().flat_map(|panel| &panel.residual).fold(1e-12_f64, |most, y| most.max(y.abs()));
    for (number, panel) in panels.iter().enumerate() {
        let top = EVERY * number as f64 + 40.0;
        let (middle, scale) = (top + 0.5 * PANEL.1, 0.5 * PANEL.1 / most);
        let rms =
            (panel.residual.iter().map(|y| y * y).sum::<f64>() / panel.residual.len().max(1) as f64).sqrt();
        // Writing into a string cannot fail.
        let _ = write!(
            svg,
            "<text x=\"{MARGIN}\" y=\"{}\" font-weight=\"bold\">{}</text>\n\
             <rect x=\"{MARGIN}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"#f6f7f9\"/>\n\
             <text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#444\">{:.3} mm rms</text>\n\
             <text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#444\">{:.1} mm</text>\n\
             <text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#444\">−{:.1} mm</text>\n",
            top - 10.0,
            panel.title,
            PANEL.0,
            PANEL.1,
            MARGIN + PANEL.0 - 6.0,
            top + PANEL.1 - 8.0,
            1e3 * rms,
            MARGIN - 6.0,
            top + 10.0,
            1e3 * most,
            MARGIN - 6.0,
            top + PANEL.1,
            1e3 * most,
        );
        let mut path = String::new();
        for (t, y) in time_s.iter().zip(&panel.residual) {
            let (x, y) = (MARGIN + PANEL.0 * t / end_s, middle - scale * y);
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { "M" } else { "L" });
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"0.8\"/>",
            panel.colour
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{MARGIN}\" y=\"{y}\" fill=\"#444\">0 s</text><text x=\"{}\" y=\"{y}\" text-anchor=\"end\" fill=\"#444\">{end_s:.0} s</text>\n</svg>\n",
        MARGIN + PANEL.0,
        y = EVERY * (panels.len() as f64 - 1.0) + 40.0 + PANEL.1 + 18.0,
    );
    svg
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
}
