//! Models given as matrices or transfer functions, at the command line.

use crate::support;

use std::fmt::Write as _;

use support::{accepted, refused};

/// A lag under a held force: `simulate` gives the closed form at every sample, also beside steps of the
/// input.
#[test]
fn a_force_that_is_held_is_held_by_simulate() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let model = |hold: &str| {
        format!(
            "schema = 1\nkind = \"state_space\"\nnumerator = [2.0]\ndenominator = [1.0, 4.0]\n\
             [input]\ncolumn = \"force_N\"\nhold = \"{hold}\"\n[[output]]\ncolumn = \"y_m\"\n"
        )
    };
    let (step_s, force) = (0.05_f64, |k: usize| if k % 7 < 3 { 1.0 } else { -0.5 });
    let mut table = "time_s,force_N\n".to_owned();
    (0..200).for_each(|k| writeln!(table, "{},{}", k as f64 * step_s, force(k)).unwrap());
    std::fs::write(path("force.csv"), table).unwrap();
    let (kept, mut y) = ((-4.0 * step_s).exp(), [0.0_f64; 2]);
    let mut expected: [Vec<f64>; 2] = Default::default();
    for k in 0..200 {
        expected[0].push(y[0]);
        expected[1].push(y[1]);
        let (u, slope) = (force(k), (force(k + 1) - force(k)) / step_s);
        // Of a line, the lag follows a quarter of a second behind.
        let steady = |t: f64| 0.5 * (u + slope * (t - 0.25));
        y = [kept * y[0] + 0.5 * (1.0 - kept) * u, kept * (y[1] - steady(0.0)) + steady(step_s)];
    }
    for (hold, expected) in ["zero", "first"].into_iter().zip(expected) {
        std::fs::write(path("lag.toml"), model(hold)).unwrap();
        let [lag, force, out] = ["lag.toml", "force.csv", "out.csv"].map(path);
        accepted(&["simulate", &lag, "--input", &force, "--out", &out]);
        let text = std::fs::read_to_string(&out).unwrap();
        let found = text.lines().skip(1).map(|row| row.rsplit(',').next().unwrap().parse::<f64>().unwrap());
        let off = found.zip(&expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{hold}: {off:e}");
    }
}

#[test]
fn model_prints_modes_real_poles_and_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.toml").to_str().unwrap().to_owned();
    // A sliding base with friction that carries a mode, out of phase.
    let text = "schema = 1\nkind = \"state_space\"\n\
        A = [[0, 1, 0, 0], [0, -0.5, 0, 0], [0, 0, 0, 1], [0, 0, -400, -0.4]]\nB = [0, 1, 0, 1]\n\
        C = [[1, 0, 3, 0.1]]\nD = [[0.002]]\n\
        [input]\ncolumn = \"force_N\"\n[[output]]\ncolumn = \"y_m\"\n";
    std::fs::write(&path, text).unwrap();
    let told = accepted(&["model", &path]);
    for part in ["3.18310", "0.010000", "3.00000", "quarter of a period off: 0.10000", "2.000000", "-2.00000"]
    {
        assert!(told.contains(part), "no {part}: {told}");
    }
    assert!(told.contains("free motion: displacement 0.00000; velocity 2.00000"), "{told}");
    assert!(told.contains("input at once: 0.00200"), "{told}");
    let json: serde_json::Value = serde_json::from_str(&accepted(&["model", &path, "--json", "-"])).unwrap();
    assert!((json["beside"]["real_poles"][0]["time_constant_s"].as_f64().unwrap() - 2.0).abs() < 1e-9);
    std::fs::write(&path, text.replace("-0.4]", "0.4]")).unwrap();
    refused(&["model", &path], &["plant.toml:3: `A`", "grows", "closed loop"]);
}
