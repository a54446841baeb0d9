//! Which file format it is: by content, or as asked.

use std::fmt;
use std::str::FromStr;

use crate::error::Problem;
use crate::{klipper, lvm, mat, named, npy, octave, table};

/// The file formats that are read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Comma-separated text with a header of column names that end in units.
    Csv,
    /// Klipper's raw accelerometer log: `#time,accel_x,accel_y,accel_z` in s and mm/s².
    Klipper,
    /// RepRapFirmware's accelerometer log (M956): `Sample,X,Y,Z` in g, the rate in the last line.
    RepRap,
    /// LabVIEW measurement file, as text.
    Lvm,
    /// Universal file, data set 58: functions at nodal degrees of freedom, as text.
    Uff58,
    /// Universal file, data set 58b: the same with binary values.
    Uff58b,
    /// MATLAB MAT-file of level 5, as `save` writes it with `-v6` or (compressed) `-v7`, or of level 4.
    Mat,
    /// Octave's text format, as its `save` writes it by default.
    Octave,
    /// A NumPy array.
    Npy,
    /// RIFF/WAVE audio.
    Wav,
    /// The recording as one JSON object.
    Json,
}

/// Every format with its name on the command line, the usual end of a file's name, and whether it is read
/// and written.
const FORMATS: [(Format, &str, &str, [bool; 2]); 11] = [
    (Format::Csv, "csv", "csv", [true, true]),
    (Format::Klipper, "klipper", "csv", [true, false]),
    (Format::RepRap, "reprap", "csv", [true, false]),
    (Format::Lvm, "lvm", "lvm", [true, false]),
    (Format::Uff58, "uff58", "uff", [true, true]),
    (Format::Uff58b, "uff58b", "uff", [true, true]),
    (Format::Mat, "mat", "mat", [true, false]),
    (Format::Octave, "octave", "txt", [true, false]),
    (Format::Npy, "npy", "npy", [true, false]),
    (Format::Wav, "wav", "wav", [true, false]),
    (Format::Json, "json", "json", [true, true]),
];

/// Ends of file names that mean a universal file.
const UFF_EXTENSIONS: [&str; 3] = ["uff", "unv", "uf"];

/// Bytes of a file that are looked at to tell text from binary.
const LOOKED_AT: usize = 4096;

impl Format {
    /// Names of the formats that can be read, for messages.
    pub fn readable() -> Vec<&'static str> {
        FORMATS.iter().filter(|entry| entry.3[0]).map(|entry| entry.1).collect()
    }

    /// Names of the formats that can be written, for messages.
    pub fn writable() -> Vec<&'static str> {
        FORMATS.iter().filter(|entry| entry.3[1]).map(|entry| entry.1).collect()
    }

    /// The format that a file's name ends in: `csv`, `uff`, `unv`, `mat`, `wav`, `json`.
    pub fn of_extension(extension: &str) -> Option<Self> {
        let extension = extension.to_ascii_lowercase();
        if UFF_EXTENSIONS.contains(&extension.as_str()) {
            return Some(Self::Uff58);
        }
        FORMATS.iter().find(|entry| entry.2 == extension).map(|entry| entry.0)
    }

    /// The format that the bytes show, whatever the file is called.
    ///
    /// # Errors
    /// [`Problem::UnknownFormat`] for bytes that are none of them, with what they look like instead.
    pub fn detect(bytes: &[u8]) -> Result<Self, Problem> {
        if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WAVE") {
            return Ok(Self::Wav);
        }
        if let Some(looks_like) = named::looks_like(bytes) {
            return Err(Problem::UnknownFormat { looks_like });
        }
        if bytes.starts_with(npy::SIGNATURE) {
            return Ok(Self::Npy);
        }
        if matches!(bytes.get(126..128), Some(b"IM" | b"MI")) || mat::is_level_4(bytes) {
            return Ok(Self::Mat);
        }
        let start = bytes.get(..LOOKED_AT).unwrap_or(bytes);
        if let Some(binary) = universal_file(start) {
            return Ok(if binary { Self::Uff58b } else { Self::Uff58 });
        }
        if !start.starts_with(b"time_s") && !table::is_text(start) {
            let looks_like = "binary data; convert it to one of the formats that can be read";
            return Err(Problem::UnknownFormat { looks_like });
        }
        let (text, _) = table::decode(start);
        let text = text.trim_start();
        if text.starts_with(lvm::SIGNATURE) {
            return Ok(Self::Lvm);
        }
        if octave::is_octave(text) {
            return Ok(Self::Octave);
        }
        if text.starts_with('{') || text.starts_with("[{") || text.starts_with("[\n") {
            return Ok(Self::Json);
        }
        Ok(klipper::detect(text).unwrap_or(Self::Csv))
    }
}

/// Whether text begins as a universal file does, a line `-1` and then a data set's number, and if so whether
/// its first data set of functions has binary values.
fn universal_file(start: &[u8]) -> Option<bool> {
    let mut lines = start.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty())?;
    let number = lines.find(|line| *line != b"-1")?;
    let digits = number.iter().take_while(|byte| byte.is_ascii_digit()).count();
    if first != b"-1" || digits == 0 {
        return None;
    }
    let numbers = std::iter::once(number).chain(lines);
    Some(numbers.take(60).any(|line| line.starts_with(b"58b") || line.starts_with(b"58B")))
}

impl fmt::Display for Format {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = FORMATS.iter().find(|entry| entry.0 == *self).map_or("", |entry| entry.1);
        formatter.write_str(name)
    }
}

impl FromStr for Format {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = FORMATS.iter().find(|entry| entry.1 == text.to_ascii_lowercase());
        found.map(|entry| entry.0).ok_or_else(|| {
            let names: Vec<&str> = FORMATS.iter().map(|entry| entry.1).collect();
            format!("`{text}` is no format; the formats are {}", names.join(", "))
        })
    }
}
