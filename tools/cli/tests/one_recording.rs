//! What people who have one recording try: the model that was identified on it, or nearly the right one.

use crate::support;

use support::{accepted, paper_beam};

/// The first half of an upward sweep does not reach the second mode, so a refit on that half leaves it
/// wherever noise has put it.
#[test]
fn a_right_model_lacks_nothing_on_one_noisy_sweep() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let camera = "\n[[sensor]]\ncolumn = \"tip_deflection_m\"\nkind = \"camera\"\nrate_hz = 100.0\nnoise_rms = 20e-6\nseed = 3\n";
    let text = std::fs::read_to_string(paper_beam()).unwrap();
    std::fs::write(path("noisy.toml"), format!("{text}{camera}")).unwrap();
    let sweep = "sweep linear 0.1 8 80s 1mm";
    // Coarse stamps too: the base's position is the input, read where it was recorded.
    for rate_hz in ["200", "500"] {
        let recording = path("sweep.csv");
        let run = ["--command", sweep, "--rate", rate_hz, "--noise", "--out", &recording];
        accepted(&[&["simulate", path("noisy.toml").as_str()], &run[..]].concat());
        let identified = path("identified.toml");
        accepted(&["identify", &recording, "--input", "setpoint_m", "--model-out", &identified]);
        std::fs::write(path("softer.toml"), text.replace("young_Pa = 190e9", "young_Pa = 188e9")).unwrap();
        for model in [identified, path("softer.toml")] {
            let told = accepted(&["diagnose", &model, &recording]);
            assert!(told.starts_with("Nothing is missing"), "{rate_hz} Hz: {told}");
            assert!(told.contains("refitted on the held-out ones too"), "{rate_hz} Hz: {told}");
        }
    }
}
