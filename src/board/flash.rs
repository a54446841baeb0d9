//! The two sectors of flash that hold the settings.
//!
//! The chip has one bank: while it programs or erases, whatever fetches code from the flash waits, interrupts
//! included. A word takes 16 µs, 100 µs at most; erasing a sector byte by byte, as the driver does, 2 s, 4 s
//! at most (datasheet of the STM32F405, flash memory programming). In that time nothing answers: the analog
//! output and the drive enable hold, ticks are lost without being counted, bytes from the serial line are
//! lost too, and a stop has to be hard-wired to work. That is why the console saves only at rest, and why a
//! sector is erased only when it is full, after some 400 changed settings.
//!
//! Both happen with the flash caches off and emptied, so what is read is what is there.

use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Error, Flash};
use embassy_stm32::peripherals::FLASH;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use super::flash_accelerator;

/// Bytes per sector, given by the chip for sectors 5 to 11.
const SECTOR: usize = 128 * 1024;

/// Sectors 10 and 11, counted from the start of the flash. `memory.x` keeps them free and checks that it
/// means the same.
const START: u32 = 0xc_0000;

/// The region SETTINGS of `memory.x`, starting at its address zero.
pub struct SettingsSectors {
    flash: Flash<'static, Blocking>,
}

impl SettingsSectors {
    /// Takes the flash controller.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self { flash: Flash::new_blocking(flash) }
    }

    // Not inlined, because the store reads and writes in dozens of places.
    #[inline(never)]
    fn read_now(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.flash.blocking_read(inside_slice(offset, bytes)?, bytes)
    }

    #[inline(never)]
    fn erase_now(&mut self, from: u32, to: u32) -> Result<(), Error> {
        let (from, to) = inside(from, to)?;
        flash_accelerator::without(|| self.flash.blocking_erase(from, to))
    }

    #[inline(never)]
    fn write_now(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let at = inside_slice(offset, bytes)?;
        flash_accelerator::without(|| self.flash.blocking_write(at, bytes))
    }
}

/// Nothing outside of the region is ever touched: the rest of the flash is this program.
fn inside(from: u32, to: u32) -> Result<(u32, u32), Error> {
    if from <= to && to as usize <= 2 * SECTOR { Ok((START + from, START + to)) } else { Err(Error::Size) }
}

fn inside_slice(offset: u32, bytes: &[u8]) -> Result<u32, Error> {
    let to = (offset as usize).checked_add(bytes.len()).and_then(|to| u32::try_from(to).ok());
    Ok(inside(offset, to.ok_or(Error::Size)?)?.0)
}

impl ErrorType for SettingsSectors {
    type Error = Error;
}

impl ReadNorFlash for SettingsSectors {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.read_now(offset, bytes)
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SettingsSectors {
    const WRITE_SIZE: usize = embassy_stm32::flash::WRITE_SIZE;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        self.erase_now(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.write_now(offset, bytes)
    }
}
