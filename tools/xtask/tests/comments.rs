//! Comments wrap where code does, so that both can be read side by side.

use std::path::{Path, PathBuf};

/// Characters in a line, as in `rustfmt.toml`.
const WIDTH: usize = 110;

/// The source files below a directory, but for what was built and what is hidden.
fn sources(directory: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    let (directories, files): (Vec<PathBuf>, Vec<PathBuf>) = entries.partition(|path| path.is_dir());
    let is_read = |path: &&PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        name != "target" && !name.starts_with('.')
    };
    let is_source = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "rs");
    let below = directories.iter().filter(is_read).flat_map(|path| sources(path));
    below.chain(files.into_iter().filter(is_source)).collect()
}

/// Lines of comments that are too long. A row of a table, an equation, what stands between fences, or a word
/// without a space, cannot be wrapped.
fn too_long(text: &str) -> Vec<usize> {
    let mut is_fenced = false;
    let is_too_long = |line: &str| {
        let comment = line.trim_start();
        let words = comment.trim_start_matches(['/', '!', ' ']);
        is_fenced ^= comment.starts_with("//") && words.starts_with("```");
        let can_wrap = !is_fenced && !words.starts_with(['|', '>']) && words.contains(' ');
        comment.starts_with("//") && can_wrap && line.chars().count() > WIDTH
    };
    let lines = text.lines().map(is_too_long).enumerate();
    lines.filter(|(_, long)| *long).map(|(number, _)| number + 1).collect()
}

#[test]
fn no_comment_is_wider_than_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let sources = sources(&root);
    assert!(sources.len() > 500, "{} files", sources.len());
    let long = sources.iter().flat_map(|path| {
        let lines = too_long(&std::fs::read_to_string(path).unwrap());
        lines.into_iter().map(move |line| format!("{}:{line}", path.display()))
    });
    let long: Vec<String> = long.collect();
    assert!(long.is_empty(), "wrap at {WIDTH} characters:\n{}", long.join("\n"));
}

#[test]
fn a_long_comment_is_seen_and_a_table_is_not() {
    let long = format!("    /// {}", "word ".repeat(22));
    let table = format!("/// | {} |", "word ".repeat(30));
    let address = format!("//! <{}>", "x".repeat(120));
    let lines = [long.as_str(), &table, &address, "/// ```", &long, "/// ```", &long, "let x = 1;"];
    assert_eq!(too_long(&lines.join("\n")), [1, 7]);
}
