//! What controllers and analysers leave on the disk: an accelerometer's log of a sweep without its input,
//! responses, power spectra.

use crate::support;

use std::f64::consts::TAU;

use support::{refused, stillbeam};

const MODE_HZ: f64 = 31.0;
const DAMPING: f64 = 0.05;

fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Frequency and damping ratio in the rows of the table of modes.
fn modes(out: &str) -> Vec<[f64; 2]> {
    let row = |line: &str| {
        let cells: Vec<&str> = line.split_whitespace().collect();
        match cells.as_slice() {
            [number, hz, _, ratio, _] if number.parse::<u32>().is_ok() => {
                Some([hz.parse().ok()?, ratio.parse().ok()?])
            }
            _ => None,
        }
    };
    out.lines().filter_map(row).collect()
}

fn is_the_mode(run: &support::Run) {
    let found = modes(&run.out);
    assert_eq!(run.code, 0, "{}", run.messages);
    assert_eq!(found.len(), 1, "{} {}", run.out, run.messages);
    let [hz, ratio] = found[0];
    assert!((hz / MODE_HZ - 1.0).abs() < 0.005 && (ratio / DAMPING - 1.0).abs() < 0.1, "{}", run.out);
}

/// Response of a base-driven mode, as absolute acceleration over that of the base.
fn transmissibility(hz: f64) -> [f64; 2] {
    let r = hz / MODE_HZ;
    let (a, b) = (1.0 - r * r, 2.0 * DAMPING * r);
    let power = a * a + b * b;
    [(a + b * b) / power, (b * a - b) / power]
}

#[test]
fn an_accelerometers_log_of_a_controllers_sweep_gives_the_mode_when_the_sweep_is_stated() {
    // Pulses of acceleration from 10 to 70 Hz at 4 Hz/s, of which the log misses the first second.
    let (rate_hz, fine) = (1600.0, 10);
    let h = 1.0 / (rate_hz * f64::from(fine));
    let (mut q, mut v, w) = (0.0_f64, 0.0_f64, TAU * MODE_HZ);
    let mut half = [0.0, 10.0, 1.0];
    let mut log = "#time,accel_x,accel_y,accel_z\n".to_owned();
    for k in 0..(14.0 / h) as u32 {
        let t = f64::from(k) * h;
        while t >= half[0] + 0.5 / half[1] {
            let next_s = half[0] + 0.5 / half[1];
            half = [next_s, 10.0 + 4.0 * next_s, -half[2]];
        }
        let base = 60.0 * half[1] * half[2] * if t < half[0] + 0.25 / half[1] { 1.0 } else { -1.0 };
        let absolute = -2.0 * DAMPING * w * v - w * w * q;
        if k % fine == 0 && t > 1.0 {
            let hiss = 20.0 * (1e3 * t * t).sin();
            log += &format!(
                "{:.6},{:.1},{:.1},{:.1}\n",
                812.0 + t,
                absolute + hiss,
                0.05 * absolute,
                9800.0 + hiss
            );
        }
        v += h * (absolute - base);
        q += h * v;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = file(&folder, "raw_data_x.csv", &log);
    let run = stillbeam(&["identify", &path, "--sweep", "10,70,4Hz/s"]);
    is_the_mode(&run);
    assert!(run.messages.contains("pulses of acceleration"), "{}", run.messages);
    refused(
        &["identify", &path, "--sweep", "70,10,4Hz/s"],
        &["no answer to a sweep from 70 to 10 Hz", "--sweep"],
    );
    refused(&["identify", &path, "--sweep", "10,70"], &["FROM,TO,RATE_OR_SECONDS"]);
}

#[test]
fn responses_and_power_spectra_are_identified_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let lines = || (1..400).map(|k| 0.25 * f64::from(k));
    let rows: String = lines()
        .map(|hz| {
            let [re, im] = transmissibility(hz);
            format!("{hz},{re},{im}\n")
        })
        .collect();
    let frf = file(&folder, "frf.csv", &format!("frequency [Hz],H real,H imag\n{rows}"));
    let (json, report) = (file(&folder, "modes.json", ""), file(&folder, "modes.html", ""));
    let run = stillbeam(&["identify", &frf, "--json", &json, "--report", &report]);
    is_the_mode(&run);
    assert!(std::fs::read_to_string(&json).unwrap().contains("\"response_fit\""));
    assert!(std::fs::read_to_string(&report).unwrap().contains("Function of frequency"));
    let rows: String = lines()
        .map(|hz| {
            let [re, im] = transmissibility(hz);
            let power = 100.0 * (re * re + im * im);
            format!("{hz:.2},{power:.4e},{:.4e},9e0,{:.4e}\n", 0.1 * power, 1.1 * power + 9.0)
        })
        .collect();
    let psd = file(&folder, "resonances_x.csv", &format!("freq,psd_x,psd_y,psd_z,psd_xyz\n{rows}"));
    let run = stillbeam(&["identify", &psd]);
    is_the_mode(&run);
    assert!(run.messages.contains("upper bounds"), "{}", run.messages);
    refused(&["identify", &psd, "--input", "psd_x"], &["power spectral density", "--input"]);
    refused(&["identify", &psd, "--output", "psd_q"], &["psd_q", "psd_x"]);
}

#[test]
fn axes_end_with_the_shapers_for_each_and_the_one_to_take() {
    let folder = tempfile::tempdir().unwrap();
    let axis = |name: &str, mode_hz: f64| {
        let power = |hz: f64| {
            let [re, im] = transmissibility(hz * MODE_HZ / mode_hz);
            format!("{hz:.2},{:.4e}\n", 100.0 * (re * re + im * im))
        };
        let rows: String = (1..600).map(|k| power(0.25 * f64::from(k))).collect();
        file(&folder, name, &format!("freq,psd_x\n{rows}"))
    };
    let (x, y) = (axis("x.csv", 52.0), axis("y.csv", 38.0));
    let run = stillbeam(&["identify", &x, &y, "--axes"]);
    assert_eq!(run.code, 0, "{}", run.messages);
    let taken: Vec<&str> = run.out.lines().filter(|line| line.starts_with("take ")).collect();
    assert_eq!(taken.len(), 2, "{}", run.out);
    for (line, mode_hz) in taken.iter().zip([52.0, 38.0]) {
        let hz: f64 = line.split(" at ").nth(1).unwrap().split(" Hz").next().unwrap().parse().unwrap();
        assert!((hz / mode_hz - 1.0).abs() < 0.03, "{line}");
    }
    assert!(!run.out.contains("all recordings together"), "{}", run.out);
    refused(&["identify", &x, "--axes", "--left", "0"], &["--left", "above 0"]);
}
