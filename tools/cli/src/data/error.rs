//! Why a recording could not be fetched.

use std::io;

use thiserror::Error;

/// Why a recording could not be fetched. Whatever happened, no file with a wrong content is left under its
/// name.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DataError {
    /// The list of sets cannot be read.
    #[error("the list of recordings: {0}")]
    List(String),
    /// No set has that name.
    #[error("there are no recordings called `{name}`; there are: {known}")]
    NoSuchSet {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// The list has no SHA-256 for a file.
    #[error(
        "the SHA-256 of {file} is not known to this program, so it cannot tell whether what comes from {url} is right. \
         With --trust-first it is taken as it comes, and its SHA-256 is written down in SHA256SUMS for the next time"
    )]
    NotKnown {
        /// The file.
        file: String,
        /// Its home.
        url: String,
    },
    /// The server could not be reached, or said nothing that could be understood.
    #[error(
        "cannot reach {url}: {why}; check the network (and HTTPS_PROXY, if there is a proxy), or name a copy with --from"
    )]
    Unreachable {
        /// Where the file should have been.
        url: String,
        /// What happened.
        why: String,
    },
    /// The server refused.
    #[error("{url}: the server answers {status}{}", status_remedy(*.status))]
    Status {
        /// Where the file should have been.
        url: String,
        /// Status of HTTP.
        status: u16,
    },
    /// The connection ended before the file did.
    #[error(
        "{url}: the connection ended after {got} bytes ({why}); what came is kept, the same command goes on from there"
    )]
    Broken {
        /// Where the file is.
        url: String,
        /// Bytes that are there now.
        got: u64,
        /// What happened.
        why: String,
    },
    /// The file is not the one that the list means.
    #[error(
        "{file} has the SHA-256 {got}, not {expected}: it was damaged on the way or changed at its home; nothing was kept. \
         Try again, and if the same SHA-256 comes again, do not use it"
    )]
    WrongHash {
        /// The file.
        file: String,
        /// What it should have.
        expected: String,
        /// What it has.
        got: String,
    },
    /// A file here that is not the one that the list means.
    #[error(
        "{file} is there already and has the SHA-256 {got}, not {expected}; it was left alone: move it away and try again"
    )]
    Occupied {
        /// The file.
        file: String,
        /// What it should have.
        expected: String,
        /// What it has.
        got: String,
    },
    /// A file could not be written or read.
    #[error("{file}: {source}{}", disk_remedy(.source))]
    Disk {
        /// The file.
        file: String,
        /// Why.
        source: io::Error,
    },
}

fn status_remedy(status: u16) -> &'static str {
    match status {
        404 | 410 => {
            ": the file is no longer there; look for the publication's name, and name a copy with --from"
        }
        403 | 429 => ": too many requests, or not from here; try again later",
        500.. => ": the server has a trouble of its own; try again later",
        _ => "",
    }
}

fn disk_remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; make room and give the same command again, or name another folder with --out"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; name a folder that can be written with --out"
        }
        _ => "",
    }
}
