//! Nobody marks their own homework: the bench and the tools that it tests do not depend on each other.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// Package name to the names of packages of this workspace that it depends on, through any number of steps.
fn reaches() -> BTreeMap<String, BTreeSet<String>> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo that runs this test");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo's metadata");
    let packages = metadata["packages"].as_array().expect("a list of packages");
    let name = |value: &Value| value["name"].as_str().expect("a name").to_owned();
    let names: BTreeSet<String> = packages.iter().map(name).collect();
    let direct: BTreeMap<String, BTreeSet<String>> = packages
        .iter()
        .map(|package| {
            let list = package["dependencies"].as_array().expect("a list of dependencies");
            (name(package), list.iter().map(name).filter(|each| names.contains(each)).collect())
        })
        .collect();
    let mut all = direct.clone();
    loop {
        let mut grown = all.clone();
        for reached in grown.values_mut() {
            let further: BTreeSet<String> =
                reached.iter().flat_map(|each| direct[each].iter().cloned()).collect();
            reached.extend(further);
        }
        if grown == all {
            return all;
        }
        all = grown;
    }
}

#[test]
fn the_bench_depends_on_nothing_of_the_workspace() {
    let reaches = reaches();
    assert!(reaches["stillbeam-concealed"].is_empty(), "{:?}", reaches["stillbeam-concealed"]);
    // The test can fail: the tool does depend on what it is made of.
    assert!(reaches["stillbeam"].contains("stillbeam-diagnose"));
}

#[test]
fn nothing_of_the_workspace_depends_on_the_bench() {
    for (package, reached) in reaches() {
        assert!(!reached.contains("stillbeam-concealed"), "{package} can import the bench");
    }
}
