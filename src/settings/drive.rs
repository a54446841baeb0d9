//! Settings of everything between setpoint and drive, and of what faults do.

use super::{Choice, Refusal, Value};
use crate::fault::{Reaction, Reactions};
use crate::servo::analog::{AnalogCalibration, AnalogOutput, AnalogQuantity};
use crate::servo::pulses::PulseTiming;
use crate::servo::{EncoderScale, LoopGains, PulseConfiguration, PulseScale};
use crate::units::TickRate;

/// How steps are put out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PulseKind {
    /// No pulses.
    #[default]
    Off,
    /// A pulse per step, and the direction.
    Step,
    /// Two square waves, a quarter apart; two edges per step.
    Quadrature,
}

/// When the emergency input is active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EmergencyInput {
    /// Nobody has said. The drive cannot be enabled.
    #[default]
    Unset,
    /// At a high level: a contact that opens, or a broken wire.
    High,
    /// At a low level: a contact that closes.
    Low,
    /// Never: somebody has said that something else stops the machine.
    Waived,
}

/// The settings of outputs, encoder, emergency input and faults.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DriveSettings {
    pub(super) analog: AnalogCalibration,
    pub(super) position_loop: LoopGains,
    /// Zero for a host that may be silent.
    pub(super) link_timeout_ms: f64,
    pub(super) pulse_kind: PulseKind,
    pub(super) pulses: StepsPerMm,
    pub(super) pulse_timing: PulseTiming,
    pub(super) encoder: EncoderSettings,
    pub(super) emergency: EmergencyInput,
    pub(super) reactions: Reactions,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct StepsPerMm(pub(super) f64);

impl Default for StepsPerMm {
    fn default() -> Self {
        Self(100.0)
    }
}

/// No encoder, and no window to check.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct EncoderSettings {
    counts_per_mm: f64,
    window_mm: f64,
}

impl DriveSettings {
    /// The analog output, ready for a tick rate.
    pub fn analog(&self, tick_rate: TickRate) -> AnalogOutput {
        AnalogOutput::new(&self.analog, &self.position_loop, tick_rate)
    }

    /// The fastest setpoint that an analog velocity can tell, in mm/s; `None` where the output tells a
    /// position.
    pub fn analog_velocity_mm_s(&self) -> Option<f64> {
        self.analog.max_velocity_mm_s()
    }

    /// What a position loop lacks: an encoder, a window for it, or a drive that takes a velocity.
    pub fn position_loop_lacks(&self) -> Option<&'static str> {
        let Self { analog, encoder, position_loop, .. } = self;
        match () {
            () if position_loop.gain_per_s == 0.0 => None,
            () if analog.quantity != AnalogQuantity::Velocity => Some("analog.quantity velocity"),
            () if encoder.counts_per_mm == 0.0 => Some("encoder.counts_per_mm"),
            () if encoder.window_mm == 0.0 => Some("encoder.window_mm"),
            () => None,
        }
    }

    /// For how long the host may be silent during a motion, in ms; zero for as long as it likes.
    pub fn link_timeout_ms(&self) -> f64 {
        self.link_timeout_ms
    }

    /// How steps are put out.
    pub fn pulse_kind(&self) -> PulseKind {
        self.pulse_kind
    }

    /// The step pulses, ready for a tick rate; `None` without.
    pub fn pulses(&self, tick_rate: TickRate) -> Option<PulseScale> {
        (self.pulse_kind != PulseKind::Off).then(|| self.pulse_scale(tick_rate))
    }

    fn pulse_scale(&self, tick_rate: TickRate) -> PulseScale {
        PulseScale::new(self.pulse_kind, self.pulses.0, &self.pulse_timing, tick_rate)
    }

    /// What the step output has to be set up for.
    pub fn pulse_configuration(&self, tick_rate: TickRate) -> PulseConfiguration {
        self.pulse_scale(tick_rate).configuration()
    }

    /// The fastest setpoint that the pulses can follow, in mm/s; `None` without pulses.
    pub fn pulse_velocity_mm_s(&self, tick_rate: TickRate) -> Option<f64> {
        let wanted = self.pulse_kind != PulseKind::Off;
        wanted.then(|| PulseScale::max_velocity_mm_s(self.pulses.0, &self.pulse_timing, tick_rate))
    }

    /// The encoder; `None` without.
    pub fn encoder(&self) -> Option<EncoderScale> {
        EncoderScale::new(self.encoder.counts_per_mm, self.encoder.window_mm)
    }

    /// The window of the encoder in mm; `None` without an encoder or a window.
    pub fn encoder_window_mm(&self) -> Option<f64> {
        self.encoder().map(|_| self.encoder.window_mm).filter(|window_mm| *window_mm > 0.0)
    }

    /// Whether an encoder outside its window stops the machine.
    pub fn stops_on_encoder(&self) -> bool {
        self.reactions.encoder != Reaction::Report
    }

    /// When the emergency input is active.
    pub fn emergency_input(&self) -> EmergencyInput {
        self.emergency
    }

    /// Whether the drive is told how far to go or how fast, and not where: pulses or a velocity.
    pub fn is_relative(&self) -> bool {
        self.pulse_kind != PulseKind::Off || self.analog.quantity == AnalogQuantity::Velocity
    }

    /// What faults do.
    pub fn reactions(&self) -> Reactions {
        self.reactions
    }

    /// Whether going from `self` to `other` changes the scale, kind or polarity of something that is put out
    /// or read in.
    pub fn rescales(&self, other: &Self) -> bool {
        let scales = |drive: &Self| {
            let Self { analog, position_loop, pulse_kind, pulses, pulse_timing, encoder, emergency, .. } =
                *drive;
            (analog, position_loop, pulse_kind, pulses, pulse_timing, encoder, emergency)
        };
        scales(self) != scales(other)
    }
}

