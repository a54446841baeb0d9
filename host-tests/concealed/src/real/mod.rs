//! Recordings of real machines: what the tool says of them, as a page.
//!
//! The recordings are public and not part of this repository; whoever has them gives the folder.

mod force_balance;
mod machines;
mod table;
mod targets;

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use self::machines::{MACHINES, Machine, Part, make};
use self::targets::{Found, judged};
use crate::run::{ANSWER, EXTENDED};

/// Runs the tool on every real machine whose recordings are in `data` (or on `only` one), in folders below
/// `out`, and writes a page. With `resume` answers that are there are taken as they are.
///
/// # Errors
/// What the system says when a file cannot be read or written or the tool not started; a recording that is
/// not there.
pub fn real(
    tool: &Path,
    data: &Path,
    models: &Path,
    out: &Path,
    only: Option<&str>,
    resume: bool,
) -> io::Result<String> {
    let mut page = String::from(
        "# Recordings of real machines: what `stillbeam diagnose` says\n\n\
         Made by `cargo xtask prove --real DATA --page docs/results/real.md`, DATA a folder with the published recordings as CSV. Nothing below is known to be complete: \
         unlike in the [concealed cases](proof.md), nobody knows the truth. Why targets are missed: [known limits](../known-limits.md#real-machines).\n",
    );
    for machine in MACHINES.iter().filter(|machine| only.is_none_or(|only| only == machine.name)) {
        let folder = out.join(machine.name);
        fs::create_dir_all(&folder)?;
        fs::copy(models.join(machine.model), folder.join("model.toml"))?;
        write_recordings(data, machine, &folder)?;
        let (seconds, failed) = ask(tool, machine, &folder, resume)?;
        // Writing into a string cannot fail.
        let _ = write!(
            page,
            "\n## {}\n\nSource: {}. {}\n\n{}\n\n",
            machine.title, machine.source, machine.known, machine.made
        );
        let answer = fs::read_to_string(folder.join(ANSWER)).ok();
        let answer = answer.and_then(|text| serde_json::from_str::<Value>(&text).ok());
        match answer.filter(|_| failed.is_none()) {
            Some(answer) => {
                let _ = section(&mut page, &answer, seconds);
                let found = Found { tool, data, folder: &folder, machine, answer: &answer };
                let _ = targets(&mut page, machine, &found);
            }
            None => {
                let _ = writeln!(page, "No answer: {}.", failed.unwrap_or_default());
            }
        }
    }
    Ok(page)
}

/// The recordings with their side files.
fn write_recordings(data: &Path, machine: &Machine, folder: &Path) -> io::Result<()> {
    let write = |(name, made): &Part, role: &str| {
        let file = folder.join(name);
        fs::write(file.with_extension("csv"), make(data, made)?.to_csv())?;
        fs::write(file.with_extension("toml"), format!("role = \"{role}\"\n"))
    };
    machine.train.iter().try_for_each(|part| write(part, "train"))?;
    machine.held_out.iter().try_for_each(|part| write(part, "held_out"))
}

/// Runs the tool; how long it took, and how it failed.
fn ask(tool: &Path, machine: &Machine, folder: &Path, resume: bool) -> io::Result<(f64, Option<String>)> {
    let took = folder.join("seconds.txt");
    if resume && folder.join(ANSWER).exists() {
        let seconds = fs::read_to_string(&took).ok().and_then(|text| text.trim().parse().ok());
        return Ok((seconds.unwrap_or(f64::NAN), None));
    }
    for old in [ANSWER, EXTENDED] {
        let _nothing_there = fs::remove_file(folder.join(old));
    }
    let file = |part: &Part| format!("{}.csv", part.0);
    let begun = Instant::now();
    let done = Command::new(tool)
        .current_dir(folder)
        .args(["diagnose", "model.toml"])
        .args(machine.train.iter().map(file))
        .arg("--held-out")
        .args(machine.held_out.iter().map(file))
        .args(["--json", ANSWER, "--extended-model", EXTENDED])
        .output()?;
    let seconds = begun.elapsed().as_secs_f64();
    fs::write(took, format!("{seconds:.1}\n"))?;
    if done.status.success() {
        return Ok((seconds, None));
    }
    let why = String::from_utf8_lossy(&done.stderr).lines().last().unwrap_or_default().to_owned();
    Ok((seconds, Some(format!("{}: {why}", done.status))))
}

/// Targets beside what was reached.
fn targets(page: &mut String, machine: &Machine, found: &Found<'_>) -> std::fmt::Result {
    page.push_str("\n| target | reached | |\n|---|---|---|\n");
    for (words, target) in machine.targets {
        let (reached, number) = judged(found, target);
        writeln!(page, "| {words} | {} | {number} |", if reached { "yes" } else { "**no**" })?;
    }
    Ok(())
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

fn number(page: &mut String, estimate: &Value) -> std::fmt::Result {
    match (estimate["value"].as_f64(), estimate["stderr"].as_f64()) {
        (Some(value), Some(stderr)) => {
            let unit = estimate["unit"].as_str().unwrap_or_default();
            // Four decimals hide a force of a millionth.
            match value.abs() < 0.1 {
                true => write!(page, " {value:.4e} ± {stderr:.1e} {unit}"),
                false => write!(page, " {value:.4} ± {stderr:.1e} {unit}"),
            }
        }
        _ => write!(page, " undetermined"),
    }
}
