//! The analog command input of a drive: position or velocity, with a calibrated gain and offset.

use crate::units::{Nanometres, TickRate};

/// A code of the 12-bit digital-to-analog converter: 0 is the lowest output voltage, 4095 the highest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DacCode(pub u16);

impl DacCode {
    /// The middle of the output range, which stands for zero before any calibration.
    pub const MIDDLE: Self = Self(2048);
    const HIGHEST: i64 = 4095;
    /// Codes on either side of the middle.
    const SPAN: f64 = 2047.0;
    /// Codes per millivolt at the pin, with the usual reference of 3.3 V.
    const PER_MILLIVOLT: f64 = 4096.0 / 3300.0;
}

/// What the voltage means to the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AnalogQuantity {
    /// The setpoint itself.
    #[default]
    Position,
    /// The change of the setpoint per tick. A held setpoint is zero velocity.
    Velocity,
}

/// How the analog output is set up, in a person's units. Every field is within the range of its setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogCalibration {
    /// What the voltage means.
    pub quantity: AnalogQuantity,
    /// The position at the end of the output range, in mm; used for [`AnalogQuantity::Position`].
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

/// A code, and whether the value was beyond the output's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnalogCode {
    /// The nearest code there is.
    pub code: DacCode,
    /// Whether a better one was out of range.
    pub clamped: bool,
}

/// A calibration made ready for one tick rate: a multiplication, a shift and a comparison per tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnalogOutput {
    quantity: AnalogQuantity,
    /// Codes per nanometre, or per nanometre per tick, Q40.
    gain: i64,
    /// The code of zero, and half a code for rounding, Q40.
    zero: i64,
    /// Nanometres beyond which the output is surely at its end; keeps the product within 2⁶².
    limit_nm: i32,
}

const FRACTION_BITS: u32 = 40;

impl AnalogOutput {
    /// Makes a calibration ready for a tick rate.
    pub fn new(calibration: &AnalogCalibration, tick_rate: TickRate) -> Self {
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
        }
    }

    /// The code of a setpoint, given the one of the tick before.
    #[inline]
    pub fn code(&self, setpoint: Nanometres, previous: Nanometres) -> AnalogCode {
        let value_nm = match self.quantity {
            AnalogQuantity::Position => setpoint.0,
            AnalogQuantity::Velocity => setpoint.0.wrapping_sub(previous.0),
        };
        let value_nm = i64::from(value_nm.max(-self.limit_nm).min(self.limit_nm));
        let code = (value_nm * self.gain + self.zero) >> FRACTION_BITS;
        let inside = code.clamp(0, DacCode::HIGHEST);
        AnalogCode { code: DacCode(inside as u16), clamped: inside != code }
    }

    /// The code to put out when nothing may move any more and the setpoint is not known: zero velocity, or `None`
    /// where the output is a position and is best left as it is.
    pub fn standstill(&self) -> Option<DacCode> {
        match self.quantity {
            AnalogQuantity::Position => None,
            AnalogQuantity::Velocity => Some(self.code(Nanometres(0), Nanometres(0)).code),
        }
    }
}