/// The names of these settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DriveKey {
    /// `analog.quantity`
    AnalogQuantity,
    /// `analog.full_scale_mm_s`
    AnalogFullScaleVelocity,
    /// `analog.gain`
    AnalogGain,
    /// `analog.offset_mV`
    AnalogOffset,
    /// `loop.gain_per_s`
    LoopGain,
    /// `loop.limit_mm_s`
    LoopLimit,
    /// `link.timeout_ms`
    LinkTimeout,
    /// `pulses.kind`
    PulseKind,
    /// `pulses.steps_per_mm`
    StepsPerMm,
    /// `pulses.width_us`
    PulseWidth,
    /// `pulses.setup_us`
    PulseSetup,
    /// `pulses.level`
    PulseLevel,
    /// `encoder.counts_per_mm`
    EncoderCounts,
    /// `encoder.window_mm`
    EncoderWindow,
    /// `emergency.input`
    EmergencyInput,
    /// `fault.missed_tick`
    OnMissedTick,
    /// `fault.limit`
    OnLimit,
    /// `fault.encoder`
    OnEncoder,
}

static QUANTITIES: [&str; 2] = ["position", "velocity"];
static PULSE_LEVELS: [&str; 2] = ["high", "low"];
static PULSE_KINDS: [&str; 3] = ["off", "step", "quadrature"];
static EMERGENCY_INPUTS: [&str; 4] = ["unset", "high", "low", "waived"];
static REACTIONS: [&str; 4] = ["report", "category_2", "category_0", "category_1"];

impl DriveKey {
    /// Every key, in the order in which they are listed.
    pub const ALL: [Self; 18] = [
        Self::AnalogQuantity,
        Self::AnalogFullScaleVelocity,
        Self::AnalogGain,
        Self::AnalogOffset,
        Self::LoopGain,
        Self::LoopLimit,
        Self::PulseKind,
        Self::StepsPerMm,
        Self::PulseWidth,
        Self::PulseSetup,
        Self::PulseLevel,
        Self::EncoderCounts,
        Self::EncoderWindow,
        Self::EmergencyInput,
        Self::OnMissedTick,
        Self::OnLimit,
        Self::OnEncoder,
        Self::LinkTimeout,
    ];

