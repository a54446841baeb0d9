//! A flash of two sectors like the board's, whose supply can fail at any operation.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes that the board programs at once.
const WORD: usize = 4;

/// Bytes per sector. The board's have 128 KiB; small ones fill up more often.
pub const SECTOR: usize = 2304;

/// Programming one word and erasing one sector are an operation each.
#[derive(Clone, Debug)]
pub struct MockFlash {
    bytes: Vec<u8>,
    /// Words that were programmed to the end since the last erase.
    programmed: Vec<bool>,
    operations: u64,
    erases: u64,
    written_twice: u64,
    cut: Option<Cut>,
}

/// The supply fails during an operation.
#[derive(Clone, Copy, Debug)]
struct Cut {
    operations_left: u64,
    /// Decides which bits the interrupted operation still changes.
    seed: u64,
}

/// What the flash refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashFault {
    /// The supply has failed; nothing works until [`MockFlash::restore_power`].
    NoPower,
    /// Not whole words, or not whole sectors.
    Unaligned,
    /// Beyond the end.
    OutOfBounds,
}

impl NorFlashError for FlashFault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::NoPower => NorFlashErrorKind::Other,
            Self::Unaligned => NorFlashErrorKind::NotAligned,
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
        }
    }
}

impl MockFlash {
    /// A blank flash.
    pub fn new() -> Self {
        Self::holding(vec![0xff; 2 * SECTOR])
    }

    /// A flash that holds this; words that are not blank count as programmed.
    ///
    /// # Panics
    /// When it is not two sectors.
    pub fn holding(bytes: Vec<u8>) -> Self {
        assert_eq!(bytes.len(), 2 * SECTOR);
        let programmed = bytes.chunks(WORD).map(|word| word != [0xff; WORD]).collect();
        Self { bytes, programmed, operations: 0, erases: 0, written_twice: 0, cut: None }
    }

    /// Everything it holds.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// Operations so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    /// Erases so far.
    pub fn erases(&self) -> u64 {
        self.erases
    }

    /// How often a word was programmed again without an erase. The board's flash then keeps the bits that
    /// both have, and reports nothing.
    pub fn written_twice(&self) -> u64 {
        self.written_twice
    }

    /// Lets the supply fail during the operation after the next `operations`. `seed` decides which bits that
    /// one changes.
    pub fn cut_after(&mut self, operations: u64, seed: u64) {
        self.cut = Some(Cut { operations_left: operations, seed });
    }

    /// Power is back and stays.
    pub fn restore_power(&mut self) {
        self.cut = None;
    }

    /// Whether the supply has failed.
    pub fn is_off(&self) -> bool {
        matches!(self.cut, Some(Cut { operations_left: u64::MAX, .. }))
    }

    /// Counts an operation. `Some` when it is the one during which the supply fails.
    fn operate(&mut self) -> Result<Option<u64>, FlashFault> {
        if self.is_off() {
            return Err(FlashFault::NoPower);
        }
        self.operations += 1;
        match &mut self.cut {
            Some(cut) if cut.operations_left == 0 => {
                cut.operations_left = u64::MAX;
                Ok(Some(cut.seed))
            }
            Some(cut) => {
                cut.operations_left -= 1;
                Ok(None)
            }
            None => Ok(None),
        }
    }

    fn check(&self, from: usize, to: usize, unit: usize) -> Result<(), FlashFault> {
        if to > self.bytes.len() || from > to {
            Err(FlashFault::OutOfBounds)
        } else if !from.is_multiple_of(unit) || !to.is_multiple_of(unit) {
            Err(FlashFault::Unaligned)
        } else {
            Ok(())
        }
    }

    fn program(&mut self, offset: usize, word: &[u8]) -> Result<(), FlashFault> {
        let index = offset / WORD;
        let torn = self.operate()?;
        self.written_twice += u64::from(self.programmed[index]);
        let mut noise = Noise(torn.unwrap_or_default());
        let place = &mut self.bytes[offset..offset + WORD];
        for (byte, wanted) in place.iter_mut().zip(word) {
            // Programming only clears bits; interrupted, it clears some of them.
            *byte &= wanted | torn.map_or(0, |_| noise.byte());
        }
        match torn {
            Some(_) => Err(FlashFault::NoPower),
            None => {
                self.programmed[index] = true;
                Ok(())
            }
        }
    }

    fn erase_sector(&mut self, from: usize) -> Result<(), FlashFault> {
        let torn = self.operate()?;
        let range = from..from + SECTOR;
        let Some(seed) = torn else {
            self.erases += 1;
            self.bytes[range].fill(0xff);
            self.programmed[from / WORD..(from + SECTOR) / WORD].fill(false);
            return Ok(());
        };
        // An erase clears all bits first and then sets them all, each cell at its own pace.
        let mut noise = Noise(seed);
        let stage = noise.byte() % 4;
        for byte in &mut self.bytes[range] {
            let bits = noise.byte();
            match stage {
                0 => *byte &= bits,
                1 => *byte = bits,
                2 => *byte |= bits,
                // Whole words are still old, whole words are blank.
                _ => *byte = if bits & 1 == 0 { *byte } else { 0xff },
            }
        }
        Err(FlashFault::NoPower)
    }
}

impl Default for MockFlash {
    fn default() -> Self {
        Self::new()
    }
}

impl ErrorType for MockFlash {
    type Error = FlashFault;
}

impl ReadNorFlash for MockFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashFault> {
        let (from, to) = (offset as usize, offset as usize + bytes.len());
        self.check(from, to, 1)?;
        if self.is_off() {
            return Err(FlashFault::NoPower);
        }
        bytes.copy_from_slice(&self.bytes[from..to]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for MockFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashFault> {
        self.check(from as usize, to as usize, SECTOR)?;
        (from as usize..to as usize).step_by(SECTOR).try_for_each(|sector| self.erase_sector(sector))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashFault> {
        let from = offset as usize;
        self.check(from, from + bytes.len(), WORD)?;
        let words = bytes.chunks(WORD).enumerate();
        words.into_iter().try_for_each(|(index, word)| self.program(from + index * WORD, word))
    }
}

/// SplitMix64, a byte at a time.
struct Noise(u64);

impl Noise {
    fn byte(&mut self) -> u8 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as u8
    }
}
