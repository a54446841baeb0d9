//! Every sample of the last minutes, to be saved as a recording.

use std::collections::VecDeque;
use std::sync::Arc;

use stillbeam_firmware::telemetry::Sample;

use crate::board::{Gap, StreamedMotion};

/// Samples of a block, which is shared, not copied, when a recording is saved.
const BLOCK: usize = 4096;

/// Blocks that are kept: ten minutes at 4 kHz, some 70 MB. Older ones make room.
const MOST_BLOCKS: usize = 586;

/// Faults that are kept.
const MOST_FAULTS: usize = 100;

/// The samples that are kept.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    full: VecDeque<Arc<[Sample]>>,
    open: Vec<Sample>,
    damaged_frames: u64,
    faults: Vec<String>,
}

impl Kept {
    /// Takes samples as they come.
    pub fn extend(&mut self, samples: &[Sample]) {
        for sample in samples {
            self.open.push(*sample);
            if self.open.len() < BLOCK {
                continue;
            }
            self.full.push_back(std::mem::replace(&mut self.open, Vec::with_capacity(BLOCK)).into());
            if self.full.len() > MOST_BLOCKS {
                self.full.pop_front();
            }
        }
    }

    /// Takes what the line and the board have reported meanwhile.
    pub fn note(&mut self, damaged_frames: u64, faults: &[String]) {
        self.damaged_frames += damaged_frames;
        let room = MOST_FAULTS.saturating_sub(self.faults.len());
        self.faults.extend(faults.iter().take(room).cloned());
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.full.len() * BLOCK + self.open.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The samples from a tick on that lies at most half the range of ticks back.
    pub fn since(&self, tick: u32) -> Vec<Sample> {
        let is_since = |sample: &Sample| sample.tick.wrapping_sub(tick) <= u32::MAX / 2;
        let is_before = |block: &Arc<[Sample]>| block.last().is_none_or(|last| !is_since(last));
        let blocks = self.full.iter().skip_while(|block| is_before(block)).flat_map(|block| block.iter());
        blocks.chain(&self.open).copied().filter(is_since).collect()
    }

    /// All of it as what a motion streams.
    pub fn streamed(&self, tick_hz: f64, decimation: u32) -> StreamedMotion {
        let blocks = self.full.iter().flat_map(|block| block.iter());
        let samples: Vec<Sample> = blocks.chain(&self.open).copied().collect();
        let gaps = samples
            .iter()
            .zip(samples.iter().skip(1))
            .filter_map(|(before, after)| {
                let lost = lost_between(before.sequence, after.sequence);
                (lost != 0).then_some(Gap { lost, tick: after.tick })
            })
            .collect();
        let (damaged_frames, faults) = (self.damaged_frames, self.faults.clone());
        StreamedMotion {
            tick_hz,
            decimation,
            samples,
            gaps,
            damaged_frames,
            faults,
            start: 0,
            command_ticks: 0,
            settled_ticks: 0,
        }
    }
}

/// Samples that are missing between two sequence numbers.
pub fn lost_between(before: u32, after: u32) -> u32 {
    after.wrapping_sub(before).wrapping_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(sequences: std::ops::Range<u32>) -> Vec<Sample> {
        sequences.map(|sequence| Sample { sequence, tick: 7 + sequence, ..Sample::default() }).collect()
    }

    #[test]
    fn what_is_kept_is_all_there_in_order_with_its_gaps() {
        let mut kept = Kept::default();
        kept.extend(&samples(0..10_000));
        kept.extend(&samples(10_003..10_010));
        let streamed = kept.streamed(4000.0, 1);
        assert_eq!((streamed.samples.len(), kept.len()), (10_007, 10_007));
        assert_eq!(streamed.gaps, [Gap { lost: 3, tick: 10_010 }]);
        let since: Vec<u32> = kept.since(10_006).iter().map(|sample| sample.tick).collect();
        assert_eq!(since[..3], [10_006, 10_010, 10_011]);
        assert_eq!(streamed.samples.last().map(|sample| sample.sequence), Some(10_009));
    }

    #[test]
    fn the_oldest_make_room() {
        let mut kept = Kept::default();
        for block in 0..MOST_BLOCKS as u32 + 3 {
            kept.extend(&samples(block * BLOCK as u32..(block + 1) * BLOCK as u32));
        }
        assert_eq!(kept.len(), MOST_BLOCKS * BLOCK);
        assert_eq!(
            kept.streamed(1.0, 1).samples.first().map(|sample| sample.sequence),
            Some(3 * BLOCK as u32)
        );
    }
}
