//! The supply voltage below which the chip keeps itself in reset, as its option bytes say.

use core::fmt;

/// A level of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BrownOut {
    /// None but that of power-on: 1.8 V, at which nothing that runs at 168 MHz is right.
    Off,
    /// 2.2 V.
    Level1,
    /// 2.5 V.
    Level2,
    /// 2.8 V.
    Level3,
}

impl BrownOut {
    const ALL: [Self; 4] = [Self::Off, Self::Level1, Self::Level2, Self::Level3];

    /// The level of two bits in the option bytes (RM0090, BOR_LEV), where all ones are off.
    pub fn from_bits(bits: u8) -> Self {
        match bits & 3 {
            0 => Self::Level3,
            1 => Self::Level2,
            2 => Self::Level1,
            _ => Self::Off,
        }
    }

    /// The bits of a level.
    pub fn bits(self) -> u8 {
        match self {
            Self::Level3 => 0,
            Self::Level2 => 1,
            Self::Level1 => 2,
            Self::Off => 3,
        }
    }

    /// The word on the console.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Level1 => "level_1",
            Self::Level2 => "level_2",
            Self::Level3 => "level_3",
        }
    }

    /// The level of a word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|level| level.name() == name)
    }
}

impl fmt::Display for BrownOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_words_are_those_of_one_level_each() {
        for level in BrownOut::ALL {
            assert_eq!(BrownOut::from_bits(level.bits()), level);
            assert_eq!(BrownOut::from_name(level.name()), Some(level));
        }
        assert_eq!(BrownOut::from_name("level_4"), None);
    }
}
