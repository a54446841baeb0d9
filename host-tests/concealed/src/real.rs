//! Recordings of real machines: what the tool says of them, as a page.
//!
//! The recordings are public and not part of this repository; whoever has them gives the folder.

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

/// A part of a recorded file as a recording of its own: name, file, first and last row counted from the header.
type Part = (&'static str, &'static str, usize, usize);

/// A real machine.
struct Machine {
    name: &'static str,
    source: &'static str,
    model: &'static str,
    train: &'static [Part],
    held_out: &'static [Part],
    /// Rows that are averaged into one.
    mean_of: usize,
    /// What is known of it from elsewhere.
    known: &'static str,
    /// Laws that it is known to have.
    expected: &'static [&'static str],
}

const ALL: usize = usize::MAX;

const MACHINES: [Machine; 2] = [
    Machine {
        name: "EMPS: a linear axis with motor and ball screw",
        source: "Janot, Gautier and Brunot, Workshop on Nonlinear System Identification Benchmarks, 2019 (nonlinearbenchmark.org)",
        model: "emps.toml",
        train: &[("estimation", "emps/emps_estimation.csv", 0, ALL)],
        held_out: &[("pulses", "emps/emps_validation_pulses.csv", 0, ALL)],
        mean_of: 10,
        known: "Coulomb friction 20.4 N, offset −3.2 N, mass 95.1 kg, viscous friction 203.5 N s/m (the authors' inverse-model fit). Open loop on the record with pulses, \
                that model misses the position by 6.7 mm rms; Stribeck friction or drag improve the training record and worsen this one.",
        expected: &["coulomb_friction", "constant_force"],
    },
    Machine {
        name: "Silverbox: an electronic Duffing oscillator",
        source: "Wigren and Schoukens, European Control Conference, 2013 (nonlinearbenchmark.org)",
        model: "silverbox.toml",
        train: &[
            ("multisine_1", "silverbox/silverbox_SNLS80mV.csv", 40_900, 44_996),
            ("multisine_2", "silverbox/silverbox_SNLS80mV.csv", 58_000, 62_096),
        ],
        held_out: &[("arrow_end", "silverbox/silverbox_SNLS80mV.csv", 34_000, 40_650)],
        mean_of: 1,
        known: "A hardening cubic spring and a small even term from an offset. Linear models miss the growing-amplitude record by 14 mV rms, the best published by 0.26 to 0.3 mV.",
        expected: &["cubic_stiffness"],
    },
];

/// Runs the tool on every real machine whose recordings are in `data`, in folders below `out`, and writes a page.
///
/// # Errors
/// What the system says when a file cannot be read or written or the tool not started; a recording that is not there.
pub fn real(tool: &Path, data: &Path, models: &Path, out: &Path) -> io::Result<String> {
    let mut page = String::from(
        "# Recordings of real machines: what `stillbeam diagnose` says\n\n\
         Made by `cargo xtask prove --real DATA --page docs/results/real.md`, DATA a folder with the published recordings as CSV. Nothing below is known to be complete: \
         unlike in the [concealed cases](proof.md), nobody knows the truth.\n",
    );
    for machine in &MACHINES {
        let folder = out.join(machine.model.trim_end_matches(".toml"));
        fs::create_dir_all(&folder)?;
        fs::copy(models.join(machine.model), folder.join("model.toml"))?;
        for part in machine.train.iter().chain(machine.held_out) {
            cut(data, part, machine.mean_of, &folder)?;
        }
        let file = |part: &Part| format!("{}.csv", part.0);
        let begun = Instant::now();
        let done = Command::new(tool)
            .current_dir(&folder)
            .args(["diagnose", "model.toml"])
            .args(machine.train.iter().map(file))
            .arg("--held-out")
            .args(machine.held_out.iter().map(file))
            .args(["--json", "answer.json", "--extended-model", "extended.toml"])
            .output()?;
        let seconds = begun.elapsed().as_secs_f64();
        // Writing into a string cannot fail.
        let _ = write!(page, "\n## {}\n\nSource: {}. {}\n\n", machine.name, machine.source, machine.known);
        if machine.mean_of > 1 {
            let _ = write!(page, "{} samples averaged into one.\n\n", machine.mean_of);
        }
        let answer = fs::read_to_string(folder.join("answer.json")).ok();
        let answer = answer.and_then(|text| serde_json::from_str::<Value>(&text).ok());
        match answer.filter(|_| done.status.success()) {
            Some(answer) => {
                let _ = section(&mut page, &answer, seconds);
                let _ = compared(&mut page, &answer, machine.expected);
            }
            None => {
                let _ = writeln!(page, "No answer: {}.", done.status);
            }
        }
    }
    Ok(page)
}

