//! What the board is set to, as far as a page shows it.

use serde::Serialize;

use super::preview::MAX_MODES;
use crate::board::{BoardError, Session};

/// A mode and its shaper as the board has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModeSettings {
    /// The shaper's type, or `off`.
    pub kind: String,
    /// Undamped natural frequency.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// What a page fills its fields with.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LiveSettings {
    /// Counts the times that this was read.
    pub version: u32,
    /// The first modes. There may be more, which pages do not touch.
    pub modes: Vec<ModeSettings>,
    /// Limit of moves, mm/s.
    pub velocity_mm_s: f64,
    /// Limit of moves, mm/s².
    pub acceleration_mm_s2: f64,
    /// Where the setpoint may be.
    pub travel_mm: [f64; 2],
    /// What `info` says of the shaper: `on` or `off`.
    pub shaper: String,
    /// How long after the command the setpoint still moves.
    pub shaper_duration_ms: f64,
}

impl LiveSettings {
    /// Reads them.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn read(session: &mut Session, version: u32) -> Result<Self, BoardError> {
        let lines = session.command("get")?.lines;
        let info = session.command("info")?;
        let word = |name: &str| {
            let value = lines.iter().find_map(|line| line.strip_prefix(name)?.strip_prefix(" = "));
            value.and_then(|value| value.split(' ').next()).unwrap_or_default()
        };
        let number = |name: &str| word(name).parse().unwrap_or(f64::NAN);
        let mode = |place: usize| ModeSettings {
            kind: word(&format!("mode{place}.type")).to_owned(),
            frequency_hz: number(&format!("mode{place}.frequency_hz")),
            damping_ratio: number(&format!("mode{place}.damping_ratio")),
        };
        Ok(Self {
            version,
            modes: (1..=MAX_MODES).map(mode).collect(),
            velocity_mm_s: number("move.velocity_mm_s"),
            acceleration_mm_s2: number("move.acceleration_mm_s2"),
            travel_mm: [number("travel.min_mm"), number("travel.max_mm")],
            shaper: info.line("shaper").unwrap_or_default().to_owned(),
            shaper_duration_ms: info
                .line("shaper_duration_ms")
                .and_then(|text| text.parse().ok())
                .unwrap_or(0.0),
        })
    }
}
