//! Where the project's own files are, for the commands that build the firmware.

use std::path::PathBuf;

/// The root of the source tree: the nearest folder above the working directory that holds it, or else the one
/// that this program was built from. `None` when neither is there (an installed binary).
pub fn root() -> Option<PathBuf> {
    let here = std::env::current_dir().ok();
    let above = here.iter().flat_map(|here| here.ancestors()).map(PathBuf::from);
    let built_from = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    above.chain([built_from]).find(|folder| is_root(folder))
}

fn is_root(folder: &std::path::Path) -> bool {
    folder.join("memory.x").is_file() && folder.join("tools/xtask/Cargo.toml").is_file()
}
