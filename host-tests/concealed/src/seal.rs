//! The sealed answer: a commitment published before the tool runs, opened after it has answered.

use std::fmt::Write;
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use thiserror::Error;

use crate::case::Truth;
use crate::case::files::noise_free_texts;
use crate::case::maker::Case;
use crate::random::Random;

/// Name of the commitment in a case's folder.
pub const COMMITMENT: &str = "commitment.txt";
/// The stream of draws that salts come from; no case has this number.
const SALTS: u64 = u64::MAX;

/// A seal that could not be opened.
#[derive(Debug, Error)]
pub enum SealError {
    /// A file could not be read or written.
    #[error("{path}: {source}; run the bench again without --resume")]
    File {
        /// Which.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The truth has numbers that JSON cannot hold.
    #[error("case {number}: a measured number is not finite; this is an error of the bench")]
    NotFinite {
        /// Which case.
        number: usize,
    },
    /// The sealed truth is not what was committed to.
    #[error(
        "{path}: the truth is not the one that was committed to before the tool ran; run the bench again without --resume"
    )]
    Broken {
        /// Which.
        path: String,
    },
}

/// What lies in the sealed file.
#[derive(Debug, Serialize, Deserialize)]
struct Sealed {
    /// 32 bytes in hexadecimal.
    salt: String,
    /// The truth as JSON text, byte by byte what was hashed.
    truth: String,
    /// Noise-free held-out recordings, name and text, hashed after the truth.
    noise_free: Vec<(String, String)>,
}

impl Sealed {
    fn commitment(&self) -> String {
        let mut hash = Sha256::new();
        hash.update(self.salt.as_bytes());
        hash.update(self.truth.as_bytes());
        for (name, text) in &self.noise_free {
            hash.update(name.as_bytes());
            hash.update(text.as_bytes());
        }
        hexadecimal(&hash.finalize())
    }
}

/// Seals a case's truth into `sealed`, writes the commitment into the case's folder, and returns it.
///
/// The commitment is SHA-256 of salt, truth and noise-free recordings. The salt is drawn from the seed, so
/// that whoever makes the cases again gets the same commitments.
///
/// # Errors
/// [`SealError::File`].
pub fn seal(case: &Case, sealed: &Path, folder: &Path) -> Result<String, SealError> {
    let salt: [u8; 32] = Random::new(case.truth.seed ^ case.truth.number as u64, SALTS).bytes();
    let truth = serde_json::to_string_pretty(&case.truth)
        .map_err(|error| file_error(sealed, io::Error::other(error)))?;
    if serde_json::from_str::<Truth>(&truth).is_err() {
        return Err(SealError::NotFinite { number: case.truth.number });
    }
    let sealed_truth = Sealed { salt: hexadecimal(&salt), truth, noise_free: noise_free_texts(case) };
    let commitment = sealed_truth.commitment();
    let text =
        serde_json::to_string(&sealed_truth).map_err(|error| file_error(sealed, io::Error::other(error)))?;
    if let Some(parent) = sealed.parent() {
        fs::create_dir_all(parent).map_err(|source| file_error(parent, source))?;
    }
    fs::write(sealed, text).map_err(|source| file_error(sealed, source))?;
    let published = folder.join(COMMITMENT);
    fs::write(&published, format!("{commitment}\n")).map_err(|source| file_error(&published, source))?;
    Ok(commitment)
}

/// Opens a seal: the truth and the noise-free held-out recordings.
///
/// # Errors
/// [`SealError::Broken`] if the contents are not those of the commitment in the case's folder.
pub fn open(sealed: &Path, folder: &Path) -> Result<(Truth, Vec<(String, String)>), SealError> {
    let read = |path: &Path| fs::read_to_string(path).map_err(|source| file_error(path, source));
    let published = read(&folder.join(COMMITMENT))?;
    let broken = || SealError::Broken { path: sealed.display().to_string() };
    let contents: Sealed = serde_json::from_str(&read(sealed)?).map_err(|_| broken())?;
    if contents.commitment() != published.trim() {
        return Err(broken());
    }
    let truth = serde_json::from_str(&contents.truth).map_err(|_| broken())?;
    Ok((truth, contents.noise_free))
}

/// SHA-256 of bytes in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing into a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn file_error(path: &Path, source: io::Error) -> SealError {
    SealError::File { path: path.display().to_string(), source }
}
