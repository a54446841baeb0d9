//! How a timer with a repetition counter makes a train of steps: the numbers that go into its registers.
//!
//! As step and direction the first channel has a pulse per period, in the period's second half. As quadrature
//! both channels toggle once per period, a half of it apart; which comes first is the direction. Both have
//! toggled equally often at the end of a train, so a whole train leaves A and B equal, as it found them.

use crate::settings::PulseKind;

/// What has to be set up in the hardware before trains can be made, as one number that hardware and tick
/// compare; zero without step pulses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PulseConfiguration(pub u32);

impl PulseConfiguration {
    const KIND_SHIFT: u32 = 16;
    const ACTIVE_LOW: u32 = 1 << 18;

    /// The timer counts every `prescaler + 1` of its clocks.
    pub fn new(kind: PulseKind, prescaler: u16, active_low: bool) -> Self {
        let polarity = if active_low && kind == PulseKind::Step { Self::ACTIVE_LOW } else { 0 };
        match kind {
            PulseKind::Off => Self(0),
            PulseKind::Step => Self(u32::from(prescaler) | 1 << Self::KIND_SHIFT | polarity),
            PulseKind::Quadrature => Self(u32::from(prescaler) | 2 << Self::KIND_SHIFT),
        }
    }

    /// How steps are put out.
    #[inline]
    pub fn kind(self) -> PulseKind {
        match (self.0 >> Self::KIND_SHIFT) & 3 {
            0 => PulseKind::Off,
            1 => PulseKind::Step,
            _ => PulseKind::Quadrature,
        }
    }

    /// The timer counts every so many of its clocks, less one.
    pub fn prescaler(self) -> u16 {
        (self.0 & 0xffff) as u16
    }

    /// Whether a pulse is a low level.
    pub fn active_low(self) -> bool {
        self.0 & Self::ACTIVE_LOW != 0
    }
}

/// The registers of one train.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainRegisters {
    /// Where the first channel compares: the step, or A.
    pub first: u16,
    /// Where the second compares: B. The direction is no channel.
    pub second: u16,
    /// The last count of a period.
    pub reload: u16,
    /// Periods less one.
    pub repetitions: u8,
}

impl TrainRegisters {
    /// `steps` steps, at least one and at most 256 either way, of `period` counts each, which is at least 4.
    #[inline]
    pub fn new(kind: PulseKind, steps: i16, period: u16) -> Self {
        let (early, late) = (period / 4, period - period / 4);
        let (first, second) = match kind {
            PulseKind::Quadrature if steps > 0 => (early, late),
            PulseKind::Quadrature => (late, early),
            // An even share of the period is pause and pulse.
            PulseKind::Step | PulseKind::Off => (period - period / 2, 0),
        };
        let repetitions = (steps.unsigned_abs() - 1) as u8;
        Self { first, second, reload: period - 1, repetitions }
    }
}
