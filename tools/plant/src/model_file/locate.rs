//! From a parameter's path to the line it stands on.

use toml::de::{DeTable, DeValue};

/// 1-based line of a byte offset.
pub(super) fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

/// 1-based line of the key at `path` (`beam.width_m`, `mode.1.frequency_hz` with 1-based numbers), or of its
/// nearest table that is there; `None` when not even the first part is.
pub(super) fn line_of_key(text: &str, path: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut offset = None;
    descend(document.get_ref(), path, &mut offset);
    offset.map(|offset| line_at(text, offset))
}

fn descend(table: &DeTable<'_>, path: &str, offset: &mut Option<usize>) {
    // The longest key first: `[fixed]` holds paths, dots included, as keys.
    let ends = path.match_indices('.').map(|(end, _)| end).chain([path.len()]);
    let ends: Vec<usize> = ends.collect();
    for &end in ends.iter().rev() {
        let (key, rest) = path.split_at(end);
        let Some((found, value)) = table.iter().find(|(name, _)| name.get_ref().as_ref() == key) else {
            continue;
        };
        *offset = Some(found.span().start);
        let rest = rest.strip_prefix('.').unwrap_or("");
        match value.get_ref() {
            DeValue::Table(inner) => descend(inner, rest, offset),
            DeValue::Array(items) => {
                let (number, rest) = rest.split_once('.').unwrap_or((rest, ""));
                let index = number.parse::<usize>().ok().and_then(|n| n.checked_sub(1));
                if let Some(item) = index.and_then(|index| items.get(index)) {
                    *offset = Some(item.span().start);
                    if let DeValue::Table(inner) = item.get_ref() {
                        descend(inner, rest, offset);
                    }
                }
            }
            _ => {}
        }
        return;
    }
}
