//! A table that was designed elsewhere and sent to the board.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

use super::table::{ShaperTable, TapsError};
use super::wire::MAX_TABLE_BYTES;
use crate::units::TickRate;

/// The bytes of a table ([`super::wire`]) and the tick rate it was designed for. Valid by construction.
#[derive(Clone, Debug, PartialEq)]
pub struct UploadedTable {
    tick_rate: TickRate,
    bytes: Vec<u8, MAX_TABLE_BYTES>,
}

impl UploadedTable {
    /// Checks the bytes of a table and keeps them.
    ///
    /// # Errors
    /// [`TapsError`] says what is wrong with them.
    pub fn new(tick_rate: TickRate, bytes: &[u8]) -> Result<Self, TapsError> {
        ShaperTable::from_bytes(tick_rate, bytes)?;
        // A table's bytes are never more.
        let bytes = Vec::from_slice(bytes).map_err(|_| TapsError::TooManyTaps)?;
        Ok(Self { tick_rate, bytes })
    }

    /// The tick rate that the table is for.
    pub fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The table.
    pub fn table(&self) -> ShaperTable {
        // Bytes that make no table were refused by `new`.
        ShaperTable::from_bytes(self.tick_rate, &self.bytes)
            .unwrap_or_else(|_| ShaperTable::identity(self.tick_rate))
    }

    /// The CRC-32 of its bytes, the same as [`ShaperTable::crc32`].
    pub fn crc32(&self) -> u32 {
        crc32(&self.bytes)
    }
}

/// CRC-32 (ISO-HDLC, the one of zip and Ethernet): of tables, of the frames they come in, of lines and
/// samples.
pub fn crc32(bytes: &[u8]) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(bytes)
}
