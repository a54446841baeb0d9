//! What is measured.

use stillbeam_firmware::console::upload::MAX_FRAME_BYTES;
use stillbeam_firmware::shaper::stage::WEIGHT_ONE;
use stillbeam_firmware::shaper::uploaded::crc32;
use stillbeam_host_tests::played_plans::{overlaid, upload_lines};

/// Damped like the paper's beam; the second mode is that beam's second. As many as there can be.
const MODES: [(f64, f64); 4] = [(5.0, 0.01), (31.0, 0.01), (60.0, 0.01), (90.0, 0.01)];

/// An uploaded flat table of sixteen taps, two on neighbouring ticks each time, as optimisers place them.
const FLAT_PAIRS: &str = "flat, in pairs";
/// The same with no two taps next to each other.
const FLAT_SINGLE: &str = "flat, one by one";
/// As many of those as there can be.
const FLAT_MOST: &str = "flat, 64 one by one";
/// The same in as many stages as there can be: the most that a table costs.
const STAGES_MOST: &str = "four stages, 64 one by one";
/// Two stages, of runs of two and of taps without neighbours.
const MIXED: &str = "two stages, runs and lone taps";
/// The delays of their taps in ticks.
const MIXED_DELAYS: [&[u32]; 2] = [&[0, 100, 101, 200, 300, 400, 401], &[0, 100, 200, 300, 301]];
const FLAT_SPACING_TICKS: u32 = 100;

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
    /// A trapezoidal move at constant velocity.
    Move,
    /// A move with limited jerk.
    SCurve,
    /// A move along the polynomial of least jerk.
    MinimumJerk,
    /// A linear sweep.
    Sweep,
    /// A linear sweep of constant acceleration, fading in.
    AccelerationSweep,
    /// A multisine, fading in.
    Multisine,
    /// A pulse.
    Pulse,
    /// An uploaded plan.
    Play,
    /// A trapezoidal move during which one table goes over into another of the same kind.
    Handover,
    /// A move that is also put out as steps, with an encoder.
    Wired,
    /// A sweep of constant acceleration, put out as steps, with an encoder.
    WiredSweep,
    /// A move, put out as steps, with an encoder, during which the table goes over into one that costs as
    /// much or more.
    WiredHandover,
    /// Another controller's steps: in the emulator the counter goes on with its time.
    StepDir,
    /// Another controller's quadrature.
    Quadrature,
    /// The same, faster than the setpoint may follow.
    Saturated,
    /// The same, put out as steps, with an encoder, during which the table goes over into another.
    WiredSaturated,
}

impl Motion {
    /// What every table is measured with.
    const COMMON: [Self; 3] = [Self::Rest, Self::Move, Self::Sweep];
    /// What the shortest and the longest table are measured with too.
    const OTHERS: [Self; 6] =
        [Self::SCurve, Self::MinimumJerk, Self::AccelerationSweep, Self::Multisine, Self::Pulse, Self::Play];
    /// Other sources of the command.
    const SOURCES: [Self; 3] = [Self::StepDir, Self::Quadrature, Self::Saturated];
    /// How long a handover takes at least: speed over acceleration of the move. Counting must be over by
    /// then.
    const HANDOVER_S: f64 = 10.0;

