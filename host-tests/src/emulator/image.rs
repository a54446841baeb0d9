//! What the driver needs to know about an image: where its start-up ends, and names for addresses.

use std::path::Path;

use object::{Object, ObjectSymbol, SymbolKind};

use super::error::EmulatorError;

/// The function (`#[unsafe(no_mangle)] extern "C"`) that an image calls once its clocks and
/// peripherals are configured.
pub const BOOT_COMPLETE_SYMBOL: &str = "stillbeam_boot_complete";

/// Address (even) of the function `name` of the image.
///
/// # Errors
///
/// [`EmulatorError::Image`] where the image cannot be read or has no such function.
pub fn function_address(image: &Path, name: &str) -> Result<u32, EmulatorError> {
    let symbols = ImageSymbols::read(image)?;
    symbols.functions.iter().find(|(_, _, own)| own == name).map(|(start, _, _)| *start).ok_or_else(|| {
        EmulatorError::Image { image: image.to_owned(), reason: format!("it has no function `{name}`") }
    })
}

/// Address of the image's static `name`, whatever module it is in.
///
/// # Errors
///
/// [`EmulatorError::Image`] where the image cannot be read or has no such static.
pub fn static_address(image: &Path, name: &str) -> Result<u32, EmulatorError> {
    let fail = |reason: String| EmulatorError::Image { image: image.to_owned(), reason };
    let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
    // As the compiler mangles the last part of a path: its length before it, a hash behind.
    let mangled = format!("{}{name}17h", name.len());
    let found = file.symbols().find(|symbol| {
        symbol.kind() == SymbolKind::Data && symbol.name().is_ok_and(|own| own.contains(&mangled))
    });
    let address = found.and_then(|symbol| u32::try_from(symbol.address()).ok());
    address.ok_or_else(|| fail(format!("it has no static `{name}`")))
}

/// The functions of an image.
#[derive(Debug)]
pub(super) struct ImageSymbols {
    boot_complete: u32,
    /// Start, length and name, ascending.
    functions: Vec<(u32, u32, String)>,
}

impl ImageSymbols {
    /// Reads an ELF file.
    pub(super) fn read(image: &Path) -> Result<Self, EmulatorError> {
        let fail = |reason: String| EmulatorError::Image { image: image.to_owned(), reason };
        let bytes = std::fs::read(image).map_err(|error| {
            fail(format!("{error}; `cargo xtask firmware` builds it and prints its path"))
        })?;
        let file = object::File::parse(bytes.as_slice())
            .map_err(|error| fail(format!("not an ELF file ({error})")))?;
        if file.architecture() != object::Architecture::Arm {
            return Err(fail(format!(
                "built for {:?}, not for the board; use the path `cargo xtask firmware` prints",
                file.architecture()
            )));
        }
        let functions: Vec<_> = file
            .symbols()
            .filter(|symbol| symbol.kind() == SymbolKind::Text)
            .filter_map(|symbol| {
                // Bit 0 of a function's address says "Thumb"; addresses on this core are 32 bits.
                let start = u32::try_from(symbol.address()).ok()? & !1;
                let length = u32::try_from(symbol.size()).ok()?;
                Some((start, length, symbol.name().ok()?.to_owned()))
            })
            .collect();
        Self::of_functions(functions).ok_or_else(|| {
            fail(format!(
                "it has no function `{BOOT_COMPLETE_SYMBOL}`, which tells the driver that the start-up is over"
            ))
        })
    }

    /// From starts, lengths and names; `None` without [`BOOT_COMPLETE_SYMBOL`].
    pub(super) fn of_functions(mut functions: Vec<(u32, u32, String)>) -> Option<Self> {
        functions.sort();
        let boot_complete =
            functions.iter().find(|(_, _, name)| name == BOOT_COMPLETE_SYMBOL).map(|(start, _, _)| *start)?;
        Some(Self { boot_complete, functions })
    }

    /// Address of [`BOOT_COMPLETE_SYMBOL`], even.
    pub(super) fn boot_complete(&self) -> u32 {
        self.boot_complete
    }

    /// `address` with the function around it, for messages.
    pub(super) fn describe(&self, address: u32) -> String {
        let after = self.functions.partition_point(|(start, _, _)| *start <= address);
        let around = self
            .functions
            .get(..after)
            .unwrap_or_default()
            .iter()
            .rev()
            .find(|(start, length, _)| address - start < (*length).max(2));
        match around {
            Some((start, _, name)) => format!("{address:#010x} ({name}+{:#x})", address - start),
            None => format!("{address:#010x}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_not_images_are_refused_with_a_reason() {
        let missing = ImageSymbols::read(Path::new("no/such/image")).expect_err("absent");
        assert!(missing.to_string().contains("cargo xtask firmware"), "{missing}");
        let own = std::env::current_exe().expect("this test");
        let host = ImageSymbols::read(&own).expect_err("a host program");
        assert!(host.to_string().contains("not for the board"), "{host}");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let text = ImageSymbols::read(&source).expect_err("a text file");
        assert!(text.to_string().contains("not an ELF file"), "{text}");
    }

    #[test]
    fn addresses_are_described_by_the_function_around_them() {
        let symbols = ImageSymbols {
            boot_complete: 0x0800_0400,
            functions: vec![(0x0800_0400, 0x10, "first".to_owned()), (0x0800_0420, 0, "sizeless".to_owned())],
        };
        assert_eq!(symbols.describe(0x0800_0404), "0x08000404 (first+0x4)");
        assert_eq!(symbols.describe(0x0800_0410), "0x08000410");
        assert_eq!(symbols.describe(0x0800_0420), "0x08000420 (sizeless+0x0)");
        assert_eq!(symbols.describe(0x0000_0000), "0x00000000");
    }
}
