//! `SHA256SUMS` in a folder of recordings: what `sha256sum --check` reads, and what the next fetch compares
//! with.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::DataError;

/// Name of the file.
pub const SUMS: &str = "SHA256SUMS";

/// SHA-256 by file name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sums(BTreeMap<String, String>);

impl Sums {
    /// Those of a folder; none if it has no such file. Lines that are none are passed over.
    ///
    /// # Errors
    /// [`DataError::Disk`].
    pub fn read(folder: &Path) -> Result<Self, DataError> {
        let path = folder.join(SUMS);
        match fs::read_to_string(&path) {
            Ok(text) => Ok(Self::parse(&text)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(disk(path, error)),
        }
    }

    fn parse(text: &str) -> Self {
        let line = |line: &str| {
            let (sum, file) = line.split_once("  ")?;
            let is_sum = sum.len() == 64 && sum.chars().all(|c| c.is_ascii_hexdigit());
            is_sum.then(|| (file.to_owned(), sum.to_ascii_lowercase()))
        };
        Self(text.lines().filter_map(line).collect())
    }

    /// The SHA-256 of a file, if it is known.
    pub fn of(&self, file: &str) -> Option<&str> {
        self.0.get(file).map(String::as_str)
    }

    /// Writes down a file's SHA-256, whole or not at all.
    ///
    /// # Errors
    /// [`DataError::Disk`].
    pub fn add(&mut self, folder: &Path, file: &str, sha256: &str) -> Result<(), DataError> {
        if self.of(file) == Some(sha256) {
            return Ok(());
        }
        self.0.insert(file.to_owned(), sha256.to_owned());
        let text: String = self.0.iter().map(|(file, sum)| format!("{sum}  {file}\n")).collect();
        let (new, path) = (folder.join(format!("{SUMS}.part")), folder.join(SUMS));
        fs::write(&new, text).map_err(|error| disk(new.clone(), error))?;
        fs::rename(&new, &path).map_err(|error| disk(path, error))
    }
}

fn disk(path: PathBuf, source: io::Error) -> DataError {
    DataError::Disk { file: path.display().to_string(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_down_is_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let mut sums = Sums::read(folder.path()).unwrap();
        assert_eq!(sums.of("a.csv"), None);
        sums.add(folder.path(), "a.csv", &"0a".repeat(32)).unwrap();
        sums.add(folder.path(), "b.csv", &"1b".repeat(32)).unwrap();
        assert_eq!(Sums::read(folder.path()).unwrap(), sums);
        assert_eq!(Sums::parse("not a sum\n12  short.csv\n"), Sums::default());
    }
}
