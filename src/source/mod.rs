//! Where the command comes from: moves that the board plans itself, or the pulses of a controller that was
//! there before.
//!
//! ```text
//! counter ─▶ counts ─▶ gearing ─▶ average ─▶ command ─▶ shaping ─▶ limits ─▶ setpoint
//! ```
//!
//! A counter in hardware counts the pulses; the tick reads it, and what has come since the tick before is the
//! command of this tick. All of it is whole numbers: the command is the counts since the drive was enabled
//! times the gearing, to the last nanometre, however long it runs. While the drive is off pulses are counted
//! and move nothing.

mod average;
mod gearing;
mod limits;

pub use average::Average;
pub use gearing::{Geared, Gearing};
pub use limits::SetpointLimits;

use crate::motion::FinePosition;
use crate::units::{MAX_TRAVEL_MM, Nanometres};

/// Where the command comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SourceKind {
    /// What is said on the console.
    #[default]
    Moves = 0,
    /// Step and direction of another controller.
    StepDir = 1,
    /// A and B of another controller, or of a handwheel.
    Quadrature = 2,
}

impl SourceKind {
    /// Every kind, in the order of [`Self::WORDS`].
    pub const ALL: [Self; 3] = [Self::Moves, Self::StepDir, Self::Quadrature];

    /// Their words on the console; the place of a word is its number in the flash.
    pub const WORDS: [&'static str; 3] = ["moves", "step_dir", "quadrature"];

    /// The word on the console.
    pub fn name(self) -> &'static str {
        Self::WORDS.get(self as usize).copied().unwrap_or_default()
    }

    /// Bits of the hardware's counter below one count. A pulse with a direction is four edges to the counter
    /// ([`crate::source`] counts steps), in quadrature each edge counts.
    fn edge_bits(self) -> u32 {
        if self == Self::StepDir { 2 } else { 0 }
    }

    /// What the counter is taken to be ahead by in the beginning, in edges. With step and direction a change
    /// of the direction alone is an edge, one way and back; half a step's worth keeps both levels on the same
    /// step, whichever it begins at.
    fn first_edges(self) -> i32 {
        if self == Self::StepDir { 1 } else { 0 }
    }
}

/// What the settings make of a source of pulses, ready for one tick rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceSetup {
    /// How the counter is read.
    pub kind: SourceKind,
    /// From counts to nanometres.
    pub gearing: Gearing,
    /// The command is the mean of so many ticks: a power of two as its logarithm, [`Average::MOST_BITS`] at
    /// most.
    pub average_bits: u32,
    /// What the setpoint may do.
    pub limits: SetpointLimits,
}

impl SourceSetup {
    /// Whether both make the same command of the same pulses.
    pub fn is_same_source(&self, other: &Self) -> bool {
        Self { limits: other.limits, ..*self } == *other
    }
}

/// The furthest that a command may be from zero: the shaper's arithmetic holds the difference of two such
/// positions.
const FURTHEST_NM: i64 = (MAX_TRAVEL_MM * 1.0e6) as i64;

/// A source of pulses at work.
#[derive(Debug)]
pub struct Source {
    setup: SourceSetup,
    /// The hardware's counter in the last tick, if there was one.
    counter: Option<u16>,
    /// Edges that do not make a whole count yet.
    edges: i32,
    /// Counts since the start; wraps.
    counted: i32,
    /// Counts of this tick.
    moved: i32,
    geared: Geared,
    /// Where the pulses say the command is. Not clamped, so that nothing is lost.
    position_nm: i64,
    average: Average,
    /// The shaped command of the last tick, within the travel.
    target_nm: i32,
    /// Ticks in which the setpoint was not the shaped command; wraps.
    saturated_ticks: u32,
}

impl Source {
    /// A source that counts from its first tick on.
    pub fn new(setup: SourceSetup) -> Self {
        Self {
            setup,
            counter: None,
            edges: setup.kind.first_edges(),
            counted: 0,
            moved: 0,
            geared: Geared::new(setup.gearing),
            position_nm: 0,
            average: Average::new(setup.average_bits, 0),
            target_nm: 0,
            saturated_ticks: 0,
        }
    }

    /// Holds the setpoint within these limits from now on.
    pub fn set_limits(&mut self, limits: SetpointLimits) {
        self.setup.limits = limits;
    }

    /// Takes the counter as it stands in this tick. Between two calls it moves by less than 2¹⁵ edges.
    #[inline]
    pub fn count(&mut self, counter: u16) {
        let before = self.counter.replace(counter).unwrap_or(counter);
        let edges = self.edges + i32::from(counter.wrapping_sub(before).cast_signed());
        let bits = self.setup.kind.edge_bits();
        self.moved = edges >> bits;
        self.edges = edges - (self.moved << bits);
        self.counted = self.counted.wrapping_add(self.moved);
    }

    /// What has been counted so far is at `position`, and the setpoint stands there.
    pub fn begin_at(&mut self, position: Nanometres) {
        self.moved = 0;
        self.geared = Geared::new(self.setup.gearing);
        self.position_nm = position.0.into();
        self.average.begin_at(position.0);
        self.target_nm = position.0;
    }

    /// The command of this tick: the mean of where the pulses said it is in the last ticks.
    #[inline]
    pub fn step(&mut self) -> FinePosition {
        let moved_nm = self.geared.advance(self.moved);
        self.position_nm = self.position_nm.saturating_add(moved_nm);
        self.average.step(self.position_nm.clamp(-FURTHEST_NM, FURTHEST_NM) as i32)
    }

    /// The setpoint after `now` and, in the tick before that, `before`: `shaped` where the limits permit it,
    /// and on the way there otherwise.
    #[inline]
    pub fn limited(&mut self, before: Nanometres, now: Nanometres, shaped: Nanometres) -> Nanometres {
        let limits = &self.setup.limits;
        let target_nm = limits.within_travel(shaped.0);
        let target_before_nm = core::mem::replace(&mut self.target_nm, target_nm);
        let next_nm = limits.next(before.0, now.0, target_nm, target_before_nm);
        if next_nm != shaped.0 {
            self.saturated_ticks = self.saturated_ticks.wrapping_add(1);
        }
        Nanometres(next_nm)
    }

    /// Whether a distance is more than a count makes.
    pub fn is_more_than_a_count(&self, distance_nm: i32) -> bool {
        distance_nm.unsigned_abs() > self.setup.gearing.most_nm_per_count()
    }

    /// Counts since the start, whether the drive was on or off; wraps.
    pub fn counted(&self) -> i32 {
        self.counted
    }

    /// Ticks since the start in which the setpoint could not be the shaped command; wraps.
    pub fn saturated_ticks(&self) -> u32 {
        self.saturated_ticks
    }
}
