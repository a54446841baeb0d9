//! What enabling needs and is not there.

use core::fmt;

/// A set of things that are lacking. Empty when `enable` would do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lacking(pub u8);

impl Lacking {
    /// The stored settings could not be read whole, and nobody has confirmed what runs.
    pub const SETTINGS: Self = Self(1);
    /// Nobody has said what stops the machine in an emergency.
    pub const EMERGENCY_SETTING: Self = Self(2);
    /// Nobody has said where the machine is.
    pub const POSITION: Self = Self(4);
    /// An emergency input is active.
    pub const EMERGENCY_RELEASED: Self = Self(8);
    /// The drive's ready output is not there, or its fault output is.
    pub const DRIVE_READY: Self = Self(16);

    /// Every single one, with its word in `status` and what to do about it.
    pub const ALL: [(Self, &'static str, &'static str); 5] = [
        (
            Self::SETTINGS,
            "settings",
            "the stored settings are damaged ('info' names what); look at them with 'get', then 'settings confirm'",
        ),
        (
            Self::EMERGENCY_SETTING,
            "emergency_input",
            "nobody has said what stops the machine in an emergency; set emergency.input to high, low or waived and apply",
        ),
        (
            Self::POSITION,
            "position",
            "the position is not known; say where the machine stands with 'position set MM'",
        ),
        (Self::EMERGENCY_RELEASED, "emergency_released", "an emergency input is active; release it first"),
        (Self::DRIVE_READY, "drive_ready", "the drive does not say that it is ready, or reports a fault"),
    ];

    /// Nothing is lacking.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `other` are lacking.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The same with `other`, if `lacks`.
    #[must_use]
    pub fn with(self, other: Self, lacks: bool) -> Self {
        if lacks { Self(self.0 | other.0) } else { self }
    }

    /// What to do first.
    pub fn remedy(self) -> Option<&'static str> {
        Self::ALL.iter().find(|(one, ..)| self.contains(*one)).map(|(.., remedy)| *remedy)
    }
}

/// The words, or `nothing`.
impl fmt::Display for Lacking {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words = Self::ALL.iter().filter(|(one, ..)| self.contains(*one)).map(|(_, word, _)| word);
        match words.next() {
            None => f.write_str("nothing"),
            Some(first) => {
                f.write_str(first)?;
                words.try_for_each(|word| write!(f, " {word}"))
            }
        }
    }
}
