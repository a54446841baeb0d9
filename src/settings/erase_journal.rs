//! Makes an erase whole: one that a power cut interrupted is done again before anything is read.
//!
//! An interrupted erase leaves bits that are neither old nor blank, and a page that looks blank, or like one
//! that holds the newest values, must not be taken for it. So the intention is written down first, in
//! the *other* sector, and crossed out afterwards:
//!
//! ```text
//! sector 0: | page 0 ................... | journal of the erases of sector 1 |
//! sector 1: | page 1 ................... | journal of the erases of sector 0 |
//! ```
//!
//! A journal is a row of slots, blank at first: a sequence number, its complement, and a word that is
//! programmed when the erase is over. Of both journals only the highest number counts, and it is in the
//! sector that is *not* being erased: what is left of an older journal in a half erased sector has lower
//! numbers. A number torn by a power cut does not match its complement, and then the erase had not begun; a
//! torn last word counts, since by then the sector was blank.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// Bytes at the end of each sector for the journal: 32 slots, of which a power cut between two erases of the
/// sector uses at most two. Without a free slot an erase goes ahead without the journal's protection.
pub const JOURNAL_BYTES: usize = 512;

/// The largest page, though a sector may be larger. Moving a full page's values to the other page takes time
/// that grows with the square of its records, 400 at this size.
pub const MAX_PAGE_BYTES: usize = 8192;

/// The journal's word; what the flash writes at once may be shorter.
const WORD: usize = 4;
/// Number, complement, "over", and one to spare.
const SLOT: usize = 4 * WORD;
const BLANK: u32 = u32::MAX;

/// What a slot says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    Blank,
    /// Torn, or not a journal's at all.
    Invalid,
    Erase {
        number: u32,
        over: bool,
    },
}

impl Entry {
    fn new(bytes: [u8; SLOT]) -> Self {
        let (words, _) = bytes.as_chunks::<WORD>();
        let &[number, complement, over, _] = words else { return Self::Invalid };
        let [number, complement, over] = [number, complement, over].map(u32::from_le_bytes);
        match (number, complement, over) {
            (BLANK, BLANK, BLANK) => Self::Blank,
            (number, complement, over) if number == !complement => {
                Self::Erase { number, over: over != BLANK }
            }
            _ => Self::Invalid,
        }
    }
}

/// Two sectors seen as two pages, page *n* starting at *n* × `ERASE_SIZE`.
#[derive(Debug)]
pub struct JournaledFlash<F> {
    flash: F,
}

impl<F: NorFlash> JournaledFlash<F> {
    const SECTOR: u32 = F::ERASE_SIZE as u32;
    /// Bytes per page.
    pub const PAGE: u32 = {
        assert!(WORD.is_multiple_of(F::WRITE_SIZE), "the journal is written in words of four bytes");
        assert!(F::ERASE_SIZE > JOURNAL_BYTES, "a sector holds a page and a journal");
        let room = F::ERASE_SIZE - JOURNAL_BYTES;
        (if room < MAX_PAGE_BYTES { room } else { MAX_PAGE_BYTES }) as u32
    };

    /// Takes a flash of two sectors that starts at its address zero.
    pub const fn new(flash: F) -> Self {
        Self { flash }
    }

    /// The flash.
    pub fn into_inner(self) -> F {
        self.flash
    }

    /// Does again what was interrupted. To be called before the pages are read.
    ///
    /// # Errors
    /// Those of the flash.
    pub async fn finish_erases(&mut self) -> Result<(), F::Error> {
        if let Some((_, false, page, slot)) = self.last_erase().await? {
            self.erase_sector(page).await?;
            self.write_over(slot).await?;
        }
        Ok(())
    }

    async fn erase_page(&mut self, page: u32) -> Result<(), F::Error> {
        let mut free = None;
        for slot in Self::slots(page) {
            if self.entry(slot).await? == Entry::Blank {
                free = Some(slot);
                break;
            }
        }
        let Some(slot) = free else { return self.erase_sector(page).await };
        let number = self.last_erase().await?.map_or(0, |(number, ..)| number.wrapping_add(1));
        self.flash.write(slot, &number.to_le_bytes()).await?;
        self.flash.write(slot + WORD as u32, &(!number).to_le_bytes()).await?;
        self.erase_sector(page).await?;
        self.write_over(slot).await
    }

    /// The erase with the highest number: that, whether it is over, the page and its slot.
    async fn last_erase(&mut self) -> Result<Option<(u32, bool, u32, u32)>, F::Error> {
        let mut last = None;
        for page in 0..2 {
            for slot in Self::slots(page) {
                if let Entry::Erase { number, over } = self.entry(slot).await? {
                    last = last.max(Some((number, over, page, slot)));
                }
            }
        }
        Ok(last)
    }

    async fn write_over(&mut self, slot: u32) -> Result<(), F::Error> {
        self.flash.write(slot + 2 * WORD as u32, &[0; WORD]).await
    }

    async fn erase_sector(&mut self, page: u32) -> Result<(), F::Error> {
        self.flash.erase(page * Self::SECTOR, (page + 1) * Self::SECTOR).await
    }

    /// Where the erases of `page` are written down.
    fn slots(page: u32) -> impl Iterator<Item = u32> {
        let end = (2 - page) * Self::SECTOR;
        (end - JOURNAL_BYTES as u32..end).step_by(SLOT)
    }

    async fn entry(&mut self, slot: u32) -> Result<Entry, F::Error> {
        let mut bytes = [0; SLOT];
        self.flash.read(slot, &mut bytes).await?;
        Ok(Entry::new(bytes))
    }

    fn place(offset: u32) -> u32 {
        offset / Self::PAGE * Self::SECTOR + offset % Self::PAGE
    }
}

impl<F: NorFlash> ErrorType for JournaledFlash<F> {
    type Error = F::Error;
}

/// Reads and writes must not cross from one page into the other, and those of a map never do.
impl<F: NorFlash> ReadNorFlash for JournaledFlash<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.flash.read(Self::place(offset), bytes).await
    }

    fn capacity(&self) -> usize {
        2 * Self::PAGE as usize
    }
}

impl<F: NorFlash> NorFlash for JournaledFlash<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = Self::PAGE as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        for page in from / Self::PAGE..to / Self::PAGE {
            self.erase_page(page).await?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(Self::place(offset), bytes).await
    }
}