    /// What it is called in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Move => "moving",
            Self::SCurve => "moving, s_curve",
            Self::MinimumJerk => "moving, minimum_jerk",
            Self::Sweep => "sweeping",
            Self::AccelerationSweep => "sweeping, constant acceleration",
            Self::Multisine => "multisine",
            Self::Pulse => "pulsing",
            Self::Play => "playing",
            Self::Handover => "moving, tables changing",
            Self::Wired => "moving, steps and encoder",
            Self::WiredSweep => "sweeping, constant acceleration, steps and encoder",
            Self::WiredHandover => "moving, tables changing, steps and encoder",
            Self::StepDir => "following, step_dir",
            Self::Quadrature => "following, quadrature",
            Self::Saturated => "following, saturated",
            Self::WiredSaturated => "following, saturated, tables changing, steps and encoder",
        }
    }

    /// The state that `status` then reports.
    pub fn state(self) -> &'static str {
        let name = self.name();
        name.split_once(',').map_or(name, |(state, _)| state)
    }

    /// The profile that moves have to have.
    pub fn profile(self) -> &'static str {
        match self {
            Self::SCurve => "s_curve",
            Self::MinimumJerk => "minimum_jerk",
            _ => "trapezoid",
        }
    }

    /// The acceleration that moves have to have, in mm/s² with 1 mm/s.
    pub fn acceleration_mm_s2(self) -> f64 {
        // What follows is handed over in the time of the longer table.
        if self.changes_tables() && !self.follows() { 1.0 / Self::HANDOVER_S } else { 5000.0 }
    }

    /// Whether two tables are at work.
    pub fn changes_tables(self) -> bool {
        matches!(self, Self::Handover | Self::WiredHandover | Self::WiredSaturated)
    }

    /// Whether another controller moves the machine from when it is enabled on.
    pub fn follows(self) -> bool {
        Self::SOURCES.contains(&self) || self == Self::WiredSaturated
    }

    /// The settings of the source: some 20 nm per tick, within 1 mm/s; or a thousand times that.
    fn source(self) -> [String; 3] {
        let (kind, gear_counts) = match self {
            Self::StepDir => ("step_dir", 250),
            Self::Quadrature => ("quadrature", 1000),
            Self::Saturated | Self::WiredSaturated => ("quadrature", 1),
            _ => ("moves", 1),
        };
        [
            format!("set source {kind}"),
            "set source.gear_nm 1".to_owned(),
            format!("set source.gear_counts {gear_counts}"),
        ]
    }

    /// The settings of steps and encoder: a step in every tick at 1 mm/s.
    fn wiring(self) -> [&'static str; 3] {
        match self {
            Self::Wired | Self::WiredSweep | Self::WiredHandover | Self::WiredSaturated => {
                ["set pulses.kind step", "set pulses.steps_per_mm 4000", "set encoder.counts_per_mm 1000"]
            }
            _ => ["set pulses.kind off", "set pulses.steps_per_mm 100", "set encoder.counts_per_mm 0"],
        }
    }

    /// The commands that start it, within 1 mm/s; a move goes to the target. `shaper` is what runs.
    pub fn commands(self, target_mm: f64, shaper: &str) -> Vec<String> {
        let move_there = format!("move {target_mm}");
        match self {
            Self::Rest | Self::StepDir | Self::Quadrature | Self::Saturated => vec![],
            Self::Move | Self::SCurve | Self::MinimumJerk | Self::Wired => vec![move_there],
            Self::Sweep => vec!["sweep linear 1 2 200 0.05".to_owned()],
            Self::AccelerationSweep | Self::WiredSweep => vec!["sweep linear 1 2 200 2mm/s2".to_owned()],
            Self::Multisine => vec!["multisine 1 8 2 50 0.005".to_owned()],
            Self::Pulse => vec!["pulse 10".to_owned()],
            Self::Play => vec!["play".to_owned()],
            Self::Handover => {
                vec![move_there, format!("set mode1.frequency_hz {}", 1.02 * MODES[0].0), "apply".to_owned()]
            }
            Self::WiredHandover | Self::WiredSaturated => {
                let mut lines = if self.follows() { vec![] } else { vec![move_there] };
                match shaper {
                    FLAT_MOST => lines.extend(flat(64, 1, FLAT_SPACING_TICKS - 1)),
                    STAGES_MOST => lines.extend(stages(4, 16, 1, FLAT_SPACING_TICKS - 1)),
                    _ => {
                        lines.extend(designed(MODES.len(), "zvddd", 1.02));
                        lines.push("apply".to_owned());
                    }
                }
                lines
            }
        }
    }
}

impl Case {
    /// Every table with every motion, without and with telemetry.
    pub fn all() -> Vec<Self> {
        let tables = [(0, "off"), (1, "zv"), (2, "zv"), (1, "zvd"), (2, "zvd"), (1, "zvdd"), (2, "zvdd")];
        let mut cases = Vec::new();
        let tables = tables.into_iter().chain([
            (1, FLAT_PAIRS),
            (1, FLAT_SINGLE),
            (1, MIXED),
            (4, "zvddd"),
            (1, FLAT_MOST),
        ]);
        for (modes, shaper) in tables {
            for streams in [false, true] {
                for motion in Motion::COMMON {
                    cases.push(Self { modes, shaper, streams, motion });
                }
            }
        }
        for (modes, shaper) in [(0, "off"), (2, "zvdd")] {
            cases.extend(Motion::OTHERS.map(|motion| Self { modes, shaper, streams: false, motion }));
            cases.extend(Motion::SOURCES.map(|motion| Self { modes, shaper, streams: false, motion }));
        }
        for (modes, shaper) in [(1, "zv"), (2, "zvd"), (2, "zvdd")] {
            cases.push(Self { modes, shaper, streams: false, motion: Motion::Handover });
        }
        for (modes, shaper) in [(2, "zvdd"), (4, "zvddd"), (1, FLAT_MOST), (1, STAGES_MOST)] {
            // What comes after all of them moves by itself.
            let motions = [Motion::WiredSaturated, Motion::Wired, Motion::WiredSweep, Motion::WiredHandover];
            for motion in motions {
                cases.extend([false, true].map(|streams| Self { modes, shaper, streams, motion }));
            }
        }
        cases
    }

