//! Every relative link in the README and the documentation leads to a file, and every `#anchor` to a heading;
//! every page that a source file mentions is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.canonicalize().expect("the workspace")
}

/// All files below `folder` that end in one of `endings`.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path, endings));
        } else if path.extension().is_some_and(|ending| endings.iter().any(|each| ending == *each)) {
            found.push(path);
        }
    }
    found
}

fn pages() -> Vec<PathBuf> {
    let mut pages = files(&root().join("docs"), &["md"]);
    pages.extend(files(&root().join("host-tests/peers"), &["md"]));
    pages.push(root().join("README.md"));
    pages
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The lines of a page outside its blocks of code.
fn prose(text: &str) -> Vec<&str> {
    let mut code = false;
    text.lines()
        .filter(|line| {
            let fence = line.trim_start().starts_with("```");
            code ^= fence;
            !code && !fence
        })
        .collect()
}

/// A heading's anchor as GitHub makes it: small letters, no punctuation, hyphens for blanks.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    kept.chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text).into_iter().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

/// The targets of `[text](target)` in a page, blocks and pieces of code left out.
fn targets(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(text) {
        let outside: String = line.split('`').step_by(2).collect::<Vec<_>>().join("x");
        for part in outside.split("](").skip(1) {
            if let Some((target, _)) = part.split_once(')') {
                found.push(target.to_owned());
            }
        }
    }
    found
}

/// What is wrong with a link of `page`; nothing for addresses elsewhere.
fn complaint(page: &Path, target: &str) -> Option<String> {
    if target.contains("://") {
        return None;
    }
    let (file, fragment) = target.split_once('#').unwrap_or((target, ""));
    let path = if file.is_empty() { page.to_owned() } else { page.parent()?.join(file) };
    if !path.exists() {
        return Some(format!("{}: no file for ({target})", page.display()));
    }
    let lacks = !fragment.is_empty() && !anchors(&read(&path)).contains(fragment);
    lacks.then(|| format!("{}: no heading for ({target})", page.display()))
}

#[test]
fn links_lead_somewhere() {
    let mut complaints = Vec::new();
    for page in pages() {
        complaints.extend(targets(&read(&page)).iter().filter_map(|target| complaint(&page, target)));
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// `docs/NAME.md` in sources and pages, from the root; what `mentions` finds.
fn mentions(text: &str) -> impl Iterator<Item = String> + '_ {
    text.match_indices("docs/").filter_map(|(start, _)| {
        let rest: String =
            text[start..].chars().take_while(|c| c.is_ascii_alphanumeric() || "/_-.".contains(*c)).collect();
        let ends =
            [".md", ".svg", ".csv"].iter().filter_map(|ending| Some(rest.find(ending)? + ending.len()));
        ends.min().map(|end| rest[..end].to_owned())
    })
}

#[test]
fn pages_that_sources_mention_are_there() {
    let mut sources = pages();
    for folder in ["src", "tools", "host-tests", "models"] {
        sources.extend(files(&root().join(folder), &["rs", "toml", "py"]));
    }
    let mut complaints = BTreeSet::new();
    for source in sources.iter().filter(|source| !source.ends_with(file!())) {
        let text = read(source);
        for page in mentions(&text).filter(|page| !root().join(page).exists()) {
            complaints.insert(format!("{}: {page} is not there", source.display()));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.into_iter().collect::<Vec<_>>().join("\n"));
}

#[test]
fn an_anchor_is_made_as_on_the_page() {
    assert_eq!(anchor(" 2. A board, or the firmware without one"), "2-a-board-or-the-firmware-without-one");
    assert_eq!(targets("see [a](b.md#c) and `[x](y)`\n```\n[d](e)\n```"), ["b.md#c"]);
}
