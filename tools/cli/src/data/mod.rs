//! Public recordings of real machines: where their originals are, and how they are fetched and checked.
//!
//! The recordings themselves are not part of this project; [`catalogue`] knows their public homes,
//! [`download`] gets one file whole and right or not at all, [`sums`] remembers the SHA-256 of files whose
//! originals nobody had seen before.

pub mod catalogue;
pub mod download;
mod error;
pub mod sums;

pub use error::DataError;