    /// The number in the flash.
    pub(super) fn id(self) -> u8 {
        match self {
            Self::AnalogQuantity => 40,
            Self::AnalogFullScaleVelocity => 41,
            Self::AnalogGain => 42,
            Self::AnalogOffset => 43,
            Self::PulseKind => 44,
            Self::StepsPerMm => 45,
            Self::EncoderCounts => 46,
            Self::EncoderWindow => 47,
            Self::EmergencyInput => 48,
            Self::OnMissedTick => 49,
            Self::OnLimit => 50,
            Self::OnEncoder => 51,
            Self::LoopGain => 52,
            Self::LoopLimit => 53,
            Self::LinkTimeout => 54,
            Self::PulseWidth => 55,
            Self::PulseSetup => 56,
            Self::PulseLevel => 57,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::AnalogQuantity => "analog.quantity",
            Self::AnalogFullScaleVelocity => "analog.full_scale_mm_s",
            Self::AnalogGain => "analog.gain",
            Self::AnalogOffset => "analog.offset_mV",
            Self::LoopGain => "loop.gain_per_s",
            Self::LoopLimit => "loop.limit_mm_s",
            Self::LinkTimeout => "link.timeout_ms",
            Self::PulseWidth => "pulses.width_us",
            Self::PulseSetup => "pulses.setup_us",
            Self::PulseLevel => "pulses.level",
            Self::PulseKind => "pulses.kind",
            Self::StepsPerMm => "pulses.steps_per_mm",
            Self::EncoderCounts => "encoder.counts_per_mm",
            Self::EncoderWindow => "encoder.window_mm",
            Self::EmergencyInput => "emergency.input",
            Self::OnMissedTick => "fault.missed_tick",
            Self::OnLimit => "fault.limit",
            Self::OnEncoder => "fault.encoder",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::AnalogFullScaleVelocity | Self::LoopLimit => "mm/s",
            Self::LoopGain => "1/s",
            Self::LinkTimeout => "ms",
            Self::PulseWidth | Self::PulseSetup => "us",
            Self::AnalogOffset => "mV",
            Self::StepsPerMm | Self::EncoderCounts => "1/mm",
            Self::EncoderWindow => "mm",
            _ => "",
        }
    }

    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::AnalogQuantity => "What the analog output tells the drive.",
            Self::AnalogFullScaleVelocity => {
                "Velocity at the end of the analog output's range, if it is a velocity."
            }
            Self::AnalogGain => {
                "Corrects the analog output's slope; negative where the output stage inverts."
            }
            Self::AnalogOffset => "Corrects the analog output's zero, at the pin.",
            Self::LoopGain => {
                "Velocity per distance from the encoder, on top of the setpoint's; 0 for no position loop."
            }
            Self::LinkTimeout => {
                "A motion stops when the host has been silent for so long; 0 for as long as it likes."
            }
            Self::LoopLimit => "Largest velocity that the position loop adds.",
            Self::PulseKind => "Step and direction, or A and B in quadrature, two edges per step.",
            Self::PulseWidth => {
                "Least length of a pulse and of the pause between two; least distance of two edges in quadrature."
            }
            Self::PulseSetup => "Least time from a change of the direction to the first step.",
            Self::PulseLevel => "Level of a pulse; quadrature has none.",
            Self::StepsPerMm => "Steps per millimetre; negative for the other direction.",
            Self::EncoderCounts => {
                "Edges of the encoder per millimetre; negative where it counts the other way, 0 for none."
            }
            Self::EncoderWindow => "Largest distance between encoder and setpoint; 0 for no check.",
            Self::EmergencyInput => {
                "Level at which the emergency input stops the machine; waived if something else does. Unset: no enabling."
            }
            Self::OnMissedTick => "What a tick missed during a motion does, beside being reported.",
            Self::OnLimit => {
                "What a setpoint outside the travel does, beside being reported and not put out; report is category_2."
            }
            Self::OnEncoder => "What an encoder outside its window does, beside being reported.",
        }
    }

    /// First and last accepted number; both zero for words.
    pub(super) fn range(self) -> (f64, f64) {
        let (_, counts) = EncoderScale::RANGE_PER_MM;
        match self {
            Self::AnalogFullScaleVelocity => (1.0, 10_000.0),
            Self::AnalogGain => (-2.0, 2.0),
            Self::AnalogOffset => (-1000.0, 1000.0),
            Self::LoopGain => (0.0, 1000.0),
            Self::PulseWidth => PulseTiming::WIDTH_RANGE_US,
            Self::PulseSetup => PulseTiming::SETUP_RANGE_US,
            Self::LinkTimeout => (0.0, 60_000.0),
            Self::LoopLimit => (0.01, 10_000.0),
            Self::StepsPerMm => (-PulseScale::MAX_STEPS_PER_MM, PulseScale::MAX_STEPS_PER_MM),
            Self::EncoderCounts => (-counts, counts),
            Self::EncoderWindow => (0.0, 100.0),
            _ => (0.0, 0.0),
        }
    }

    /// The accepted words; `None` for numbers. A word's place is its number in the flash, so the order stays.
    pub(super) fn words(self) -> Option<&'static [&'static str]> {
        match self {
            Self::AnalogQuantity => Some(&QUANTITIES),
            Self::PulseKind => Some(&PULSE_KINDS),
            Self::PulseLevel => Some(&PULSE_LEVELS),
            Self::EmergencyInput => Some(&EMERGENCY_INPUTS),
            Self::OnMissedTick | Self::OnLimit | Self::OnEncoder => Some(&REACTIONS),
            _ => None,
        }
    }
}

