//! What a table costs the board, before it is there.

use stillbeam_firmware::shaper::{ShaperTable, StageTaps};

/// Instructions of the cascade per tick, taken from the measurements in docs/results/firmware.md, which they meet exactly; a test
/// holds them to it. Blocks, each a stage's beginning or a group, are run four at a time, and up to three that are left one by one.
const FIXED: usize = 11;
/// Per four blocks, and one more where the first of them is a group.
const FOUR: usize = 6;
/// A stage and a group among four.
const AMONG_FOUR: (usize, usize) = (19, 14);
/// Once where blocks are left.
const LEFT: usize = 8;
/// A stage and a group among those left.
const AMONG_LEFT: (usize, usize) = (18, 19);
/// Bytes of a word of memory.
const WORD: usize = 4;
/// The most neighbouring taps of a group.
const GROUP: u32 = 4;

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
        let blocks: Vec<Block> = table.stages().flat_map(blocks).collect();
        let (fours, left) = blocks.as_chunks::<4>();
        let sum = |blocks: &[Block], (stage, group): (usize, usize)| -> usize {
            blocks.iter().map(|block| if *block == Block::Stage { stage } else { group }).sum()
        };
        let in_fours = fours.iter().map(|four| {
            let [first, ..] = four;
            FOUR + usize::from(*first == Block::Group) + sum(four, AMONG_FOUR)
        });
        let in_left = if left.is_empty() { 0 } else { LEFT + sum(left, AMONG_LEFT) };
        let unshaped = blocks.is_empty();
        Self {
            taps: table.stages().map(|stage| stage.taps().len()).sum(),
            groups: blocks.iter().filter(|block| **block == Block::Group).count(),
            ram_bytes: WORD * table.history_samples(),
            instructions: if unshaped { 0 } else { FIXED + in_fours.sum::<usize>() + in_left },
        }
    }
}

/// What the cascade runs through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    /// The beginning of a stage, with its tap without delay.
    Stage,
    /// Other taps.
    Group,
}

fn blocks(stage: StageTaps<'_>) -> Vec<Block> {
    let mut blocks = vec![Block::Stage];
    let mut end = 1;
    for tap in stage.taps() {
        if tap.delay_ticks >= end {
            blocks.push(Block::Group);
            end = tap.delay_ticks + GROUP;
        }
    }
    blocks
}
