//! The first thing that people try: a model on what it simulated itself.

use crate::support;

use support::{accepted, paper_beam};

/// Without noise what is left is the rounding of numbers, and no law may be made of it.
#[test]
fn a_model_lacks_nothing_on_its_own_simulation() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let sweep = "sweep exponential 0.5 8 25s 200mm/s2";
    accepted(&["simulate", &paper_beam(), "--command", sweep, "--rate", "500", "--out", &path("input.csv")]);
    let input = path("input.csv");
    accepted(&["simulate", &paper_beam(), "--input", &input, "--out", &path("truth.csv")]);
    // The same parameters, and others that a refit finds.
    let text = std::fs::read_to_string(paper_beam()).unwrap();
    std::fs::write(path("softer.toml"), text.replace("young_Pa = 190e9", "young_Pa = 188e9")).unwrap();
    for model in [paper_beam(), path("softer.toml")] {
        let told = accepted(&["diagnose", &model, &path("truth.csv")]);
        assert!(told.starts_with("Nothing is missing"), "{told}");
    }
}

/// Two decays of one beam agree to fifteen digits, which is many of the standard errors that rounding leaves.
#[test]
fn decays_and_sweeps_without_noise_agree_and_a_decay_is_as_long_as_it_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let runs = [
        ("far.csv", "decay 20 40"),
        ("near.csv", "decay 10 40"),
        ("slow.csv", "sweep linear 0.5 8 0.2Hz/s 200mm/s2"),
        ("fast.csv", "sweep linear 0.5 8 0.4Hz/s 100mm/s2"),
    ];
    for (file, command) in runs {
        accepted(&["simulate", &paper_beam(), "--command", command, "--rate", "500", "--out", &path(file)]);
    }
    let rows = std::fs::read_to_string(path("far.csv")).unwrap().lines().count();
    assert!(rows > 40 * 500, "{rows}");
    for files in [["far.csv", "near.csv"], ["slow.csv", "fast.csv"]] {
        let [first, second] = files.map(path);
        let json = path("modes.json");
        let mut arguments = vec!["identify", &first, &second, "--json", &json];
        if files[0] == "slow.csv" {
            arguments.extend(["--input", "setpoint_m"]);
        }
        accepted(&arguments);
        let found: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
        assert_eq!(found["modes"].as_array().unwrap().len(), 2, "{}", found["modes"]);
        let told: Vec<&str> =
            found["warnings"].as_array().unwrap().iter().filter_map(|w| w["kind"].as_str()).collect();
        for kind in ["recordings_disagree", "cross_check_disagrees", "clipping"] {
            assert!(!told.contains(&kind), "{files:?}: {}", found["warnings"]);
        }
        assert_ne!(found["linearity"]["verdict"], "not_linear", "{}", found["linearity"]);
    }
}
