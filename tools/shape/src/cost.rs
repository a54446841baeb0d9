//! What a table costs the board, before it is there.

use stillbeam_firmware::shaper::blocks::{Taps, blocks_of};
use stillbeam_firmware::shaper::{ShaperTable, StageTaps};

/// Instructions of the cascade per tick, taken from the measurements in docs/results/firmware.md; a test
/// holds them to it.
///
/// The blocks of a table (`src/shaper/cascade.rs`) are run four at a time, and up to three that are left one
/// by one. A table with pairs has a loop of its own.
struct Loop {
    /// Per four, by its first block.
    first_of_four: Costs,
    among_four: Costs,
    /// Beside that, for a group that follows a stage's beginning among four.
    group_behind_stage: usize,
    /// Once where blocks are left.
    left: usize,
    among_left: Costs,
    /// Less than that, for the stage that the table begins with.
    first_of_left: usize,
}

/// Instructions of each kind of block.
struct Costs {
    stage: usize,
    group: usize,
    pair: usize,
}

/// Around the loop.
const FIXED: usize = 11;
/// The loop of tables without pairs.
const GROUPS_ALONE: Loop = Loop {
    first_of_four: Costs { stage: 6, group: 7, pair: 0 },
    among_four: Costs { stage: 19, group: 14, pair: 0 },
    group_behind_stage: 0,
    left: 8,
    among_left: Costs { stage: 23, group: 19, pair: 0 },
    first_of_left: 5,
};
/// The loop of tables with pairs.
const WITH_PAIRS: Loop = Loop {
    first_of_four: Costs { stage: 6, group: 7, pair: 8 },
    among_four: Costs { stage: 21, group: 14, pair: 19 },
    group_behind_stage: 5,
    left: 7,
    among_left: Costs { stage: 25, group: 19, pair: 26 },
    first_of_left: 6,
};
/// Bytes of a word of memory.
const WORD: usize = 4;
/// Memory and instructions of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableCost {
    /// Taps of all stages.
    pub taps: usize,
    /// Groups of taps that are looked at together: what is counted in instructions is these.
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
        Self {
            taps: table.stages().map(|stage| stage.taps().len()).sum(),
            groups: blocks.iter().filter(|block| **block != Block::Stage).count(),
            ram_bytes: WORD * table.history_samples(),
            instructions: instructions(&blocks),
        }
    }
}

fn instructions(blocks: &[Block]) -> usize {
    if blocks.is_empty() {
        return 0;
    }
    let costs = if blocks.contains(&Block::Pair) { WITH_PAIRS } else { GROUPS_ALONE };
    let (fours, left) = blocks.as_chunks::<4>();
    let in_four = |four: &[Block; 4]| {
        let [first, ..] = four;
        let behind = four.windows(2).filter(|two| **two == [Block::Stage, Block::Group]).count();
        costs.first_of_four.of(*first) + costs.among_four.sum(four) + behind * costs.group_behind_stage
    };
    let in_left = if left.is_empty() { 0 } else { costs.left + costs.among_left.sum(left) };
    let in_left = if fours.is_empty() { in_left - costs.first_of_left } else { in_left };
    FIXED + fours.iter().map(in_four).sum::<usize>() + in_left
}

impl Costs {
    fn of(&self, block: Block) -> usize {
        match block {
            Block::Stage => self.stage,
            Block::Group => self.group,
            Block::Pair => self.pair,
        }
    }

    fn sum(&self, blocks: &[Block]) -> usize {
        blocks.iter().map(|block| self.of(*block)).sum()
    }
}

/// What the cascade runs through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    /// The beginning of a stage, with its tap without delay.
    Stage,
    /// Taps on neighbouring ticks.
    Group,
    /// Two taps without neighbours.
    Pair,
}

fn blocks(stage: StageTaps<'_>) -> impl Iterator<Item = Block> {
    let taps = blocks_of(stage).map(|taps| match taps {
        Taps::Group { .. } => Block::Group,
        Taps::Pair(_) => Block::Pair,
    });
    std::iter::once(Block::Stage).chain(taps)
}
