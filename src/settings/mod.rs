//! What a person can set: the values, in [`key`] their names, units, ranges and meaning, and in [`store`] how
//! they survive a reset.

pub mod drive;
pub mod erase_journal;
pub mod homing;
pub mod inputs;
pub mod key;
pub mod record;
pub mod safety;
pub mod seal;
pub mod source;
pub mod store;

pub use drive::{DriveKey, DriveSettings, EmergencyInput, PulseKind};
pub use homing::{HomingKey, HomingMethod, HomingSettings};
pub use inputs::{INPUTS, InputKey, InputSettings};
pub use key::{Choice, Key, ModeKey, Refusal, ShaperSource, Value};
pub use safety::{SafetyKey, SafetySettings};
pub use seal::Damage;
pub use source::{SourceKey, SourceMisfit, SourceSettings};
pub use store::{SettingsStore, StoreError, Stored};

use crate::control::Setup;
use crate::drive::{DriveSetup, Lacking};
use crate::fault::{Reactions, TravelGuard};
use crate::motion::stop::Braking;
use crate::motion::{MoveLimits, Profile};
use crate::shaper::{MAX_MODES, Mode, ModeError, ShaperType};
use crate::units::{MAX_TRAVEL_MM, Nanometres, TickRate};

/// One mode as it is set; `shaper: None` leaves it unshaped.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    tick_rate: TickRate,
    modes: [ModeSetting; MAX_MODES],
    shaper_source: ShaperSource,
    limits: MoveLimits,
    profile: Profile,
    moving_mass_kg: f64,
    stream_decimation: u32,
    drive: DriveSettings,
    safety: SafetySettings,
    inputs: InputSettings,
    source: SourceSettings,
    homing: HomingSettings,
}

impl Settings {
    /// The requested tick rate. The board's timer divides its clock by a whole number, so the tick
    /// rate it can run is the nearest that [`TickRate::attainable`] gives.
    pub fn tick_rate(&self) -> TickRate {
        self.tick_rate
    }

    /// Selects the uploaded table.
    pub fn use_uploaded_table(&mut self) {
        self.shaper_source = ShaperSource::Uploaded;
    }

    /// Where the shaper comes from.
    pub fn shaper_source(&self) -> ShaperSource {
        self.shaper_source
    }

    /// What a motion may ask of the machine, before a shaper of gain one.
    pub fn limits(&self) -> MoveLimits {
        self.limits
    }

    /// The shape of moves.
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// The mass that a force moves, in kg; zero where it is not known.
    pub fn moving_mass_kg(&self) -> f64 {
        self.moving_mass_kg
    }

    /// Ticks per streamed sample when `stream on` does not say.
    pub fn stream_decimation(&self) -> u32 {
        self.stream_decimation
    }

    /// Outputs, encoder, emergency input and what faults do.
    pub fn drive(&self) -> &DriveSettings {
        &self.drive
    }

    /// Enabling and stopping.
    pub fn safety(&self) -> &SafetySettings {
        &self.safety
    }

    /// What the general inputs mean.
    pub fn inputs(&self) -> &InputSettings {
        &self.inputs
    }

    /// Where the command comes from.
    pub fn source(&self) -> &SourceSettings {
        &self.source
    }

    /// How the machine finds its reference.
    pub fn homing(&self) -> &HomingSettings {
        &self.homing
    }

    /// What the tick needs of all this at a tick rate that the board can run, before a shaper whose taps have
    /// this sum of magnitudes.
    pub fn setup(&self, tick_rate: TickRate, shaper_gain: f64) -> Setup {
        let limits = MoveLimits { shaper_gain, ..self.limits };
        let slack_mm = limits.stop_overshoot_mm(self.profile, tick_rate);
        let (first_mm, last_mm) = limits.travel_mm;
        let end = |mm: f64| Nanometres::from_mm(mm.clamp(-MAX_TRAVEL_MM, MAX_TRAVEL_MM)).unwrap_or_default();
        Setup {
            braking: Braking::new(&limits, self.profile, tick_rate),
            // The ends of the travel are within what positions can say.
            guard: TravelGuard::new(end(first_mm), end(last_mm), end(slack_mm)),
            unreferenced: self.homing.unreferenced_mm().map(end),
            reactions: Reactions { emergency: self.safety.emergency_stop(), ..self.drive.reactions() },
            drive: DriveSetup {
                times: self.safety.times(&self.limits, tick_rate),
                lacking: Lacking::default()
                    .with(Lacking::EMERGENCY_SETTING, self.drive.emergency_input() == EmergencyInput::Unset),
                inputs: self.inputs.roles(),
                relative: self.drive.is_relative(),
            },
            analog: self.drive.analog(tick_rate),
            pulses: self.drive.pulses(tick_rate),
            encoder: self.drive.encoder(),
            source: self.source.setup(&self.limits, [end(first_mm), end(last_mm)], tick_rate),
        }
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
    /// No shaper, 4 kHz, ±250 mm of travel at 500 mm/s, 5 m/s² and 1000 m/s³, trapezoidal moves.
    fn default() -> Self {
        Self {
            tick_rate: TickRate::DEFAULT,
            modes: [ModeSetting { frequency_hz: 1.0, damping_ratio: 0.0, shaper: None }; MAX_MODES],
            shaper_source: ShaperSource::Designed,
            limits: MoveLimits {
                velocity_mm_s: 500.0,
                acceleration_mm_s2: 5000.0,
                jerk_mm_s3: 1.0e6,
                travel_mm: (-250.0, 250.0),
                shaper_gain: 1.0,
            },
            profile: Profile::Trapezoid,
            moving_mass_kg: 0.0,
            stream_decimation: 4,
            drive: DriveSettings::default(),
            safety: SafetySettings::default(),
            inputs: InputSettings::default(),
            source: SourceSettings::default(),
            homing: HomingSettings::default(),
        }
    }
}
