//! The seal over all records: written last, it says which records there are and what is in them.
//!
//! A record has a CRC of its own, and the store passes over one that is damaged as if it had never been
//! written. The seal is how that is noticed, and named.
//!
//! | bytes | meaning |
//! |---|---|
//! | 1 | format of what follows: [`super::record::FORMAT`] |
//! | 1 | how many records there are, this one not counted |
//! | 4 | CRC-32 (ISO-HDLC) of the identities and CRC-32 of all of them, in the order of their identities |
//! | 2 each | identity, and the lowest byte of the CRC-32 of the record's bytes after it |

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

use super::{Key, record};

/// The most records that a seal can speak of.
pub const MAX_RECORDS: usize = 80;

/// The bytes of a seal after its id.
pub type SealBytes = Vec<u8, { 6 + 2 * MAX_RECORDS }>;
const _: () = assert!(1 + 6 + 2 * MAX_RECORDS <= record::MAX_BYTES);

/// What the newest records are, each an identity and a CRC-32, in the order of their identities.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Inventory {
    records: Vec<(u8, u32), MAX_RECORDS>,
    /// There were more.
    overflow: bool,
}

impl Inventory {
    /// Takes in the next record; a later one takes the place of an earlier one.
    pub fn note(&mut self, id: u8, bytes: &[u8]) {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes);
        match self.records.binary_search_by_key(&id, |(id, _)| *id) {
            Ok(place) => {
                if let Some(record) = self.records.get_mut(place) {
                    record.1 = crc;
                }
            }
            Err(place) => self.overflow |= self.records.insert(place, (id, crc)).is_err(),
        }
    }

    /// Whether there is no record.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// The seal over these records.
    pub fn seal(&self) -> SealBytes {
        let mut bytes = SealBytes::new();
        // As many as fit by the type's length.
        let _fits = bytes.extend_from_slice(&[record::FORMAT, self.records.len() as u8]).is_ok()
            && bytes.extend_from_slice(&self.checksum().to_le_bytes()).is_ok()
            && self.records.iter().all(|(id, crc)| {
                let [low, ..] = crc.to_le_bytes();
                bytes.extend_from_slice(&[*id, low]).is_ok()
            });
        bytes
    }

    fn checksum(&self) -> u32 {
        let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        for (id, crc) in &self.records {
            digest.update(&[*id]);
            digest.update(&crc.to_le_bytes());
        }
        digest.finalize()
    }

    /// What is not as the seal says; `None` where all is.
    pub fn compare(&self, seal: Option<&[u8]>) -> Option<Damage> {
        let Some(bytes) = seal else {
            return (!self.is_empty()).then(|| Damage { seal: true, ..Damage::default() });
        };
        if bytes == self.seal().as_slice() && !self.overflow {
            return None;
        }
        let mut damage = Damage::default();
        let listed = bytes.get(6..).unwrap_or_default();
        let sealed = || listed.chunks_exact(2).filter_map(|entry| <[u8; 2]>::try_from(entry).ok());
        for [id, low] in sealed() {
            let found = self.records.iter().find(|(known, _)| *known == id);
            if found.is_none_or(|(_, crc)| !crc.to_le_bytes().starts_with(&[low])) {
                damage.name(id);
            }
        }
        for (id, _) in &self.records {
            if !sealed().any(|[sealed, _]| sealed == *id) {
                damage.name(*id);
            }
        }
        damage.seal = damage.records.is_empty();
        Some(damage)
    }
}

/// Which stored records are not to be relied on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    records: Vec<u8, MAX_RECORDS>,
    /// The seal itself is missing or damaged, so that nobody knows.
    seal: bool,
}

impl Damage {
    /// Names a record.
    pub fn name(&mut self, id: u8) {
        if !self.records.contains(&id) {
            // No more than there are.
            let _fits = self.records.push(id);
        }
    }
}

/// The names, with a space between.
impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut space = "";
        if self.seal {
            f.write_str("seal")?;
            space = " ";
        }
        for id in &self.records {
            f.write_str(space)?;
            space = " ";
            match Key::from_id(*id) {
                Some(key) => write!(f, "{key}")?,
                None if *id == record::TABLE => f.write_str("table")?,
                None => write!(f, "record_{id}")?,
            }
        }
        Ok(())
    }
}
