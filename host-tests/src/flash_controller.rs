//! The chip's flash controller and the two sectors of the settings (RM0090, 3): keys, programming of words,
//! erasing, and a core that stands still while a sector is erased.

use crate::emulator::clock_cover::{ClockCover, Region};

/// Offsets of its registers.
mod register {
    pub const KEYR: u32 = 0x04;
    pub const SR: u32 = 0x0c;
    pub const CR: u32 = 0x10;
}

const BASE: u32 = 0x4002_3c00;
const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
/// Control: program, erase a sector, its number, the size of a word, start, lock.
const PROGRAM: u32 = 1;
const ERASE_SECTOR: u32 = 1 << 1;
const SECTOR_SHIFT: u32 = 3;
const WORDS_OF_32_BITS: u32 = 0b10 << 8;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
/// Status: programmed although it was not told to.
const SEQUENCE_ERROR: u32 = 1 << 7;

/// The settings' sectors.
pub const SETTINGS: Region = Region { base: 0x080c_0000, length: 2 * SECTOR };
/// Bytes of a sector, of those from the fifth on.
pub const SECTOR: u32 = 128 * 1024;
const FIRST_SECTOR: u32 = 10;

/// What the firmware has made the flash do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// A word was programmed.
    Programmed {
        /// Its address.
        address: u32,
        /// What it holds now: bits go from one to zero only.
        value: u32,
    },
    /// A sector was erased.
    Erased {
        /// Its address.
        address: u32,
    },
}

/// The controller and the sectors.
#[derive(Debug, Clone)]
pub struct FlashController {
    cover: ClockCover,
    control: u32,
    status: u32,
    /// Keys that have come in their order.
    keys: usize,
    memory: Vec<u8>,
    /// What was refused: outside of the sectors, locked, or not as the controller wants it.
    refused: u32,
}

impl FlashController {
    /// A controller as after a reset, over sectors that hold this.
    ///
    /// # Panics
    /// Where it is not as long as both sectors.
    pub fn holding(memory: Vec<u8>) -> Self {
        assert_eq!(memory.len(), SETTINGS.length as usize);
        Self { cover: ClockCover::default(), control: LOCK, status: 0, keys: 0, memory, refused: 0 }
    }

    /// Over blank sectors.
    pub fn blank() -> Self {
        Self::holding(vec![0xff; SETTINGS.length as usize])
    }

    /// What the sectors hold.
    pub fn memory(&self) -> &[u8] {
        &self.memory
    }

    /// How much was refused.
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// Whether the controller is locked.
    pub fn is_locked(&self) -> bool {
        self.control & LOCK != 0
    }

    /// The firmware reads a register of the controller, or one of the clocks.
    pub fn read(&self, address: u32) -> u32 {
        match address.wrapping_sub(BASE) {
            register::SR => self.status,
            register::CR => self.control,
            _ => self.cover.read(address),
        }
    }

    /// The firmware writes a register, or a word into the sectors.
    pub fn write(&mut self, address: u32, value: u32) -> Option<Operation> {
        if SETTINGS.contains(address) {
            return self.program(address, value);
        }
        match address.wrapping_sub(BASE) {
            register::KEYR => self.take_key(value),
            // Flags are cleared by ones.
            register::SR => self.status &= !value,
            register::CR => return self.control(value),
            _ => self.cover.write(address, value),
        }
        None
    }

    fn take_key(&mut self, key: u32) {
        let right = KEYS.get(self.keys) == Some(&key);
        // A wrong one locks until the next reset.
        self.keys = if right { self.keys + 1 } else { KEYS.len() + 1 };
        if self.keys == KEYS.len() {
            self.control &= !LOCK;
        }
    }

    fn control(&mut self, value: u32) -> Option<Operation> {
        if self.is_locked() {
            self.refused += u32::from(value & !LOCK != 0);
            return None;
        }
        self.control = value & !START;
        if self.is_locked() {
            self.keys = 0;
        }
        if value & START == 0 {
            return None;
        }
        let sector = (value >> SECTOR_SHIFT) & 0x1f;
        let offset = sector.wrapping_sub(FIRST_SECTOR).wrapping_mul(SECTOR);
        let address = SETTINGS.base.wrapping_add(offset);
        if value & ERASE_SECTOR == 0 || !SETTINGS.contains(address) {
            self.refused += 1;
            return None;
        }
        let from = (address - SETTINGS.base) as usize;
        self.memory.iter_mut().skip(from).take(SECTOR as usize).for_each(|byte| *byte = 0xff);
        Some(Operation::Erased { address })
    }

    fn program(&mut self, address: u32, value: u32) -> Option<Operation> {
        let at = (address - SETTINGS.base) as usize;
        let told = self.control & (PROGRAM | 0b11 << 8) == PROGRAM | WORDS_OF_32_BITS;
        let place = self.memory.get_mut(at..at + 4).filter(|_| told && address.is_multiple_of(4));
        let Some(place) = place else {
            self.refused += 1;
            self.status |= SEQUENCE_ERROR;
            return None;
        };
        for (byte, new) in place.iter_mut().zip(value.to_le_bytes()) {
            *byte &= new;
        }
        let value = place.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        Some(Operation::Programmed { address, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEYR: u32 = BASE + register::KEYR;
    const SR: u32 = BASE + register::SR;
    const CR: u32 = BASE + register::CR;

    fn unlock(flash: &mut FlashController) {
        for key in KEYS {
            flash.write(KEYR, key);
        }
    }

    #[test]
    fn a_word_is_programmed_by_keys_and_control_alone_and_only_loses_bits() {
        let mut flash = FlashController::blank();
        let address = SETTINGS.base + 8;
        assert_eq!(flash.write(address, 5), None, "locked");
        assert_eq!((flash.refused(), flash.read(SR)), (1, SEQUENCE_ERROR));
        flash.write(SR, SEQUENCE_ERROR);
        assert_eq!(flash.read(SR), 0);
        unlock(&mut flash);
        assert!(!flash.is_locked());
        flash.write(CR, PROGRAM | WORDS_OF_32_BITS);
        assert_eq!(flash.write(address, 0xf0), Some(Operation::Programmed { address, value: 0xf0 }));
        assert_eq!(flash.write(address, 0x3f), Some(Operation::Programmed { address, value: 0x30 }));
        flash.write(CR, LOCK);
        assert_eq!(flash.write(address, 0), None);
        assert_eq!(&flash.memory()[8..12], &[0x30, 0, 0, 0]);
    }

    #[test]
    fn a_sector_of_the_settings_is_erased_and_no_other() {
        let mut flash = FlashController::holding(vec![0; SETTINGS.length as usize]);
        unlock(&mut flash);
        let erase = |sector: u32| ERASE_SECTOR | sector << SECTOR_SHIFT;
        assert_eq!(flash.write(CR, erase(11)), None, "not started");
        let address = SETTINGS.base + SECTOR;
        assert_eq!(flash.write(CR, erase(11) | START), Some(Operation::Erased { address }));
        let (first, second) = flash.memory().split_at(SECTOR as usize);
        assert!(first.iter().all(|byte| *byte == 0) && second.iter().all(|byte| *byte == 0xff));
        assert_eq!(flash.write(CR, erase(9) | START), None);
        assert_eq!(flash.refused(), 1);
    }

    #[test]
    fn a_wrong_key_keeps_it_locked() {
        let mut flash = FlashController::blank();
        flash.write(KEYR, KEYS[1]);
        unlock(&mut flash);
        assert!(flash.is_locked());
    }
}
