//! From the setpoint to the drive's analog command input.

use crate::units::Nanometres;

/// A code of the 12-bit digital-to-analog converter: 0 is the lowest output voltage, 4095 the highest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DacCode(pub u16);

impl DacCode {
    /// The middle of the output range. It stands for position zero and is the output when nothing else is known.
    pub const MIDDLE: Self = Self(2048);
    const HIGHEST: i64 = 4095;
    /// Codes on either side of the middle.
    const SPAN: f64 = 2047.0;
}

/// How positions map onto the converter: zero in the middle, ± full scale at the ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogScale {
    full_scale_mm: f64,
    /// Codes per nanometre, Q40.
    codes_per_nm: i64,
}

const GAIN_BITS: u32 = 40;

impl AnalogScale {
    /// The accepted full scales, in millimetres.
    pub const FULL_SCALE_RANGE_MM: (f64, f64) = (1.0, 1000.0);

    /// Maps ±`full_scale_mm` onto the whole output range; `None` outside [`Self::FULL_SCALE_RANGE_MM`].
    pub fn new(full_scale_mm: f64) -> Option<Self> {
        let (low, high) = Self::FULL_SCALE_RANGE_MM;
        (full_scale_mm >= low && full_scale_mm <= high).then(|| Self::within_range(full_scale_mm))
    }

    fn within_range(full_scale_mm: f64) -> Self {
        let codes_per_nm = DacCode::SPAN / (full_scale_mm * 1.0e6);
        Self { full_scale_mm, codes_per_nm: libm::round(libm::scalbn(codes_per_nm, GAIN_BITS as i32)) as i64 }
    }

    /// The position at the end of the output range, in millimetres.
    pub fn full_scale_mm(self) -> f64 {
        self.full_scale_mm
    }

    /// The nearest code to a position; positions beyond full scale give the end of the range.
    #[inline]
    pub fn code(self, position: Nanometres) -> DacCode {
        // At most 2⁴¹ · 2³¹ / 10⁶ for the smallest full scale: no overflow.
        let offset = (i64::from(position.0) * self.codes_per_nm + (1 << (GAIN_BITS - 1))) >> GAIN_BITS;
        DacCode((offset + i64::from(DacCode::MIDDLE.0)).clamp(0, DacCode::HIGHEST) as u16)
    }
}

impl Default for AnalogScale {
    /// ±250 mm.
    fn default() -> Self {
        Self::within_range(250.0)
    }
}
