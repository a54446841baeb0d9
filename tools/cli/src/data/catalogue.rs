//! The list of recordings: names, homes, licences, SHA-256 of the originals.

use serde::Deserialize;

use super::DataError;

/// The list as a file: everything that is known of the originals, and nothing else.
const SETS: &str = include_str!("sets.toml");

/// Recordings of one machine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// What `stillbeam data fetch` calls it.
    pub name: String,
    /// What was recorded.
    pub title: String,
    /// What to cite.
    pub cite: String,
    /// Under which licence the originals are.
    pub licence: String,
    /// What the files hold.
    pub holds: String,
    /// Files with neighbouring addresses.
    files: Vec<Group>,
}

/// Files whose addresses differ in one word.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    /// Address, `{}` for the name.
    url: String,
    /// File name here, `{}` for the name.
    save_as: String,
    names: Vec<String>,
    /// Beside the names; empty where the originals were never seen.
    #[serde(default)]
    sha256: Vec<String>,
}

/// One file of a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Original {
    /// Where it is.
    pub url: String,
    /// Its name here.
    pub file: String,
    /// SHA-256 in 64 hexadecimal digits; `None` if it is not known.
    pub sha256: Option<String>,
}

impl Set {
    /// Its files, in the order of the list.
    pub fn originals(&self) -> Vec<Original> {
        let of_group = |group: &Group| -> Vec<Original> {
            let fill = |pattern: &str, name: &str| pattern.replacen("{}", name, 1);
            let original = |(number, name): (usize, &String)| Original {
                url: fill(&group.url, name),
                file: fill(&group.save_as, name),
                sha256: group.sha256.get(number).cloned(),
            };
            group.names.iter().enumerate().map(original).collect()
        };
        self.files.iter().flat_map(of_group).collect()
    }
}

#[derive(Deserialize)]
struct Listing {
    set: Vec<Set>,
}

/// All sets.
///
/// # Errors
/// [`DataError::List`] if the list that this program was built with is damaged.
pub fn sets() -> Result<Vec<Set>, DataError> {
    Ok(toml::from_str::<Listing>(SETS).map_err(|error| DataError::List(error.to_string()))?.set)
}

/// The set of that name.
///
/// # Errors
/// [`DataError::NoSuchSet`] lists the names that there are; [`DataError::List`].
pub fn set(name: &str) -> Result<Set, DataError> {
    let sets = sets()?;
    let known = sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>().join(", ");
    sets.into_iter()
        .find(|set| set.name == name)
        .ok_or_else(|| DataError::NoSuchSet { name: name.to_owned(), known })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_file_has_a_home_a_name_of_its_own_and_a_hash_that_can_be_one() {
        let sets = sets().unwrap();
        assert_eq!(sets.iter().map(|set| set.name.clone()).collect::<BTreeSet<_>>().len(), sets.len());
        for set in &sets {
            let originals = set.originals();
            assert!(!set.licence.is_empty() && !set.cite.is_empty() && !originals.is_empty(), "{}", set.name);
            let files: BTreeSet<_> = originals.iter().map(|original| &original.file).collect();
            assert_eq!(files.len(), originals.len(), "{}", set.name);
            for original in &originals {
                assert!(original.url.starts_with("https://") && !original.url.contains("{}"), "{original:?}");
                let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
                assert!(original.file.chars().all(plain) && !original.file.starts_with('.'), "{original:?}");
                if let Some(sha256) = &original.sha256 {
                    let hexadecimal = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
                    assert!(sha256.len() == 64 && sha256.chars().all(hexadecimal), "{original:?}");
                }
            }
            for group in &set.files {
                assert!(group.sha256.is_empty() || group.sha256.len() == group.names.len(), "{group:?}");
            }
        }
    }

    #[test]
    fn a_name_that_is_not_there_is_answered_with_those_that_are() {
        let error = set("emsp").unwrap_err().to_string();
        assert!(error.contains("emsp") && error.contains("emps, silverbox"), "{error}");
        assert_eq!(set("leadscrew_drives").unwrap().originals().len(), 114);
    }
}
