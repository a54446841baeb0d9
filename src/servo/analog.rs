//! The analog command input of a drive: position or velocity, with a calibrated gain and offset.

use super::position_loop::{LoopGains, PositionLoop, VelocityQ8};
use crate::units::{Nanometres, TickRate};

/// A code of the 12-bit digital-to-analog converter: 0 is the lowest output voltage, 4095 the highest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DacCode(pub u16);

impl DacCode {
    /// The middle of the output range, which stands for zero before any calibration.
    pub const MIDDLE: Self = Self(2048);
    /// The ends of what the converter's output buffer promises to reach: 0.2 V from either supply (datasheet
    /// of the STM32F405, DAC characteristics), with the usual reference of 3.3 V.
    pub const LOWEST: Self = Self(249);
    /// See [`Self::LOWEST`].
    pub const HIGHEST: Self = Self(3847);
    /// Codes from the middle to either end.
    pub const SPAN: f64 = 1799.0;
    /// Codes per millivolt at the pin, with the usual reference of 3.3 V.
    const PER_MILLIVOLT: f64 = 4096.0 / 3300.0;
}

/// What the voltage means to the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AnalogQuantity {
    /// The setpoint itself.
    #[default]
    Position,
    /// The change of the setpoint per tick. A held setpoint is zero velocity.
    Velocity,
}

/// How the analog output is set up, in a person's units. Every field is within the range of its setting.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AnalogCalibration {
    /// What the voltage means.
    pub quantity: AnalogQuantity,
    /// The position at the end of the output range, ±1.45 V from its middle, in mm; used for
    /// [`AnalogQuantity::Position`].
    pub full_scale_mm: f64,
    /// The velocity at the end of the output range, in mm/s; used for [`AnalogQuantity::Velocity`].
    pub full_scale_mm_s: f64,
    /// Corrects the slope; one for a perfect output stage, negative for an inverting one.
    pub gain: f64,
    /// Corrects the zero: added at the pin, in mV.
    pub offset_mv: f64,
}

impl Default for AnalogCalibration {
    /// ±250 mm, uncorrected.
    fn default() -> Self {
        Self {
            quantity: AnalogQuantity::Position,
            full_scale_mm: 250.0,
            full_scale_mm_s: 1000.0,
            gain: 1.0,
            offset_mv: 0.0,
        }
    }
}

impl AnalogCalibration {
    /// The fastest setpoint that the output can tell, in mm/s; `None` where it tells a position.
    pub fn max_velocity_mm_s(&self) -> Option<f64> {
        let zero = libm::fabs(self.offset_mv) * DacCode::PER_MILLIVOLT;
        let share = (DacCode::SPAN - zero) / (DacCode::SPAN * libm::fabs(self.gain).max(1e-9));
        (self.quantity == AnalogQuantity::Velocity).then_some(share * self.full_scale_mm_s)
    }
}

/// A code, and whether the value was beyond the output's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnalogCode {
    /// The nearest code there is.
    pub code: DacCode,
    /// Whether a better one was out of range.
    pub clamped: bool,
}

/// What an output has to show in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// The setpoint.
    pub setpoint: Nanometres,
    /// The setpoint of the tick before.
    pub previous: Nanometres,
    /// Where the encoder says that the machine was when this tick began, if there is one.
    pub encoder: Option<Nanometres>,
    /// Whether the drive listens.
    pub drive_enabled: bool,
}

/// What the codes of a velocity still owe, in codes, Q40: a code too coarse in one tick is made up in the
/// next, so that their sum is the distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Owed(i64);

/// A calibration made ready for one tick rate: a multiplication, a shift and a comparison per tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnalogOutput {
    quantity: AnalogQuantity,
    /// Codes per nanometre, or per nanometre per tick, Q40.
    gain: i64,
    /// The code of zero, and half a code for rounding, Q40.
    zero: i64,
    /// Nanometres beyond which the output is surely at its end; keeps the product within 2⁵⁴.
    limit_nm: i32,
    position_loop: PositionLoop,
}

const FRACTION_BITS: u32 = 40;
/// Half a code, Q40.
const HALF: i64 = 1 << (FRACTION_BITS - 1);

