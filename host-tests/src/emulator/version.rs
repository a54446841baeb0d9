//! Which emulator is good enough.

use std::path::Path;
use std::process::Command;

use super::error::EmulatorError;

/// Oldest major version whose USART raises transmit interrupts, which the firmware's buffered
/// serial port depends on. (7.2, in Debian 12, has none and stays silent.)
pub const OLDEST_MAJOR: u32 = 10;

/// Version of an emulator, major and minor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct QemuVersion {
    /// Major version.
    pub major: u32,
    /// Minor version.
    pub minor: u32,
}

impl std::fmt::Display for QemuVersion {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}.{}", self.major, self.minor)
    }
}

impl QemuVersion {
    /// Reads the output of `--version`: `QEMU emulator version 10.0.2 (Debian ...)`.
    pub fn parse(output: &str) -> Option<Self> {
        let (_, rest) = output.split_once("version ")?;
        let mut numbers =
            rest.split(|c: char| !c.is_ascii_digit() && c != '.').next()?.split('.').map(str::parse);
        Some(Self { major: numbers.next()?.ok()?, minor: numbers.next()?.ok()? })
    }
}

/// Asks `qemu` for its version and refuses an old one.
pub(super) fn check(qemu: &Path) -> Result<QemuVersion, EmulatorError> {
    let output = Command::new(qemu)
        .arg("--version")
        .output()
        .map_err(|source| EmulatorError::NotFound { program: qemu.to_owned(), source })?;
    let text = String::from_utf8_lossy(&output.stdout);
    match QemuVersion::parse(&text) {
        Some(version) if version.major >= OLDEST_MAJOR => Ok(version),
        found => Err(EmulatorError::TooOld {
            program: qemu.to_owned(),
            found: found.map_or_else(|| "an unknown version".to_owned(), |v| v.to_string()),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read_from_what_distributions_print() {
        let table = [
            ("QEMU emulator version 10.0.2 (Debian 1:10.0.2+ds-2)\nCopyright", 10, 0),
            ("QEMU emulator version 7.2.17 (Debian 1:7.2+dfsg-7)", 7, 2),
            ("QEMU emulator version 10.1.0-rc2", 10, 1),
            ("QEMU emulator version 11.0\n", 11, 0),
        ];
        for (text, major, minor) in table {
            assert_eq!(QemuVersion::parse(text), Some(QemuVersion { major, minor }), "{text}");
        }
        for text in ["", "QEMU", "version ", "version x.y", "version 10"] {
            assert_eq!(QemuVersion::parse(text), None, "{text:?}");
        }
    }
}