impl DriveSettings {
    pub(super) fn get(&self, key: DriveKey) -> Value {
        let place = match key {
            DriveKey::AnalogFullScaleVelocity => return Value::Number(self.analog.full_scale_mm_s),
            DriveKey::AnalogGain => return Value::Number(self.analog.gain),
            DriveKey::AnalogOffset => return Value::Number(self.analog.offset_mv),
            DriveKey::LoopGain => return Value::Number(self.position_loop.gain_per_s),
            DriveKey::PulseWidth => return Value::Number(self.pulse_timing.width_us),
            DriveKey::PulseSetup => return Value::Number(self.pulse_timing.setup_us),
            DriveKey::LinkTimeout => return Value::Number(self.link_timeout_ms),
            DriveKey::LoopLimit => return Value::Number(self.position_loop.limit_mm_s),
            DriveKey::StepsPerMm => return Value::Number(self.pulses.0),
            DriveKey::EncoderCounts => return Value::Number(self.encoder.counts_per_mm),
            DriveKey::EncoderWindow => return Value::Number(self.encoder.window_mm),
            DriveKey::AnalogQuantity => self.analog.quantity as u8,
            DriveKey::PulseKind => self.pulse_kind as u8,
            DriveKey::PulseLevel => self.pulse_timing.active_low as u8,
            DriveKey::EmergencyInput => self.emergency as u8,
            DriveKey::OnMissedTick => self.reactions.missed_tick as u8,
            DriveKey::OnLimit => self.reactions.limit as u8,
            DriveKey::OnEncoder => self.reactions.encoder as u8,
        };
        Value::Word(Choice::new(key.words().unwrap_or_default(), place))
    }

    /// Sets a number that is within the range of its key.
    pub(super) fn put_number(&mut self, key: DriveKey, number: f64) -> Result<(), Refusal> {
        match key {
            DriveKey::AnalogFullScaleVelocity => self.analog.full_scale_mm_s = number,
            DriveKey::AnalogGain => self.analog.gain = number,
            DriveKey::AnalogOffset => self.analog.offset_mv = number,
            DriveKey::LoopGain => self.position_loop.gain_per_s = number,
            DriveKey::PulseWidth => self.pulse_timing.width_us = number,
            DriveKey::PulseSetup => self.pulse_timing.setup_us = number,
            DriveKey::LinkTimeout => self.link_timeout_ms = number,
            DriveKey::LoopLimit => self.position_loop.limit_mm_s = number,
            DriveKey::StepsPerMm => self.pulses.0 = at_least(0.1, number)?,
            DriveKey::EncoderCounts if number == 0.0 => self.encoder.counts_per_mm = 0.0,
            DriveKey::EncoderCounts => {
                self.encoder.counts_per_mm = at_least(EncoderScale::RANGE_PER_MM.0, number)?;
            }
            DriveKey::EncoderWindow => self.encoder.window_mm = number,
            _ => return Err(Refusal::NotAWord { words: key.words().unwrap_or_default() }),
        }
        Ok(())
    }

    pub(super) fn put_word(&mut self, key: DriveKey, word: Choice) -> Result<(), Refusal> {
        let place = word.place();
        let reaction = || Reaction::ALL.get(usize::from(place)).copied().unwrap_or(Reaction::Category1);
        match key {
            DriveKey::AnalogQuantity => {
                self.analog.quantity =
                    if place == 0 { AnalogQuantity::Position } else { AnalogQuantity::Velocity };
            }
            DriveKey::PulseKind => {
                self.pulse_kind = match place {
                    0 => PulseKind::Off,
                    1 => PulseKind::Step,
                    _ => PulseKind::Quadrature,
                };
            }
            DriveKey::PulseLevel => self.pulse_timing.active_low = place != 0,
            DriveKey::EmergencyInput => {
                self.emergency = match place {
                    0 => EmergencyInput::Unset,
                    1 => EmergencyInput::High,
                    2 => EmergencyInput::Low,
                    _ => EmergencyInput::Waived,
                };
            }
            DriveKey::OnMissedTick => self.reactions.missed_tick = reaction(),
            DriveKey::OnLimit => self.reactions.limit = reaction(),
            DriveKey::OnEncoder => self.reactions.encoder = reaction(),
            _ => return Err(Refusal::NotANumber),
        }
        Ok(())
    }
}

fn at_least(least: f64, number: f64) -> Result<f64, Refusal> {
    if libm::fabs(number) >= least { Ok(number) } else { Err(Refusal::TooSmall { number, least }) }
}
