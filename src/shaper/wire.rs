//! A table as bytes, the way it is uploaded, stored and summed up in its CRC.
//!
//! 32-bit little-endian words: for each stage the number of taps, then each tap's delay in ticks and its Q30
//! weight.

use heapless::Vec;

use super::MAX_MODES;
use super::stage::Tap;
use super::table::{MAX_TABLE_TAPS, ShaperTable, TapsError};
use crate::units::TickRate;

/// Bytes of a word.
const WORD: usize = 4;

/// The most bytes of a table.
pub const MAX_TABLE_BYTES: usize = WORD * (MAX_MODES + 2 * MAX_TABLE_TAPS);

impl ShaperTable {
    /// Reads the words of [`ShaperTable::words`].
    ///
    /// # Errors
    /// [`TapsError`]: bytes left over or missing, or taps that make no table.
    // Called in several places, none of them in a hurry.
    #[inline(never)]
    pub fn from_bytes(tick_rate: TickRate, bytes: &[u8]) -> Result<Self, TapsError> {
        let mut taps = Vec::<Tap, MAX_TABLE_TAPS>::new();
        let mut lengths = Vec::<usize, MAX_MODES>::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let count = word(&mut rest)?;
            let count = usize::try_from(count).map_err(|_| TapsError::TooManyTaps)?;
            for _ in 0..count {
                let tap = Tap { delay_ticks: word(&mut rest)?, weight: word(&mut rest)?.cast_signed() };
                taps.push(tap).map_err(|_| TapsError::TooManyTaps)?;
            }
            let stages = lengths.len() + 1;
            lengths.push(count).map_err(|_| TapsError::Stages { count: stages })?;
        }
        let mut unread = taps.as_slice();
        let stages = lengths.iter().map(|count| unread.split_off(..*count).unwrap_or_default());
        Self::from_stages(tick_rate, stages)
    }
}

fn word(rest: &mut &[u8]) -> Result<u32, TapsError> {
    let (word, after) = rest.split_first_chunk::<WORD>().ok_or(TapsError::Truncated)?;
    *rest = after;
    Ok(u32::from_le_bytes(*word))
}
