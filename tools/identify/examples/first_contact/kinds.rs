//! Records without an input, of every kind.

use stillbeam_identify::{OutputOnlyOptions, RecordKind, identify_output_only, recognise};
use stillbeam_recording::Recording;

use crate::synthetic::ambient::ambient;
use crate::synthetic::decays::{Course, LINEAR, close_pair, decay_of};
use crate::synthetic::kinds::{KINDS, record};
use crate::synthetic::{Mode, Noise, ring_down};
use crate::{cell, decay_cell, decay_options, found_cell};

/// Records of every kind in the table of confusions; other ones than the tests draw.
const SEEDS: std::ops::Range<u64> = 5000..5100;

/// All tables.
pub fn section() -> String {
    format!("{}\n{}\n{}", confusions(), decays(), ambient_records())
}

fn confusions() -> String {
    let mut text = format!(
        "## Which kind it is\n\n{} made records of each kind (one to four modes, 0.1 to 10 % noise, offsets, drifts, wild samples), and what they are taken for.\n\n\
| made as | {} |\n|---|{}\n",
        SEEDS.end - SEEDS.start,
        KINDS.map(RecordKind::words).join(" | "),
        "---|".repeat(KINDS.len())
    );
    for kind in KINDS {
        let mut counts = [0; KINDS.len()];
        for seed in SEEDS {
            let Ok(found) = recognise(&record(kind, seed), "tip_m") else { continue };
            counts.iter_mut().zip(KINDS).for_each(|(count, one)| *count += usize::from(one == found.kind));
        }
        text += &format!("| {} | {} |\n", kind.words(), counts.map(|count| count.to_string()).join(" | "));
    }
    text
}

fn decays() -> String {
    let mut text = "## Free decays\n\n| record | truth, Hz / damping ratio | found | what is said |\n|---|---|---|---|\n".to_owned();
    let mut row = |what: &str, recording: &Recording, output: &str, truth: &[Mode]| {
        let said = stillbeam_identify::identify_free_decay(recording, &decay_options(output))
            .map(|found| found.warnings.iter().map(|one| one.message.clone()).collect::<Vec<_>>().join("; "))
            .unwrap_or_default();
        let truth = cell(truth.iter().map(|mode| (mode.frequency_hz, mode.damping_ratio)));
        text += &format!("| {what} | {truth} | {} | {said} |\n", decay_cell(recording, output));
    };
    for share in [0.0075, 0.02, 0.06] {
        let (recording, truth) = close_pair(91, share);
        row(&format!("two modes {} % apart", 100.0 * share), &recording, "tip_deflection_m", &truth);
    }
    let truth = [Mode { frequency_hz: 7.3, damping_ratio: 0.012, participation: 1.0 }];
    let clean = || {
        let mut noise = Noise(17);
        let errors: Vec<f64> = (0..2000).map(|_| 0.005 * noise.normal()).collect();
        ring_down(&truth, 200.0, 2000, 0.3, |k| errors[k])
    };
    let changed = |change: &dyn Fn(&mut Vec<f64>)| {
        let mut recording = clean();
        change(&mut recording.columns[0].samples);
        recording
    };
    row("one wild sample", &changed(&|y| y[1404] += 9.0), "tip_deflection_m", &truth);
    row(
        "a sensor that stops at 2.1 s",
        &changed(&|y| {
            let last = y[420];
            y[420..].fill(last)
        }),
        "tip_deflection_m",
        &truth,
    );
    row(
        "an overdriven sensor",
        &changed(&|y| y.iter_mut().for_each(|y| *y = y.clamp(-0.4, 0.9))),
        "tip_deflection_m",
        &truth,
    );
    let twice = clean();
    let twin = twice.columns[0].samples.clone();
    row("one sensor recorded twice", &twice.with_column("second_m", twin), "tip_deflection_m", &truth);
    for (what, course) in [
        ("linear, one mode", LINEAR),
        ("drag", Course { drag: 2.0, ..LINEAR }),
        ("softening by 3 %", Course { softening: 0.03, ..LINEAR }),
    ] {
        let (recording, frequency_hz) = decay_of(&course, 305);
        let text_of = |found: &stillbeam_identify::IdentifiedModes| found.linearity.statement.clone();
        let said = stillbeam_identify::identify_free_decay(&recording, &decay_options("tip_m"))
            .map_or_else(|refusal| refusal.to_string(), |found| text_of(&found));
        text += &format!(
            "| {what} | {frequency_hz:.4} at rest | {} | {said} |\n",
            decay_cell(&recording, "tip_m")
        );
    }
    text
}

fn ambient_records() -> String {
    let mut text = "## Outputs alone\n\nThree outputs under white noise, 1500 periods of the lowest mode; 1.96 standard errors behind ±.\n\n| truth, Hz / damping ratio | found | ± | largest error of a shape's part |\n|---|---|---|---|\n".to_owned();
    for seed in 700..705 {
        let (recording, truth) = ambient(seed, 1500.0);
        let outputs = recording.columns.iter().map(|column| column.name.clone()).collect();
        let true_modes = cell(truth.iter().map(|mode| (mode.frequency_hz, mode.damping_ratio)));
        match identify_output_only(&recording, &OutputOnlyOptions { outputs, modes: None }) {
            Ok(found) => {
                let errors = cell(
                    found.modes.iter().map(|m| (1.96 * m.frequency_hz.stderr, 1.96 * m.damping_ratio.stderr)),
                );
                let apart = found.shapes.iter().filter_map(|shape| {
                    let mode = truth.iter().min_by(|a, b| {
                        let away = |f: f64| (f / shape.frequency_hz - 1.0).abs();
                        away(a.frequency_hz).total_cmp(&away(b.frequency_hz))
                    })?;
                    let size = |k: &usize| mode.shape[*k].abs();
                    let largest = (0..3).max_by(|a, b| size(a).total_cmp(&size(b)))?;
                    let share = |k: usize| {
                        shape.parts[k].real / shape.parts[largest].real - mode.shape[k] / mode.shape[largest]
                    };
                    Some((0..3).map(|k| share(k).hypot(shape.parts[k].imag)).fold(0.0, f64::max))
                });
                let apart: Vec<String> = apart.map(|one| format!("{one:.3}")).collect();
                text += &format!(
                    "| {true_modes} | {} | {errors} | {} |\n",
                    found_cell(&found),
                    apart.join("<br>")
                );
            }
            Err(refusal) => text += &format!("| {true_modes} | {refusal} | | |\n"),
        }
    }
    text
}
