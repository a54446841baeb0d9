//! What a person can set: the values, in [`key`] their names, units, ranges and meaning, and in [`store`] how they
//! survive a reset.

pub mod drive;
pub mod erase_journal;
pub mod key;
pub mod record;
pub mod store;

pub use drive::{DriveKey, DriveSettings, EmergencyInput, PulseKind};
pub use key::{Choice, Key, ModeKey, Refusal, Value};
pub use store::{SettingsStore, StoreError, Stored};

use crate::control::Setup;
use crate::fault::TravelGuard;
use crate::motion::MoveLimits;
use crate::motion::stop::Braking;
use crate::shaper::{MAX_MODES, Mode, ModeError, ShaperType};
use crate::units::{Nanometres, TickRate};

/// One mode as it is set; `shaper: None` leaves it unshaped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeSetting {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// The type of the mode's shaper, if it is shaped.
    pub shaper: Option<ShaperType>,
}

/// All settings. Every value is within the range of its key, and nothing more is promised: whether they
/// fit together, the tick rate and the memory is found out by whoever applies them.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    tick_rate: TickRate,
    modes: [ModeSetting; MAX_MODES],
    limits: MoveLimits,
    stream_decimation: u32,
    drive: DriveSettings,
}

impl Settings {
    /// The requested tick rate. The board's timer divides its clock by a whole number, so the tick
    /// rate it can run is the nearest that [`TickRate::attainable`] gives.
    pub fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// What a move may ask of the machine.
    pub fn limits(&self) -> MoveLimits {
        self.limits
    }

    /// Ticks per streamed sample when `stream on` does not say.
    pub fn stream_decimation(&self) -> u32 {
        self.stream_decimation
    }

    /// Outputs, encoder, emergency input and what faults do.
    pub fn drive(&self) -> &DriveSettings {
        &self.drive
    }

    /// What the tick needs of all this at a tick rate that the board can run.
    pub fn setup(&self, tick_rate: TickRate) -> Setup {
        let end = |mm| Nanometres::from_mm(mm).unwrap_or_default();
        Setup {
            braking: self.braking(),
            // The ends of the travel are within what positions can say.
            guard: TravelGuard::new(end(self.limits.travel_mm.0), end(self.limits.travel_mm.1)),
            reactions: self.drive.reactions(),
            analog: self.drive.analog(tick_rate),
            pulses: self.drive.pulses(tick_rate),
            encoder: self.drive.encoder(),
        }
    }

    /// How a controlled stop brakes.
    pub fn braking(&self) -> Braking {
        Braking::new(&self.limits, self.tick_rate)
    }

    /// The settings of the mode numbered from zero.
    pub fn mode(&self, index: usize) -> Option<&ModeSetting> {
        self.modes.get(index)
    }

    /// The modes that are to be shaped, each with its number from zero.
    pub fn shaped_modes(&self) -> impl Iterator<Item = (usize, Result<Mode, ModeError>)> + '_ {
        self.modes.iter().enumerate().filter_map(|(index, mode)| {
            let shaper = mode.shaper?;
            Some((index, Mode::new(mode.frequency_hz, mode.damping_ratio, shaper)))
        })
    }
}

impl Default for Settings {
    /// No shaper, 4 kHz, ±250 mm of travel at 500 mm/s and 5 m/s².
    fn default() -> Self {
        Self {
            tick_rate: TickRate::DEFAULT,
            modes: [ModeSetting { frequency_hz: 1.0, damping_ratio: 0.0, shaper: None }; MAX_MODES],
            limits: MoveLimits {
                velocity_mm_s: 500.0,
                acceleration_mm_s2: 5000.0,
                travel_mm: (-250.0, 250.0),
            },
            stream_decimation: 4,
            drive: DriveSettings::default(),
        }
    }
}
