//! What is measured.

/// Damped like the paper's beam; the second mode is that beam's second.
const MODES: [(f64, f64); 2] = [(5.0, 0.01), (31.0, 0.01)];

/// One state of the machine in which ticks are counted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// How many modes are shaped.
    pub modes: usize,
    /// The console's word for their shaper.
    pub shaper: &'static str,
    /// Whether every tick queues a sample.
    pub streams: bool,
    /// What moves.
    pub motion: Motion,
}

/// What moves while ticks are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Nothing.
    Rest,
    /// A move at constant velocity.
    Move,
    /// A linear sweep.
    Sweep,
}

impl Motion {
    /// The state that `status` then reports.
    pub fn state(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Move => "moving",
            Self::Sweep => "sweeping",
        }
    }
}

impl Case {
    /// Every table with every motion, without and with telemetry.
    pub fn all() -> Vec<Self> {
        let tables = [(0, "off"), (1, "zv"), (2, "zv"), (1, "zvd"), (2, "zvd"), (1, "zvdd"), (2, "zvdd")];
        let mut cases = Vec::new();
        for (modes, shaper) in tables {
            for streams in [false, true] {
                for motion in [Motion::Rest, Motion::Move, Motion::Sweep] {
                    cases.push(Self { modes, shaper, streams, motion });
                }
            }
        }
        cases
    }

    /// The longest table while moving: what a regression would show in first.
    pub fn gate() -> Vec<Self> {
        vec![Self { modes: 2, shaper: "zvdd", streams: false, motion: Motion::Move }]
    }

    /// The commands that set the table up.
    pub fn table(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (index, (frequency_hz, damping_ratio)) in MODES.into_iter().enumerate() {
            let number = index + 1;
            let shaper = if index < self.modes { self.shaper } else { "off" };
            lines.push(format!("set mode{number}.frequency_hz {frequency_hz}"));
            lines.push(format!("set mode{number}.damping_ratio {damping_ratio}"));
            lines.push(format!("set mode{number}.type {shaper}"));
        }
        lines.push("apply".to_owned());
        lines
    }
}
