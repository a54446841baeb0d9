//! Writes the ambient records that a peer is run on, and what this project finds in them, into a folder.
//! `host-tests/peers/run_output_only` calls it.

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use std::error::Error;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use stillbeam_identify::{Estimate, IdentifiedModes, OutputOnlyOptions, identify_output_only};
use stillbeam_recording::{Recording, write_csv};
use synthetic::ambient::{Truth, ambient};

const RECORDS: u64 = 20;
/// Periods of the lowest mode in a record.
const PERIODS: f64 = 1500.0;
/// A mode is found when its frequency is this close.
const NEAR: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder for the records")?);
    std::fs::create_dir_all(&folder)?;
    let (mut records, mut ghosts, mut held, mut modes) = (Vec::new(), 0, [0, 0], 0);
    for seed in 0..RECORDS {
        let (record, truth) = ambient(seed, PERIODS);
        let all = read(&record, 3)?;
        let one = read(&record, 1)?;
        let is_true = |hz: f64| truth.iter().any(|mode| (hz / mode.frequency_hz - 1.0).abs() < NEAR);
        ghosts += all.modes.iter().chain(&one.modes).filter(|mode| !is_true(mode.frequency_hz.value)).count();
        for mode in &truth {
            let Some(found) = nearest(&all, mode) else { continue };
            modes += 1;
            held[0] += usize::from(holds(&found.frequency_hz, mode.frequency_hz));
            held[1] += usize::from(holds(&found.damping_ratio, mode.damping_ratio));
        }
        records.push(described(&folder, &record, &truth, [&all, &one], seed)?);
    }
    let document = json!({"records": records, "ghosts": ghosts, "held": held, "modes": modes});
    std::fs::write(folder.join("ours.json"), serde_json::to_vec_pretty(&document)?)?;
    Ok(())
}

fn read(record: &Recording, outputs: usize) -> Result<IdentifiedModes, Box<dyn Error>> {
    let outputs = record.columns.iter().take(outputs).map(|column| column.name.clone()).collect();
    Ok(identify_output_only(record, &OutputOnlyOptions { outputs, modes: None })?)
}

fn nearest<'f>(found: &'f IdentifiedModes, truth: &Truth) -> Option<&'f stillbeam_identify::IdentifiedMode> {
    let away = |hz: f64| (hz / truth.frequency_hz - 1.0).abs();
    let near = found.modes.iter().filter(|mode| away(mode.frequency_hz.value) < NEAR);
    near.min_by(|a, b| away(a.frequency_hz.value).total_cmp(&away(b.frequency_hz.value)))
}

fn holds(estimate: &Estimate, truth: f64) -> bool {
    (estimate.value - truth).abs() < 1.96 * estimate.stderr
}

/// Writes a record and says what is true of it and what was found in it.
fn described(
    folder: &Path,
    record: &Recording,
    truth: &[Truth],
    found: [&IdentifiedModes; 2],
    seed: u64,
) -> Result<Value, Box<dyn Error>> {
    let name = format!("ambient_{seed}");
    write_csv(&folder.join(format!("{name}.csv")), record)?;
    let true_modes: Vec<Value> = truth
        .iter()
        .map(|mode| json!({"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio, "shape": mode.shape}))
        .collect();
    let of = |found: &IdentifiedModes| -> Vec<Value> {
        truth
            .iter()
            .map(|mode| {
                nearest(found, mode).map_or(Value::Null, |one| {
                    json!({"frequency_hz": one.frequency_hz.value, "damping_ratio": one.damping_ratio.value})
                })
            })
            .collect()
    };
    Ok(json!({"name": name, "truth": true_modes, "found": {"3": of(found[0]), "1": of(found[1])}}))
}
