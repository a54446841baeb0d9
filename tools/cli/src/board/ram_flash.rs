//! Two sectors of flash in this process's memory, forgotten with it.

use std::convert::Infallible;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// Bytes per sector. The board's have 128 KiB, of which 8 KiB are used.
const SECTOR: usize = 16 * 1024;

/// The memory. A map of settings stays within it.
pub struct RamFlash {
    bytes: Vec<u8>,
}

impl RamFlash {
    /// Blank.
    pub fn new() -> Self {
        Self { bytes: vec![0xff; 2 * SECTOR] }
    }
}

impl ErrorType for RamFlash {
    type Error = Infallible;
}

impl ReadNorFlash for RamFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        let stored = self.bytes.iter().skip(offset as usize);
        bytes.iter_mut().zip(stored).for_each(|(byte, stored)| *byte = *stored);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for RamFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        let sectors = self.bytes.iter_mut().take(to as usize).skip(from as usize);
        sectors.for_each(|byte| *byte = 0xff);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        let stored = self.bytes.iter_mut().skip(offset as usize);
        stored.zip(bytes).for_each(|(stored, byte)| *stored &= byte);
        Ok(())
    }
}
