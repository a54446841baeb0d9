//! What the identification warns of reaches whoever shapes for its modes.

use crate::support;

use support::{accepted, refused, stillbeam};

fn modes_file(folder: &std::path::Path, kind: &str) -> String {
    let path = folder.join(format!("{kind}.json"));
    let text = format!(
        r#"{{"schema_version": 1, "warnings": [{{"message": "mode at 6.9 Hz is doubtful", "kind": "{kind}", "mode_hz": 6.9}}],
        "modes": [
            {{"frequency_hz": {{"value": 1.1, "stderr": 0.001}}, "damping_ratio": {{"value": 0.007, "stderr": 0.0001}}}},
            {{"frequency_hz": {{"value": 6.9, "stderr": 0.001}}, "damping_ratio": {{"value": 0.004, "stderr": 0.0001}}}}]}}"#
    );
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn a_weak_mode_is_heard_of_again_and_a_tone_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let weak = modes_file(folder.path(), "weak_mode");
    let told = stillbeam(&["shape", "--modes-from", &weak]);
    assert!(told.code == 0 && told.messages.contains("6.9 Hz is doubtful"), "{}", told.messages);
    let alone = stillbeam(&["shape", "--modes-from", &weak, "--use", "1"]);
    assert!(alone.code == 0 && !alone.messages.contains("doubtful"), "{}", alone.messages);
    for kind in ["forced_tone", "at_bound"] {
        let file = modes_file(folder.path(), kind);
        refused(&["shape", "--modes-from", &file], &["6.9", "no mode to shape for", "--use"]);
        refused(&["plan", "--distance", "10", "--box", &file], &["6.9", "no mode to shape for"]);
        accepted(&["shape", "--modes-from", &file, "--use", "1"]);
    }
}
