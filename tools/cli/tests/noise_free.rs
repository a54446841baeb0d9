//! The first thing that people try: a model on what it simulated itself.

mod support;

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
