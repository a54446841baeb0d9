//! Several free decays: the mean weighted by inverse variances is what one fit of all of them gives.

use crate::support;

use std::f64::consts::TAU;

use serde_json::Value;
use stillbeam_identify::tall::Orthonormal;
use support::accepted;

/// Rows of one decay.
type Decay = Vec<(f64, f64)>;

/// What one common frequency and damping leave of all decays, each with its own amplitude, phase and offset.
fn sum_of_squares(decays: &[Decay], frequency_hz: f64, damping_ratio: f64) -> f64 {
    let omega = TAU * frequency_hz;
    let damped = omega * (1.0 - damping_ratio * damping_ratio).sqrt();
    let one = |decay: &Decay| {
        let column = |wave: fn(f64) -> f64| -> Vec<f64> {
            decay.iter().map(|(t, _)| (-damping_ratio * omega * t).exp() * wave(damped * t)).collect()
        };
        let mut basis = Orthonormal::default();
        basis.push(column(f64::cos));
        basis.push(column(f64::sin));
        basis.push(vec![1.0; decay.len()]);
        let mut left: Vec<f64> = decay.iter().map(|(_, y)| *y).collect();
        basis.remove_from(&mut left);
        left.iter().map(|e| e * e).sum::<f64>()
    };
    decays.iter().map(one).sum()
}

/// The minimum, by parabolas through three points along each parameter in turn.
fn fit_of_all(decays: &[Decay], start: [f64; 2], steps: [f64; 2]) -> [f64; 2] {
    let mut at = start;
    for _ in 0..12 {
        for side in 0..2 {
            let value = |offset: f64| {
                let mut moved = at;
                moved[side] += offset;
                sum_of_squares(decays, moved[0], moved[1])
            };
            let (low, middle, high) = (value(-steps[side]), value(0.0), value(steps[side]));
            at[side] += 0.5 * steps[side] * (low - high) / (low - 2.0 * middle + high);
        }
    }
    at
}

#[test]
fn the_weighted_mean_of_decays_is_the_fit_of_all_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut state = 11_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for (frequency_hz, damping_ratio) in [(1.1, 0.01), (6.9, 0.0059)] {
        // Of different length, loudness and noise.
        let cases = [(20.0, 5e-3, 1e-4), (12.0, 2e-3, 1e-4), (30.0, 8e-3, 3e-4)];
        let mut files = Vec::new();
        for (number, (seconds, amplitude, noise)) in cases.into_iter().enumerate() {
            let mut text = "time_s,tip_deflection_m\n".to_owned();
            for k in 0..(100.0 * seconds) as u32 {
                let t = 0.01 * f64::from(k);
                let (omega, phase) = (TAU * frequency_hz, 0.3 * number as f64);
                let clean = amplitude * (-damping_ratio * omega * t).exp() * (omega * t + phase).cos();
                // Twelve uniform numbers make a normal one.
                let normal: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                text += &format!("{t},{}\n", clean + noise * normal);
            }
            let path = folder.path().join(format!("{frequency_hz}_{number}.csv")).display().to_string();
            std::fs::write(&path, text).unwrap();
            files.push(path);
        }
        let mut arguments = vec!["identify", "--modes", "1", "--json", "-"];
        arguments.extend(files.iter().map(String::as_str));
        let found: Value = serde_json::from_str(&accepted(&arguments)).unwrap();
        // The rows that were fitted, each decay divided by its noise: what the weights stand for.
        let decays: Vec<Decay> = files
            .iter()
            .zip(found["recordings"].as_array().unwrap())
            .zip(cases)
            .map(|((file, alone), (_, _, noise))| {
                let end = |index: usize| alone["window_s"][index].as_f64().unwrap();
                let text = std::fs::read_to_string(file).unwrap();
                let rows = text.lines().skip(1).map(|line| {
                    let (t, y) = line.split_once(',').unwrap();
                    (t.parse::<f64>().unwrap(), y.parse::<f64>().unwrap())
                });
                let inside = rows.filter(|(t, _)| (end(0) - 1e-9..=end(1) + 1e-9).contains(t));
                inside.map(|(t, y)| (t - end(0), y / noise)).collect()
            })
            .collect();
        let mode = &found["modes"][0];
        let mean = |name: &str| [&mode[name]["value"], &mode[name]["stderr"]].map(|v| v.as_f64().unwrap());
        let (hz, zeta) = (mean("frequency_hz"), mean("damping_ratio"));
        let all = fit_of_all(&decays, [hz[0], zeta[0]], [0.1 * hz[1], 0.1 * zeta[1]]);
        for (name, mean, all) in [("frequency", hz, all[0]), ("damping", zeta, all[1])] {
            let apart = (mean[0] - all) / mean[1];
            assert!(
                apart.abs() < 0.25,
                "{name} {frequency_hz}: {mean:?} {all}, {apart} standard errors apart"
            );
        }
    }
}
