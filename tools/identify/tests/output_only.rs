//! Modes from outputs alone.

use crate::synthetic;

use stillbeam_identify::{IdentifiedModes, OutputOnlyOptions, identify_output_only};
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
