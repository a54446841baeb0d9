//! The encoder: a 16-bit hardware counter, extended here and scaled to nanometres.

use crate::units::Nanometres;

/// How counts relate to nanometres, and how far the machine may be from its setpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderScale {
    /// Nanometres per count, Q24.
    nm_per_count: i64,
    /// The counts that make ± 2.1 m, which is all that nanometres can say.
    limit_counts: i32,
    /// The largest following error in nanometres; `i32::MAX` for no check.
    window_nm: i32,
}

const FRACTION_BITS: u32 = 24;

impl EncoderScale {
    /// Counts per millimetre that are understood, either direction.
    pub const RANGE_PER_MM: (f64, f64) = (1.0, 100_000.0);

    /// `counts_per_mm` edges of the quadrature signal per millimetre, negative where the encoder counts the
    /// other way; `None` for zero, which is no encoder. A window of zero is no check.
    pub fn new(counts_per_mm: f64, window_mm: f64) -> Option<Self> {
        let (least, most) = Self::RANGE_PER_MM;
        let size = libm::fabs(counts_per_mm);
        if !(size >= least && size <= most) {
            return None;
        }
        let nm_per_count = libm::round(libm::scalbn(1.0e6 / counts_per_mm, FRACTION_BITS as i32)) as i64;
        // A cast from a float saturates.
        let window_nm = if window_mm > 0.0 { (window_mm * 1.0e6) as i32 } else { i32::MAX };
        let limit_counts = (f64::from(i32::MAX) * 1.0e-6 * size) as i32;
        Some(Self { nm_per_count, limit_counts, window_nm })
    }
}

/// The position that the encoder tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoder {
    scale: EncoderScale,
    /// The hardware's counter, last seen.
    counter: u16,
    /// Counts since the reference.
    counts: i32,
    /// The position at the reference.
    reference: Nanometres,
}

impl Encoder {
    /// An encoder whose counter now stands at `counter`, which is `position`.
    pub fn new(scale: EncoderScale, counter: u16, position: Nanometres) -> Self {
        Self { scale, counter, counts: 0, reference: position }
    }

    /// Takes the counter as it stands now. Between two calls the machine moves by less than 2¹⁵ counts, which
    /// at the slowest tick is 6.5 million counts per second.
    #[inline]
    pub fn update(&mut self, counter: u16) -> Nanometres {
        let moved = counter.wrapping_sub(self.counter) as i16;
        self.counter = counter;
        self.counts = self.counts.saturating_add(i32::from(moved));
        self.position()
    }

    /// Where the machine is. Saturates at the ends of what nanometres can say.
    #[inline]
    pub fn position(&self) -> Nanometres {
        let limit = self.scale.limit_counts;
        // Within 2³¹ nm by the limit, so the product is within 2⁵⁶.
        let counts = i64::from(self.counts.max(-limit).min(limit));
        let position = ((counts * self.scale.nm_per_count) >> FRACTION_BITS) + i64::from(self.reference.0);
        Nanometres(position.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32)
    }

    /// Whether the machine is further from its setpoint than the window.
    #[inline]
    pub fn is_off(&self, position: Nanometres, setpoint: Nanometres) -> bool {
        position.0.abs_diff(setpoint.0) > self.scale.window_nm.unsigned_abs()
    }

    /// Says that the machine now is at `position`.
    pub fn set_reference(&mut self, position: Nanometres) {
        self.counts = 0;
        self.reference = position;
    }
}
