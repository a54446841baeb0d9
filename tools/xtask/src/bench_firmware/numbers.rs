//! The recorded numbers.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Instructions that the cascade of two modes of ZVDD may take.
pub const CASCADE_GOAL: u32 = 150;
/// Instructions that the whole interrupt of a move through it may take.
pub const INTERRUPT_GOAL: u32 = 500;

/// Cycles of the processor, at 168 MHz, in a tick at 20 kHz.
pub const FASTEST_TICK_CYCLES: u32 = 8400;
/// Cycles that the tick that takes most may take of it: 60 %.
pub const CYCLE_GOAL: u32 = FASTEST_TICK_CYCLES / 10 * 6;

/// What there are goals for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Goals {
    /// Instructions that two modes of ZVDD add to a tick of a move, by the medians.
    pub cascade: u32,
    /// Instructions of that whole tick, by its median.
    pub interrupt: u32,
}

/// All numbers of an image.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Numbers {
    /// Ticks that were counted.
    pub tick: Vec<TickNumbers>,
    /// Sections with interrupts masked, where they were watched.
    pub masked: Option<MaskedNumbers>,
    /// The stack, where it was looked at.
    pub stack: Option<StackNumbers>,
    /// What the image takes.
    pub size: Option<SizeNumbers>,
}

/// Instructions of a whole tick interrupt in one state of the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickNumbers {
    /// How many modes are shaped.
    pub modes: u32,
    /// By which shaper.
    pub shaper: String,
    /// Whether every tick queues a sample.
    pub streams: bool,
    /// The machine's state, as `status` names it.
    pub motion: String,
    /// Samples of history that the table needs, 4 bytes each.
    pub history_samples: u32,
    /// Fewest instructions of a tick.
    pub least: u32,
    /// Their median.
    pub median: u32,
    /// Most instructions of a tick.
    pub most: u32,
    /// Most cycles of a tick, by the model.
    pub cycles: u32,
}

/// Sections with interrupts masked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskedNumbers {
    /// Places in the image that mask interrupts.
    pub places: u32,
    /// Sections that ran while they were watched.
    pub sections: u32,
    /// Instructions of the longest.
    pub longest: u32,
}

/// The stack.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StackNumbers {
    /// The deepest it was, in bytes.
    pub bytes: u32,
    /// What is kept for it, in bytes.
    pub room: u32,
}

/// The image, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SizeNumbers {
    /// Code and constants.
    pub text: u64,
    /// What RAM starts with.
    pub data: u64,
    /// RAM that starts as zero.
    pub bss: u64,
}

impl Numbers {
    /// Reads TOML; `source` serves the error.
    pub fn parse(text: &str, source: &Path) -> Result<Self, Failure> {
        toml::from_str(text)
            .map_err(|error| Failure::File { path: source.to_owned(), reason: error.to_string() })
    }

    /// Writes TOML, with the command that made it on top.
    pub fn to_toml(&self) -> Result<String, Failure> {
        let body = toml::to_string(self)
            .map_err(|error| Failure::File { path: "firmware.toml".into(), reason: error.to_string() })?;
        Ok(format!("# Made by `cargo xtask bench-firmware`.\n\n{body}"))
    }

    /// The tick of a table, by motion and telemetry.
    pub fn find(&self, modes: u32, shaper: &str, motion: &str, streams: bool) -> Option<&TickNumbers> {
        self.tick.iter().find(|tick| {
            (tick.modes, tick.streams) == (modes, streams) && tick.shaper == shaper && tick.motion == motion
        })
    }
}

impl Numbers {
    /// Instructions that the table of `tick` adds to one without, by the medians: the middle one of rest,
    /// moving and sweeping, as far as both were counted. Which block's samples wrap around the memory's end
    /// makes three instructions more or fewer.
    pub fn added_by(&self, tick: &TickNumbers) -> Option<u32> {
        let states = ["rest", "moving", "sweeping"];
        let added = states.into_iter().filter_map(|state| {
            let with = self.find(tick.modes, &tick.shaper, state, false)?.median;
            Some(with.saturating_sub(self.find(0, "off", state, false)?.median))
        });
        let mut added: Vec<u32> = added.collect();
        added.sort_unstable();
        added.get(added.len() / 2).copied()
    }

    /// What there are goals for, where the ticks were counted.
    pub fn goals(&self) -> Option<Goals> {
        let tick = self.find(2, "zvdd", "moving", false)?;
        Some(Goals { cascade: self.added_by(tick)?, interrupt: tick.median })
    }
}

impl TickNumbers {
    /// The state of the machine in words.
    pub fn describe(&self) -> String {
        let Self { modes, shaper, motion, streams, .. } = self;
        format!("{modes} modes of {shaper}, {motion}{}", if *streams { ", a sample every tick" } else { "" })
    }

    /// Whether both were counted in the same state.
    pub fn is_same_case(&self, other: &Self) -> bool {
        (self.modes, self.streams) == (other.modes, other.streams)
            && (&self.shaper, &self.motion) == (&other.shaper, &other.motion)
    }
}
