//! One file, whole and right or not at all.
//!
//! What comes is hashed while it is written to `NAME.part`; only a file with the right SHA-256 gets its name.
//! A transfer that broke is taken up where it ended.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use sha2::{Digest, Sha256};
use ureq::http::Response;
use ureq::{Agent, Body};

use super::DataError;
use super::catalogue::Original;

/// Patience with a server that says nothing.
const SILENCE: Duration = Duration::from_secs(30);
const CHUNK: usize = 64 * 1024;

/// How a file came to be there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// It was there and is right.
    WasThere,
    /// It was fetched, this many bytes of it now (the rest before a connection broke).
    Fetched(u64),
}

/// A file that is there, and its SHA-256 in hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrived {
    /// How.
    pub arrival: Arrival,
    /// SHA-256 of what is there.
    pub sha256: String,
}

/// A client with time limits, for several files.
pub fn client() -> Agent {
    Agent::config_builder()
        // A status is an answer; it is judged where the answer is used.
        .http_status_as_error(false)
        .timeout_resolve(Some(SILENCE))
        .timeout_connect(Some(SILENCE))
        .timeout_recv_response(Some(SILENCE))
        .timeout_per_read(Some(SILENCE))
        .user_agent(concat!("stillbeam/", env!("CARGO_PKG_VERSION")))
        .build()
        .into()
}

/// Gets an original into a folder that is there. `expected` is its SHA-256 (from the list, or from an earlier
/// time); without one whatever comes is taken.
///
/// # Errors
/// [`DataError`]. After [`DataError::Broken`] `NAME.part` stays for the next time, if its end can be checked
/// then.
pub fn fetch(
    client: &Agent,
    original: &Original,
    expected: Option<&str>,
    folder: &Path,
) -> Result<Arrived, DataError> {
    let file = folder.join(&original.file);
    if file.exists() {
        return already_there(&file, expected);
    }
    let part = folder.join(format!("{}.part", original.file));
    if expected.is_none() {
        // Nobody could tell whether two halves belong together.
        remove(&part)?;
    }
    let mut hash = Sha256::new();
    let kept = rehash(&part, &mut hash)?;
    let response = ask(client, &original.url, kept)?;
    let kept = match (response.status().as_u16(), kept) {
        (206, 1..) => kept,
        // The server sends everything again.
        (200, _) => {
            hash = Sha256::new();
            0
        }
        // What is kept is as long as the file or longer: it can only be all of it, or wrong.
        (416, 1..) => return finish(&part, &file, hash, expected, kept),
        (status, _) => return Err(DataError::Status { url: original.url.clone(), status }),
    };
    let got = receive(response.into_body(), &original.url, &part, kept, &mut hash)?;
    finish(&part, &file, hash, expected, got - kept)
}

/// A file that has its name already is right or left alone.
fn already_there(file: &Path, expected: Option<&str>) -> Result<Arrived, DataError> {
    let mut hash = Sha256::new();
    rehash(file, &mut hash)?;
    let sha256 = hexadecimal(hash);
    match expected {
        Some(expected) if expected != sha256 => {
            Err(DataError::Occupied { file: shown(file), expected: expected.to_owned(), got: sha256 })
        }
        _ => Ok(Arrived { arrival: Arrival::WasThere, sha256 }),
    }
}

/// Asks for the file from byte `kept` on.
fn ask(client: &Agent, url: &str, kept: u64) -> Result<Response<Body>, DataError> {
    let mut request = client.get(url);
    if kept > 0 {
        request = request.header("range", format!("bytes={kept}-"));
    }
    request.call().map_err(|error| DataError::Unreachable { url: url.to_owned(), why: error.to_string() })
}

/// Writes a body behind what is kept; returns how many bytes are there then.
fn receive(body: Body, url: &str, part: &Path, kept: u64, hash: &mut Sha256) -> Result<u64, DataError> {
    let disk = |source| DataError::Disk { file: shown(part), source };
    let opened = match kept {
        0 => File::create(part),
        _ => File::options().append(true).open(part),
    };
    let mut out = opened.map_err(disk)?;
    let announced = body.content_length();
    let mut body = body.into_reader();
    let mut chunk = vec![0; CHUNK];
    let mut got = kept;
    let broken = |got, why: String| DataError::Broken { url: url.to_owned(), got, why };
    loop {
        let read = match body.read(&mut chunk) {
            Ok(0) => break,
            Ok(read) => chunk.get(..read).unwrap_or_default(),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(broken(got, error.to_string())),
        };
        out.write_all(read).map_err(disk)?;
        hash.update(read);
        got += read.len() as u64;
    }
    out.sync_all().map_err(disk)?;
    match announced {
        Some(announced) if got - kept < announced => {
            Err(broken(got, format!("{} bytes were announced", kept + announced)))
        }
        _ => Ok(got),
    }
}

/// Gives a right file its name, and takes a wrong one away.
fn finish(
    part: &Path,
    file: &Path,
    hash: Sha256,
    expected: Option<&str>,
    fetched: u64,
) -> Result<Arrived, DataError> {
    let sha256 = hexadecimal(hash);
    if let Some(expected) = expected.filter(|expected| *expected != sha256) {
        remove(part)?;
        return Err(DataError::WrongHash { file: shown(file), expected: expected.to_owned(), got: sha256 });
    }
    fs::rename(part, file).map_err(|source| DataError::Disk { file: shown(file), source })?;
    Ok(Arrived { arrival: Arrival::Fetched(fetched), sha256 })
}

/// Hashes a file; 0 bytes if it is not there.
fn rehash(path: &Path, hash: &mut Sha256) -> Result<u64, DataError> {
    let disk = |source| DataError::Disk { file: shown(path), source };
    let mut file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        Err(error) => return Err(disk(error)),
    };
    let (mut chunk, mut length) = (vec![0; CHUNK], 0);
    loop {
        match file.read(&mut chunk).map_err(disk)? {
            0 => return Ok(length),
            read => {
                hash.update(chunk.get(..read).unwrap_or_default());
                length += read as u64;
            }
        }
    }
}

fn remove(path: &Path) -> Result<(), DataError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(DataError::Disk { file: shown(path), source: error })
        }
        _ => Ok(()),
    }
}

fn shown(path: &Path) -> String {
    PathBuf::from(path).display().to_string()
}

fn hexadecimal(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
