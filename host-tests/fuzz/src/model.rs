//! Any text as a model file: what is accepted can be written and reads back as the same.

use stillbeam_plant::Model;

pub(crate) fn run(input: &[u8]) {
    let Ok(text) = std::str::from_utf8(input) else { return };
    if let Ok(model) = Model::from_toml("fuzzed", text) {
        let written = model.to_toml().expect("a model that was read can be written");
        let read = Model::from_toml("written", &written).expect("and is read again");
        // As text, in which a number that is none equals itself.
        assert_eq!(format!("{read:?}"), format!("{model:?}"));
    }
}