    /// What there are goals for, and the most of all: what a regression would show in.
    pub fn gate() -> Vec<Self> {
        let quiet = |modes, shaper, motion| Self { modes, shaper, streams: false, motion };
        vec![
            quiet(0, "off", Motion::Rest),
            quiet(0, "off", Motion::Move),
            quiet(2, "zvdd", Motion::Move),
            quiet(2, "zvdd", Motion::Sweep),
            quiet(2, "zvdd", Motion::StepDir),
            quiet(2, "zvdd", Motion::Saturated),
            Self { modes: 1, shaper: STAGES_MOST, streams: true, motion: Motion::WiredSaturated },
            Self { modes: 1, shaper: FLAT_MOST, streams: true, motion: Motion::WiredHandover },
        ]
    }

    /// The commands that set the table up.
    pub fn table(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.motion.wiring().map(str::to_owned).into();
        lines.extend(self.motion.source());
        lines.push(format!("set move.profile {}", self.motion.profile()));
        lines.push(format!("set move.acceleration_mm_s2 {}", self.motion.acceleration_mm_s2()));
        let uploaded = match self.shaper {
            FLAT_PAIRS => Some(flat(16, 2, FLAT_SPACING_TICKS)),
            FLAT_SINGLE => Some(flat(16, 1, FLAT_SPACING_TICKS)),
            FLAT_MOST => Some(flat(64, 1, FLAT_SPACING_TICKS)),
            MIXED => Some(upload(&MIXED_DELAYS.map(equal_weights).concat())),
            STAGES_MOST => Some(stages(4, 16, 1, FLAT_SPACING_TICKS)),
            _ => None,
        };
        if uploaded.is_none() {
            lines.extend(designed(self.modes, self.shaper, 1.0));
        }
        lines.push("apply".to_owned());
        lines.extend(uploaded.into_iter().flatten());
        if self.motion == Motion::Play {
            // 8 mm in 32 s, at most 0.5 mm/s.
            lines.extend(upload_lines(&overlaid(32_000, &[(0, 8_000_000)]), 4000.0));
        }
        lines
    }
}

/// The settings of the first `modes` modes, the first one's frequency changed by a factor.
fn designed(modes: usize, shaper: &str, factor: f64) -> Vec<String> {
    let mut lines = vec!["set shaper.source designed".to_owned()];
    for (index, (frequency_hz, damping_ratio)) in MODES.into_iter().enumerate() {
        let number = index + 1;
        let frequency_hz = if index == 0 { factor * frequency_hz } else { frequency_hz };
        lines.push(format!("set mode{number}.frequency_hz {frequency_hz}"));
        lines.push(format!("set mode{number}.damping_ratio {damping_ratio}"));
        lines.push(format!("set mode{number}.type {}", if index < modes { shaper } else { "off" }));
    }
    lines
}

/// The commands that upload a flat table of so many equal taps, in runs of `run` that begin so many ticks
/// apart.
fn flat(taps: u32, run: u32, spacing_ticks: u32) -> Vec<String> {
    stages(1, taps, run, spacing_ticks)
}

/// The same for a table of so many such stages.
fn stages(count: usize, taps: u32, run: u32, spacing_ticks: u32) -> Vec<String> {
    let delays: Vec<u32> = (0..taps).map(|tap| tap / run * spacing_ticks + tap % run).collect();
    upload(&equal_weights(&delays).repeat(count))
}

/// A stage of taps with these delays, as it is uploaded; what does not divide evenly falls to the first tap.
fn equal_weights(delays_ticks: &[u32]) -> Vec<u8> {
    let count = delays_ticks.len();
    let weight = WEIGHT_ONE / count as i32;
    let first = WEIGHT_ONE - weight * (count as i32 - 1);
    let weights = std::iter::once(first).chain(std::iter::repeat(weight));
    let taps = delays_ticks.iter().zip(weights).flat_map(|(delay, weight)| {
        delay.to_le_bytes().into_iter().chain(weight.to_le_bytes()).collect::<Vec<u8>>()
    });
    (count as u32).to_le_bytes().into_iter().chain(taps).collect()
}

/// The commands that upload these stages.
fn upload(bytes: &[u8]) -> Vec<String> {
    let mut lines = vec![format!("table begin {} {:08x} 4000", bytes.len(), crc32(bytes))];
    for (number, frame) in bytes.chunks(MAX_FRAME_BYTES).enumerate() {
        let hex: String = frame.iter().map(|byte| format!("{byte:02x}")).collect();
        lines.push(format!("table frame {number} {} {hex} {:08x}", frame.len(), crc32(frame)));
    }
    lines.push("table commit".to_owned());
    lines
}
