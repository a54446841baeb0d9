//! Writes the records that the peers are run on, and what this project's methods find in them, into a folder.
//! `host-tests/peers/run` calls it.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use serde_json::{Value, json};
use stillbeam_host_tests::identification_records::{BEAM, CASES, TrueMode};
use stillbeam_identify::frf::UniformRecord;
use stillbeam_identify::poles::{MethodMode, PoleMethod, survey_forced};
use stillbeam_identify::{ForcedOptions, identify_forced};
use stillbeam_recording::{Recording, write_csv};

const SEEDS: u64 = 5;
const FIT: &str = "stillbeam: fit of the record";
const METHODS: [(PoleMethod, &str); 5] = [
    (PoleMethod::LocalRational, "stillbeam: local rational pole"),
    (PoleMethod::ComplexFrequencyLocal, "stillbeam: LSCF on the local rational response"),
    (PoleMethod::ComplexFrequency, "stillbeam: LSCF on H1, Hamming"),
    (PoleMethod::ComplexExponential, "stillbeam: LSCE on H1, Hamming"),
    (PoleMethod::PeakPicking, "stillbeam: peak picking on averaged H1"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder for the records")?);
    std::fs::create_dir_all(&folder)?;
    let mut found: BTreeMap<&str, BTreeMap<&str, Vec<Value>>> = BTreeMap::new();
    let mut seconds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut cases = Vec::new();
    for case in CASES {
        let mut names = Vec::new();
        for seed in 1..=SEEDS {
            let name = format!("{}_{seed}", case.name);
            let record = case.record(&BEAM, seed);
            let recording = Recording::new(name.clone(), record.time_s)
                .with_column("base_position_m", record.base_position_m)
                .with_column("tip_deflection_m", record.tip_deflection_m);
            write_csv(&folder.join(format!("{name}.csv")), &recording)?;
            names.push(name);

            let mut keep = |label, modes: Vec<Value>| {
                found.entry(label).or_default().entry(case.name).or_default().push(modes.into());
            };
            let begun = Instant::now();
            let options = ForcedOptions::new("base_position_m", "tip_deflection_m").with_modes(2);
            let fitted = identify_forced(&recording, &options);
            seconds.entry(FIT).or_default().push(begun.elapsed().as_secs_f64());
            let fitted = fitted.map(|result| result.modes).unwrap_or_default();
            keep(
                FIT,
                (0..BEAM.len())
                    .map(|index| {
                        fitted.get(index).map_or(Value::Null, |mode| {
                json!({"frequency_hz": mode.frequency_hz.value, "damping_ratio": mode.damping_ratio.value})
            })
                    })
                    .collect(),
            );
            let begun = Instant::now();
            let uniform = UniformRecord::from_recording(&recording, "base_position_m", "tip_deflection_m")?;
            let survey = survey_forced(&uniform, None);
            seconds
                .entry("stillbeam: all the others together")
                .or_default()
                .push(begun.elapsed().as_secs_f64());
            for (method, label) in METHODS {
                keep(label, BEAM.iter().map(|truth| nearest(&survey.modes, method, truth)).collect());
            }
        }
        cases.push(json!({"name": case.name, "title": case.title, "records": names}));
    }
    let truth: Vec<Value> = BEAM
        .iter()
        .map(|mode| json!({"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio}))
        .collect();
    let labels: Vec<&str> = std::iter::once(FIT).chain(METHODS.map(|(_, label)| label)).collect();
    let build = if cfg!(debug_assertions) { "with its run-time checks on" } else { "as released" };
    let document = json!({"build": build, "labels": labels, "truth": truth, "cases": cases, "found": found, "seconds": seconds, "fit": FIT});
    std::fs::write(folder.join("ours.json"), serde_json::to_vec_pretty(&document)?)?;
    Ok(())
}

/// The method's mode nearest to the truth, within a tenth of its frequency.
fn nearest(modes: &[MethodMode], method: PoleMethod, truth: &TrueMode) -> Value {
    let away = |mode: &&MethodMode| (mode.frequency_hz / truth.frequency_hz - 1.0).abs();
    let near = modes.iter().filter(|mode| mode.method == method && away(mode) < 0.1);
    near.min_by(|a, b| away(a).total_cmp(&away(b))).map_or(
        Value::Null,
        |mode| json!({"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio}),
    )
}