/// Rows of a file as a recording whose time starts at 0, each the mean of `mean_of` rows.
fn cut(data: &Path, (name, file, first, last): &Part, mean_of: usize, folder: &Path) -> io::Result<()> {
    let path = data.join(file);
    let text = fs::read_to_string(&path)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
    let mut lines = text.lines();
    let mut cut = format!("{}\n", lines.next().unwrap_or_default());
    let rows: Vec<Vec<f64>> = lines
        .skip(*first)
        .take(last - first)
        .map(|line| line.split(',').map(|cell| cell.trim().parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let mut origin_s = None;
    for group in rows.chunks_exact(mean_of) {
        let mean = |column: usize| {
            group.iter().filter_map(|row: &Vec<f64>| row.get(column)).sum::<f64>() / mean_of as f64
        };
        let origin_s = *origin_s.get_or_insert(mean(0));
        let _ = write!(cut, "{:.6}", mean(0) - origin_s);
        for column in 1..group.first().map_or(0, Vec::len) {
            let value = mean(column);
            // What was no number is a missing value.
            let _ = if value.is_nan() { write!(cut, ",") } else { write!(cut, ",{value:e}") };
        }
        cut.push('\n');
    }
    fs::write(folder.join(name).with_extension("csv"), cut)
}

fn section(page: &mut String, answer: &Value, seconds: f64) -> std::fmt::Result {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    writeln!(page, "**{}** in {seconds:.0} s. {}\n", text(&answer["verdict"]), text(&answer["sentence"]))?;
    for effect in list(&answer["effects"]) {
        write!(page, "- `{}` at {}:", text(&effect["id"]), text(&effect["location"]))?;
        for (name, estimate) in effect["parameters"].as_object().into_iter().flatten() {
            write!(page, " {}", name.replace('_', " "))?;
            number(page, estimate)?;
        }
        let evidence = &effect["evidence"];
        writeln!(
            page,
            "; held-out gain {:.2} dB, {:.1} standard errors",
            evidence["held_out_gain_db"].as_f64().unwrap_or(f64::NAN),
            evidence["held_out_z"].as_f64().unwrap_or(f64::NAN)
        )?;
    }
    for tie in list(&answer["ties"]) {
        writeln!(page, "- tie: {}", text(&tie["sentence"]))?;
    }
    for change in list(&answer["parameter_changes"]) {
        writeln!(
            page,
            "- `{}`: {:.5} → {:.5} ± {:.1e}",
            text(&change["path"]),
            change["from"].as_f64().unwrap_or(f64::NAN),
            change["to"].as_f64().unwrap_or(f64::NAN),
            change["stderr"].as_f64().unwrap_or(f64::NAN)
        )?;
    }
    for cap in list(&answer["caps"]) {
        writeln!(page, "- note: {}", text(&cap))?;
    }
    page.push_str(
        "\n| recording | role | output | given rms | refitted | extended |\n|---|---|---|---|---|---|\n",
    );
    for fit in list(&answer["fit"]["recordings"]) {
        let rms = |model: &str| fit[model]["rms"].as_f64().map_or("-".to_owned(), |rms| format!("{rms:.3e}"));
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} |",
            text(&fit["recording"]),
            text(&fit["role"]).replace('_', " "),
            text(&fit["output"]),
            rms("given"),
            rms("refitted_linear"),
            rms("extended")
        )?;
    }
    Ok(())
}

/// What was found of what is known, and what else.
fn compared(page: &mut String, answer: &Value, expected: &[&str]) -> std::fmt::Result {
    let named: Vec<&str> = answer["effects"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|effect| effect["id"].as_str())
        .collect();
    let list = |laws: Vec<&str>| if laws.is_empty() { "nothing".to_owned() } else { laws.join(", ") };
    writeln!(
        page,
        "\nKnown and found: {}. **Known and not found: {}.** Named and not known: {}.",
        list(expected.iter().filter(|law| named.contains(law)).copied().collect()),
        list(expected.iter().filter(|law| !named.contains(law)).copied().collect()),
        list(named.iter().filter(|law| !expected.contains(law)).copied().collect()),
    )
}

fn number(page: &mut String, estimate: &Value) -> std::fmt::Result {
    match (estimate["value"].as_f64(), estimate["stderr"].as_f64()) {
        (Some(value), Some(stderr)) => {
            write!(page, " {value:.4} ± {stderr:.1e} {}", estimate["unit"].as_str().unwrap_or_default())
        }
        _ => write!(page, " undetermined"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_file_starts_at_time_zero() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("whole.csv"), "time_s,x_m\n0.0,1\n0.5,2\n1.0,3\n1.5,4\n").unwrap();
        cut(folder.path(), &("part", "whole.csv", 1, 3), 1, folder.path()).unwrap();
        let part = fs::read_to_string(folder.path().join("part.csv")).unwrap();
        assert_eq!(part, "time_s,x_m\n0.000000,2e0\n0.500000,3e0\n");
        cut(folder.path(), &("means", "whole.csv", 0, ALL), 2, folder.path()).unwrap();
        let means = fs::read_to_string(folder.path().join("means.csv")).unwrap();
        assert_eq!(means, "time_s,x_m\n0.000000,1.5e0\n1.000000,3.5e0\n");
    }

    #[test]
    fn what_is_not_there_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = cut(folder.path(), &("part", "gone.csv", 0, ALL), 1, folder.path()).unwrap_err();
        assert!(error.to_string().contains("gone.csv"), "{error}");
    }
}
