//! Modes from outputs alone.

use crate::synthetic;

use stillbeam_identify::{IdentifiedModes, OutputOnlyOptions, WarningKind, identify_output_only};
use stillbeam_recording::Recording;
use synthetic::ambient::ambient;

fn read(record: &Recording, outputs: usize) -> IdentifiedModes {
    let outputs = (0..outputs).map(|index| format!("acc{index}_m_s2")).collect();
    identify_output_only(record, &OutputOnlyOptions { outputs, modes: None }).unwrap()
}

#[test]
fn modes_shapes_and_intervals_come_from_outputs_alone() {
    let seeds = 40;
    let (mut all, mut ghosts, mut modes, mut held) = (0, 0, 0, [0, 0]);
    let mut worst_shape = 0.0_f64;
    for seed in 0..seeds {
        let (record, truth) = ambient(seed, 1500.0);
        let found = read(&record, 3);
        ghosts += found.modes.len().saturating_sub(truth.len());
        let mut seen = 0;
        for mode in &truth {
            let near = |f: f64| (f / mode.frequency_hz - 1.0).abs() < 0.02;
            let Some(at) = found.modes.iter().position(|one| near(one.frequency_hz.value)) else {
                println!("{seed}: no {} Hz, {}", mode.frequency_hz, mode.damping_ratio);
                continue;
            };
            seen += 1;
            modes += 1;
            let one = &found.modes[at];
            let holds = |value: f64, stderr: f64, truth: f64| (value - truth).abs() < 1.96 * stderr;
            held[0] += usize::from(holds(one.frequency_hz.value, one.frequency_hz.stderr, mode.frequency_hz));
            held[1] +=
                usize::from(holds(one.damping_ratio.value, one.damping_ratio.stderr, mode.damping_ratio));
            // Both with the truth's largest part as 1: of parts alike in size either may be the larger one.
            let size = |k: &usize| mode.shape[*k].abs();
            let largest = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
            let parts = &found.shapes[at].parts;
            let apart = (0..3)
                .map(|k| {
                    let share = parts[k].real / parts[largest].real;
                    (share - mode.shape[k] / mode.shape[largest]).hypot(parts[k].imag)
                })
                .fold(0.0, f64::max);
            worst_shape = worst_shape.max(apart);
        }
        all += usize::from(seen == truth.len());
    }
    println!(
        "{all} of {seeds} records whole, {ghosts} ghosts, of {modes} modes the interval holds {held:?}, worst shape {worst_shape:.3}"
    );
    assert!(all >= 39 && ghosts <= 1 && worst_shape < 0.1, "{all} {ghosts}");
    for held in held {
        assert!((0.88..=0.99).contains(&(held as f64 / modes as f64)), "{held} of {modes}");
    }
}

#[test]
fn one_output_is_enough_for_frequencies() {
    let (mut right, seeds) = (0, 20);
    for seed in 100..100 + seeds {
        let (record, truth) = ambient(seed, 1500.0);
        let found = read(&record, 1);
        assert!(found.shapes.is_empty());
        let heard = truth.iter().filter(|mode| mode.shape[0].abs() > 0.2);
        let near = |f: f64, truth: f64| (f / truth - 1.0).abs() < 0.02;
        right += usize::from(
            heard
                .clone()
                .all(|mode| found.modes.iter().any(|one| near(one.frequency_hz.value, mode.frequency_hz))),
        );
    }
    println!("{right} of {seeds}");
    assert!(right >= 17, "{right} of {seeds}");
}

/// Every loud mode of a single output is found, or its peak is named; what is found is one.
#[test]
fn no_loud_mode_of_one_output_is_passed_over_in_silence() {
    let (mut found_right, mut named, mut silent, mut ghosts) = (0, 0, 0, 0);
    for seed in 200..224 {
        // From records of a few minutes of a bridge down to ones that hardly know their damping.
        let (record, truth) = ambient(seed, [150.0, 400.0, 900.0][seed as usize % 3]);
        let outputs = vec!["acc0_m_s2".to_owned()];
        let Ok(found) = identify_output_only(&record, &OutputOnlyOptions { outputs, modes: None }) else {
            continue;
        };
        let near = |f: f64, truth: f64| (f / truth - 1.0).abs() < 0.03;
        let named_at: Vec<f64> = found
            .warnings
            .iter()
            .filter_map(|warning| match warning.kind {
                WarningKind::PeakWithoutMode { frequency_hz, .. } => Some(frequency_hz),
                _ => None,
            })
            .collect();
        let power: f64 = truth.iter().map(|mode| mode.shape[0].powi(2)).sum();
        for mode in truth.iter().filter(|mode| mode.shape[0].powi(2) > 0.1 * power) {
            let is_found = found.modes.iter().any(|one| near(one.frequency_hz.value, mode.frequency_hz));
            let is_named = named_at.iter().any(|hz| near(*hz, mode.frequency_hz));
            found_right += usize::from(is_found);
            named += usize::from(!is_found && is_named);
            silent += usize::from(!is_found && !is_named);
        }
        let is_mode = |hz: f64| truth.iter().any(|mode| near(hz, mode.frequency_hz));
        ghosts += found.modes.iter().filter(|mode| !is_mode(mode.frequency_hz.value)).count();
    }
    println!("{found_right} found, {named} named, {silent} passed over, {ghosts} ghosts");
    assert!(silent <= 1 && ghosts <= 1, "{silent} {ghosts}");
    assert!(found_right >= 9 * (found_right + named + silent) / 10, "{found_right} {named} {silent}");
}
