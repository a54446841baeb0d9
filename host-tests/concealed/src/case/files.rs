//! What a lab would have, as files: the model, the recordings, their side files.

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::Role;
use super::maker::{Case, MadeRun};
use super::model_text::model_text;

/// Name of the model file in a case's folder.
pub const MODEL: &str = "model.toml";

/// Writes a case into a folder, which is made.
///
/// # Errors
/// What the system says when a file cannot be written.
pub fn write_case(case: &Case, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(MODEL), model_text(&case.nominal, &case.truth.channels))?;
    for run in &case.runs {
        fs::write(recording(folder, &run.plan.name), recording_text(case, run, &run.recorded))?;
        let role = match run.plan.role {
            Role::Train => "train",
            Role::HeldOut => "held_out",
        };
        fs::write(folder.join(&run.plan.name).with_extension("toml"), format!("role = \"{role}\"\n"))?;
    }
    Ok(())
}

/// Path of a recording.
pub fn recording(folder: &Path, name: &str) -> PathBuf {
    folder.join(name).with_extension("csv")
}

/// The noise-free held-out readings, one text per held-out run: for the seal.
pub fn noise_free_texts(case: &Case) -> Vec<(String, String)> {
    let held_out = case.runs.iter().filter(|run| run.plan.role == Role::HeldOut);
    held_out.map(|run| (run.plan.name.clone(), recording_text(case, run, &run.noise_free))).collect()
}

fn recording_text(case: &Case, run: &MadeRun, readings: &[Vec<f64>]) -> String {
    let mut text = String::from("time_s");
    for (column, _) in &run.inputs {
        text.push(',');
        text.push_str(column);
    }
    for channel in &case.truth.channels {
        text.push(',');
        text.push_str(&channel.column);
    }
    text.push('\n');
    for (k, time_s) in run.time_s.iter().enumerate() {
        // Writing into a string cannot fail.
        let _ = write!(text, "{time_s:.4}");
        for (_, column) in &run.inputs {
            let _ = write!(text, ",{:e}", column[k]);
        }
        for column in readings {
            let _ = write!(text, ",{:.9e}", column[k]);
        }
        text.push('\n');
    }
    text
}
