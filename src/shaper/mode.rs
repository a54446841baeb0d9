//! What a stage is designed for: one mode of the machine and the type of its shaper.

use core::fmt;
use core::str::FromStr;

use crate::decimal::Decimal;
use crate::units::TickRate;

/// Which shaper a mode gets. [`super::pattern`] has their amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ShaperType {
    /// Zero vibration: two impulses, eq. (30) of the paper.
    Zv,
    /// Zero vibration and derivative: three impulses, eq. (31).
    Zvd,
    /// Zero vibration and two derivatives: four impulses, eq. (32).
    Zvdd,
    /// Zero vibration and three derivatives: five impulses.
    Zvddd,
    /// Extra insensitive: three impulses that leave up to 5 % over a wider band than ZVD's, the 5 % at the
    /// mode itself included.
    Ei,
    /// Two-hump extra insensitive: four impulses, nothing left at the mode, up to 5 % on either side of it.
    Ei2,
    /// Three-hump extra insensitive: five impulses, the widest band.
    Ei3,
    /// Modified zero vibration: three impulses in three quarters of a period, between ZV and ZVD.
    Mzv,
}

impl ShaperType {
    /// Every type: the zero-vibration family, then the extra-insensitive one, each shortest first, then MZV.
    pub const ALL: [Self; 8] =
        [Self::Zv, Self::Zvd, Self::Zvdd, Self::Zvddd, Self::Ei, Self::Ei2, Self::Ei3, Self::Mzv];

    /// The name used on the console, in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zv => "zv",
            Self::Zvd => "zvd",
            Self::Zvdd => "zvdd",
            Self::Zvddd => "zvddd",
            Self::Ei => "ei",
            Self::Ei2 => "ei2",
            Self::Ei3 => "ei3",
            Self::Mzv => "mzv",
        }
    }

    /// For ZV and its powers, how often the shaper's zero sits on the mode's pole: 1 to 4. The others are no
    /// powers of ZV.
    pub fn power_of_zv(self) -> Option<u32> {
        match self {
            Self::Zv => Some(1),
            Self::Zvd => Some(2),
            Self::Zvdd => Some(3),
            Self::Zvddd => Some(4),
            Self::Ei | Self::Ei2 | Self::Ei3 | Self::Mzv => None,
        }
    }
}

impl fmt::Display for ShaperType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Prints the names of all types as in a sentence: `zv, zvd, ... or mzv`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownTypes;

impl fmt::Display for KnownTypes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = ShaperType::ALL.len() - 1;
        for (place, kind) in ShaperType::ALL.into_iter().enumerate() {
            let before = if place == 0 {
                ""
            } else if place == last {
                " or "
            } else {
                ", "
            };
            write!(f, "{before}{kind}")?;
        }
        Ok(())
    }
}

/// A shaper type that does not exist. The message lists those that do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownShaperType;

impl fmt::Display for UnknownShaperType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "unknown shaper type; use {KnownTypes}")
    }
}

impl core::error::Error for UnknownShaperType {}

impl FromStr for ShaperType {
    type Err = UnknownShaperType;

    fn from_str(text: &str) -> Result<Self, UnknownShaperType> {
        Self::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(text)).ok_or(UnknownShaperType)
    }
}

/// One mode of the machine and the shaper that is to keep it still. Valid by construction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    frequency_hz: f64,
    damping_ratio: f64,
    shaper: ShaperType,
}

impl Mode {
    /// The lowest frequency that any tick rate and any memory could shape, in hertz.
    pub const MIN_FREQUENCY_HZ: f64 = 0.01;

    /// The largest damping ratio. Past it a mode has died away by a factor of 650 after half a period, and
    /// there is nothing to shape.
    pub const MAX_DAMPING_RATIO: f64 = 0.9;

    /// A mode with undamped natural frequency `frequency_hz` and `damping_ratio` from zero to
    /// [`Self::MAX_DAMPING_RATIO`].
    pub fn new(frequency_hz: f64, damping_ratio: f64, shaper: ShaperType) -> Result<Self, ModeError> {
        if !frequency_hz.is_finite() || frequency_hz < Self::MIN_FREQUENCY_HZ {
            return Err(ModeError::Frequency { frequency_hz });
        }
        if !(0.0..=Self::MAX_DAMPING_RATIO).contains(&damping_ratio) {
            return Err(ModeError::DampingRatio { damping_ratio });
        }
        Ok(Self { frequency_hz, damping_ratio, shaper })
    }

    /// Undamped natural frequency ω/2π in hertz.
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// Damping ratio ζ.
    pub fn damping_ratio(&self) -> f64 {
        self.damping_ratio
    }

    /// The type of this mode's shaper.
    pub fn shaper(&self) -> ShaperType {
        self.shaper
    }

    /// Undamped natural frequency ω in rad/s.
    pub fn omega(&self) -> f64 {
        core::f64::consts::TAU * self.frequency_hz
    }

    /// Damped natural frequency ω_d = ω √(1 − ζ²) in rad/s.
    pub fn omega_damped(&self) -> f64 {
        self.omega() * libm::sqrt(1.0 - self.damping_ratio * self.damping_ratio)
    }

    /// Half a damped period, π/ω_d, in seconds: the unit that shapers are measured in.
    pub fn half_period_s(&self) -> f64 {
        core::f64::consts::PI / self.omega_damped()
    }

    /// K of eqs. (30)–(32): what is left of a free oscillation after half a damped period.
    pub fn decay_per_half_period(&self) -> f64 {
        self.decay_over(1.0)
    }

    /// What is left of a free oscillation after so many half damped periods.
    pub fn decay_over(&self, half_periods: f64) -> f64 {
        libm::exp(-self.damping_ratio * self.omega() * self.half_period_s() * half_periods)
    }
}

/// Why a mode cannot be shaped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModeError {
    /// The frequency is not a usable number of hertz.
    Frequency {
        /// The refused value.
        frequency_hz: f64,
    },
    /// The damping ratio is negative, too large or not a number.
    DampingRatio {
        /// The refused value.
        damping_ratio: f64,
    },
    /// The mode rings at or above half the tick rate, so ticks cannot describe it.
    AboveNyquist {
        /// The mode's frequency.
        frequency_hz: f64,
        /// The rate it was to be shaped at.
        tick_rate: TickRate,
    },
}

impl fmt::Display for ModeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency { frequency_hz } => {
                write!(
                    f,
                    "frequency {} Hz must be finite and at least {} Hz",
                    Decimal(*frequency_hz),
                    Decimal(Mode::MIN_FREQUENCY_HZ)
                )
            }
            Self::DampingRatio { damping_ratio } => {
                write!(
                    f,
                    "damping ratio {} must be from 0 to {}",
                    Decimal(*damping_ratio),
                    Decimal(Mode::MAX_DAMPING_RATIO)
                )
            }
            Self::AboveNyquist { frequency_hz, tick_rate } => write!(
                f,
                "frequency {} Hz must be below half the tick rate, {} Hz",
                Decimal(*frequency_hz),
                Decimal(tick_rate.hz() / 2.0)
            ),
        }
    }
}

impl core::error::Error for ModeError {}