impl AnalogOutput {
    /// Makes a calibration ready for a tick rate; the gains are those of a velocity.
    pub fn new(calibration: &AnalogCalibration, gains: &LoopGains, tick_rate: TickRate) -> Self {
        let full_scale_nm = match calibration.quantity {
            AnalogQuantity::Position => calibration.full_scale_mm * 1.0e6,
            AnalogQuantity::Velocity => calibration.full_scale_mm_s * 1.0e6 * tick_rate.period_s(),
        };
        let fixed = |codes: f64| libm::round(libm::scalbn(codes, FRACTION_BITS as i32)) as i64;
        let zero = f64::from(DacCode::MIDDLE.0) + calibration.offset_mv * DacCode::PER_MILLIVOLT;
        // The whole range and as much again; an `as` from float saturates.
        let span_nm = 2.0 * (DacCode::SPAN + libm::fabs(zero)) / DacCode::SPAN * full_scale_nm;
        let limit_nm = (span_nm / libm::fabs(calibration.gain).max(1e-3)).max(1.0) as i32;
        Self {
            quantity: calibration.quantity,
            gain: fixed(calibration.gain * DacCode::SPAN / full_scale_nm),
            zero: fixed(zero + 0.5),
            limit_nm,
            position_loop: PositionLoop::new(gains, tick_rate),
        }
    }

    /// The code of a tick, and what it then owes.
    #[inline]
    pub fn code(&self, target: Target, owed: &mut Owed) -> AnalogCode {
        match self.quantity {
            AnalogQuantity::Position => {
                let value_nm = i64::from(target.setpoint.0.max(-self.limit_nm).min(self.limit_nm));
                // Within 2¹⁴ by the limit.
                within_range(((value_nm * self.gain + self.zero) >> FRACTION_BITS) as i32)
            }
            AnalogQuantity::Velocity => {
                let Target { setpoint, previous, encoder, drive_enabled } = target;
                self.velocity_code(owed, setpoint, previous, encoder, drive_enabled)
            }
        }
    }

    /// Apart from the tick of a position, which then has its registers and lays nothing out in memory for it.
    #[inline(never)]
    fn velocity_code(
        &self,
        owed: &mut Owed,
        setpoint: Nanometres,
        previous: Nanometres,
        encoder: Option<Nanometres>,
        drive_enabled: bool,
    ) -> AnalogCode {
        if !drive_enabled {
            *owed = Owed(0);
            return within_range((self.zero >> FRACTION_BITS) as i32);
        }
        let moved_nm = i64::from(setpoint.0) - i64::from(previous.0);
        let correction = match encoder {
            // The encoder was read before this tick's setpoint went out: it is compared with the one before.
            Some(position) => self.position_loop.correction(previous, position),
            None => VelocityQ8(0),
        };
        let limit = i64::from(self.limit_nm) << VelocityQ8::FRACTION_BITS;
        let velocity = ((moved_nm << VelocityQ8::FRACTION_BITS) + correction.0).max(-limit).min(limit);
        // Within 2⁶² by the limit.
        let wanted = ((velocity * self.gain) >> VelocityQ8::FRACTION_BITS) + self.zero + owed.0;
        let found = within_range((wanted >> FRACTION_BITS) as i32);
        // Half a code is in `zero`. What does not fit into the range is lost: it would come out as a speed
        // that nobody asked for.
        let left = wanted - (i64::from(found.code.0) << FRACTION_BITS) - HALF;
        *owed = Owed(left.clamp(-HALF, HALF));
        found
    }

    /// The code to put out when nothing may move any more and the setpoint is not known: zero velocity, or
    /// `None` where the output is a position and is best left as it is.
    pub fn standstill(&self) -> Option<DacCode> {
        match self.quantity {
            AnalogQuantity::Position => None,
            AnalogQuantity::Velocity => Some(within_range((self.zero >> FRACTION_BITS) as i32).code),
        }
    }
}

#[inline]
fn within_range(code: i32) -> AnalogCode {
    let inside = code.clamp(i32::from(DacCode::LOWEST.0), i32::from(DacCode::HIGHEST.0));
    AnalogCode { code: DacCode(inside as u16), clamped: inside != code }
}
