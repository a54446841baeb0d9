//! Every file of integration tests is part of a test program.
//!
//! Crates link their integration tests once, or twice, from a root that lists the files: one that is not
//! listed would be compiled by nothing.

use std::fs;
use std::path::{Path, PathBuf};

/// The folders of all crates that list their test programs.
fn crates() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folders = ["tools", "host-tests"].map(|folder| fs::read_dir(root.join(folder)).unwrap());
    let below = folders.into_iter().flatten().map(|entry| entry.unwrap().path());
    let lists = |folder: &PathBuf| {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap_or_default();
        manifest.contains("autotests = false")
    };
    below.chain([root.join("host-tests")]).filter(lists).collect()
}

/// The roots of a crate's test programs.
fn programs(folder: &Path) -> Vec<String> {
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    let paths =
        manifest.lines().filter_map(|line| line.strip_prefix("path = \"tests/")?.strip_suffix(".rs\""));
    paths.map(str::to_owned).collect()
}

#[test]
fn every_file_of_integration_tests_is_listed_in_a_program() {
    let crates = crates();
    assert!(crates.len() >= 7, "{crates:?}");
    for folder in crates {
        let programs = programs(&folder);
        let tests = folder.join("tests");
        let listed: String = programs
            .iter()
            .map(|name| fs::read_to_string(tests.join(format!("{name}.rs"))).unwrap())
            .collect();
        for entry in fs::read_dir(&tests).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            if path.extension().is_some_and(|extension| extension == "rs") && !programs.contains(&name) {
                let listed_once = listed.lines().filter(|line| **line == format!("mod {name};")).count() == 1;
                assert!(listed_once, "{}: list it once in {programs:?}", path.display());
            }
        }
    }
}
