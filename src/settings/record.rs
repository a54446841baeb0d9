//! A setting as bytes in the flash.
//!
//! | bytes | meaning |
//! |---|---|
//! | 1 | id of the setting; a number once given is never given to another |
//! | 1 | format of what follows: [`FORMAT`] |
//! | 8 | a number: IEEE 754 double, least significant byte first, in the key's unit |
//! | or 1 | a shaper type: 0 off, 1 ZV, 2 ZVD, 3 ZVDD, 4 ZVDDD, 5 EI, 6 two-hump EI, 7 three-hump EI, 8 MZV |
//! | or 1 | a word: its place in the key's list, from zero |
//! | or 8, and more | the uploaded table, [`TABLE`]: its tick rate in hertz as such a number, then its bytes ([`crate::shaper::wire`]) |
//!
//! Length and CRC-32 are the store's. A record of more than [`MAX_BYTES`] bytes will never be written.

use super::{Choice, Key, ModeKey, Value};
use crate::shaper::wire::MAX_TABLE_BYTES;
use crate::shaper::{ShaperType, UploadedTable};
use crate::units::TickRate;

/// The version of the bytes after the id.
pub const FORMAT: u8 = 1;

/// The most bytes a record of this or a later firmware may have, id included.
pub const MAX_BYTES: usize = 600;
const _: () = assert!(MAX_BYTES >= 2 + 8 + MAX_TABLE_BYTES);

/// A setting's bytes after the id.
pub type Bytes = heapless::Vec<u8, 16>;

/// The uploaded table's bytes after the id.
pub type TableBytes = heapless::Vec<u8, MAX_BYTES>;

/// The id of the uploaded table, which is no setting.
pub const TABLE: u8 = 33;

/// The id of the seal over all other records ([`super::seal`]).
pub const SEAL: u8 = 128;

const FIRST_OF_MODES: u8 = 16;
/// Ids per mode; the last of them is one of homing's.
const PER_MODE: u8 = 4;

impl Key {
    /// The setting's number in the flash, below 64.
    pub fn id(self) -> u8 {
        match self {
            Self::TickRate => 1,
            Self::Velocity => 2,
            Self::Acceleration => 3,
            Self::TravelMin => 4,
            Self::TravelMax => 5,
            Self::StreamDecimation => 6,
            Self::AnalogFullScale => 7,
            Self::Profile => 8,
            Self::Jerk => 9,
            Self::MovingMass => 10,
            Self::Drive(key) => key.id(),
            Self::Safety(key) => key.id(),
            Self::Input(input, key) => key.id(input),
            Self::Source(key) => key.id(),
            Self::Homing(key) => key.id(),
            Self::ShaperSource => 32,
            Self::Mode(index, part) => {
                let part = match part {
                    ModeKey::Frequency => 0,
                    ModeKey::DampingRatio => 1,
                    ModeKey::Type => 2,
                };
                FIRST_OF_MODES + PER_MODE * index as u8 + part
            }
        }
    }

    /// The setting of this number, if this firmware has it.
    pub fn from_id(id: u8) -> Option<Self> {
        Self::all().find(|key| key.id() == id)
    }
}

/// The bytes of a value.
pub fn encode(value: Value) -> Bytes {
    let mut bytes = Bytes::new();
    // Nine bytes at most, far fewer than there is room for.
    let _fits = match value {
        Value::Number(number) => {
            bytes.push(FORMAT).is_ok() && bytes.extend_from_slice(&number.to_le_bytes()).is_ok()
        }
        Value::Shaper(shaper) => bytes.extend_from_slice(&[FORMAT, shaper_code(shaper)]).is_ok(),
        Value::Word(choice) => bytes.extend_from_slice(&[FORMAT, choice.place()]).is_ok(),
    };
    bytes
}

/// The value of a setting's bytes; `None` when they are of another format or length. The range is not
/// checked.
pub fn decode(key: Key, bytes: &[u8]) -> Option<Value> {
    let (&FORMAT, payload) = bytes.split_first()? else { return None };
    match (key, payload) {
        (Key::Mode(_, ModeKey::Type), [code]) => shaper(*code).map(Value::Shaper),
        (Key::Mode(_, ModeKey::Type), _) => None,
        (key, [place]) => {
            let words = key.words()?;
            (usize::from(*place) < words.len()).then(|| Value::Word(Choice::new(words, *place)))
        }
        (_, payload) => Some(Value::Number(f64::from_le_bytes(payload.try_into().ok()?))),
    }
}

/// The bytes of an uploaded table.
pub fn encode_table(table: &UploadedTable) -> TableBytes {
    let mut bytes = TableBytes::new();
    // See MAX_BYTES.
    let _fits = bytes.push(FORMAT).is_ok()
        && bytes.extend_from_slice(&table.tick_rate().hz().to_le_bytes()).is_ok()
        && bytes.extend_from_slice(table.bytes()).is_ok();
    bytes
}

/// The uploaded table of these bytes; `None` when they are of another format or make no table.
pub fn decode_table(bytes: &[u8]) -> Option<UploadedTable> {
    let (&FORMAT, payload) = bytes.split_first()? else { return None };
    let (rate_hz, bytes) = payload.split_first_chunk::<8>()?;
    UploadedTable::new(TickRate::from_hz(f64::from_le_bytes(*rate_hz))?, bytes).ok()
}

/// Numbers that are never given to another type.
fn shaper_code(shaper: Option<ShaperType>) -> u8 {
    match shaper {
        None => 0,
        Some(ShaperType::Zv) => 1,
        Some(ShaperType::Zvd) => 2,
        Some(ShaperType::Zvdd) => 3,
        Some(ShaperType::Zvddd) => 4,
        Some(ShaperType::Ei) => 5,
        Some(ShaperType::Ei2) => 6,
        Some(ShaperType::Ei3) => 7,
        Some(ShaperType::Mzv) => 8,
    }
}

fn shaper(code: u8) -> Option<Option<ShaperType>> {
    let every = ShaperType::ALL.into_iter().map(Some);
    core::iter::once(None).chain(every).find(|shaper| shaper_code(*shaper) == code)
}
