//! The table's CRC as it is written in files and on the console.

use std::fmt;

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::design::StageEntry;

/// A CRC-32 (ISO-HDLC), written `0x` and eight hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crc32(pub u32);

impl Crc32 {
    /// The CRC over stages as the board computes it: for each stage the number of taps, then each tap's delay
    /// and weight, all as 32-bit little-endian words.
    pub fn of_stages(stages: &[StageEntry]) -> Self {
        let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
        let mut digest = crc.digest();
        for stage in stages {
            // More taps than that do not fit into memory, let alone into a table.
            let taps = u32::try_from(stage.taps.len()).unwrap_or(u32::MAX);
            digest.update(&taps.to_le_bytes());
            for tap in &stage.taps {
                digest.update(&tap.delay_ticks.to_le_bytes());
                digest.update(&tap.weight.to_le_bytes());
            }
        }
        Self(digest.finalize())
    }

    /// Reads `0x1234abcd`; `None` when the text is anything else.
    pub fn parse(text: &str) -> Option<Self> {
        let digits = text.strip_prefix("0x")?;
        // `from_str_radix` would take a sign.
        if digits.len() != 8 || !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return None;
        }
        u32::from_str_radix(digits, 16).ok().map(Self)
    }
}

impl fmt::Display for Crc32 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:08x}", self.0)
    }
}

impl Serialize for Crc32 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Crc32 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).ok_or_else(|| {
            serde::de::Error::custom(format!("crc32 \"{text}\" is not \"0x\" and eight hexadecimal digits"))
        })
    }
}
