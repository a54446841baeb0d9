//! What a table costs the board, before it is there.

use stillbeam_firmware::shaper::ShaperTable;

/// Instructions of the cascade per tick: fixed, for every stage, for every group of up to four neighbouring taps. Taken from the
/// measurements in docs/results/firmware.md, which they meet exactly; a test holds them to it.
const INSTRUCTIONS: (usize, usize, usize) = (15, 22, 17);
/// Bytes of a word of memory.
const WORD: usize = 4;
/// Taps of a group, and words that it takes; a stage takes as many of its own.
const GROUP: (u32, usize) = (4, 5);
/// Samples that the ring has twice.
const REPEATED: usize = 3;

/// Memory and instructions of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableCost {
    /// Taps of all stages.
    pub taps: usize,
    /// Groups of taps: what is counted in instructions is these.
    pub groups: usize,
    /// Memory of the table and its past samples.
    pub ram_bytes: usize,
    /// Instructions per tick, beyond those without a table.
    pub instructions: usize,
}

impl TableCost {
    /// The cost of a table.
    pub fn of(table: &ShaperTable) -> Self {
        let stages = table.stages().len();
        let ring: usize = table.stages().map(|stage| stage.duration_ticks() as usize + 1).sum();
        let words = table.history_samples();
        let blocks = words.saturating_sub(ring.max(GROUP.0 as usize) + REPEATED) / GROUP.1;
        let groups = blocks.saturating_sub(stages);
        let (fixed, per_stage, per_group) = INSTRUCTIONS;
        Self {
            taps: table.stages().map(|stage| stage.taps().len()).sum(),
            groups,
            ram_bytes: WORD * words,
            instructions: fixed + per_stage * stages + per_group * groups,
        }
    }
}
