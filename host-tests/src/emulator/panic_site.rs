//! A place in an image that panics, so that a test can send the processor there.

use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol};

use super::error::EmulatorError;

/// Where an image is about to panic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PanicSite {
    /// The first of the instructions that name the place and call the panic.
    pub address: u32,
    /// Where in memory the place is: `core::panic::Location`, of which the first three words are the address
    /// and length of the file's name and the line.
    pub location: u32,
}

/// Finds the first place of this form in an image: `movw rN, low; movt rN, high; bl core::panicking::...`.
///
/// # Errors
/// [`EmulatorError::Image`] where the image cannot be read or has none.
pub fn find(image: &Path) -> Result<PanicSite, EmulatorError> {
    let fail = |reason: String| EmulatorError::Image { image: image.to_owned(), reason };
    let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
    let targets: Vec<u32> = file
        .symbols()
        .filter(|symbol| symbol.name().is_ok_and(|name| name.contains("4core9panicking")))
        .filter_map(|symbol| Some(u32::try_from(symbol.address()).ok()? & !1))
        .collect();
    let text = file.section_by_name(".text").ok_or_else(|| fail("it has no .text".to_owned()))?;
    let start = u32::try_from(text.address()).map_err(|error| fail(error.to_string()))?;
    let code = text.data().map_err(|error| fail(error.to_string()))?;
    let halfwords: Vec<u16> = code.as_chunks::<2>().0.iter().map(|pair| u16::from_le_bytes(*pair)).collect();
    let site = halfwords.windows(6).zip((start..).step_by(2)).find_map(|(window, address)| {
        let [low, low_rest, high, high_rest, call, call_rest] = *window else { return None };
        let (low_register, low) = move_half(0xf240, low, low_rest)?;
        let (high_register, high) = move_half(0xf2c0, high, high_rest)?;
        let target = call_target(address + 8, call, call_rest)?;
        let is_panic = low_register == high_register && low_register <= 2 && targets.contains(&target);
        is_panic.then_some(PanicSite { address, location: u32::from(high) << 16 | u32::from(low) })
    });
    site.ok_or_else(|| fail("no call of a panic was found in it".to_owned()))
}

/// The register and the number of `movw` (0xf240) or `movt` (0xf2c0).
fn move_half(opcode: u16, first: u16, second: u16) -> Option<(u16, u16)> {
    if first & 0xfbf0 != opcode || second & 0x8000 != 0 {
        return None;
    }
    let number = (first & 0xf) << 12 | (first & 0x400) << 1 | (second & 0x7000) >> 4 | second & 0xff;
    Some((second >> 8 & 0xf, number))
}

/// Where a `bl` at `address` goes.
fn call_target(address: u32, first: u16, second: u16) -> Option<u32> {
    if first & 0xf800 != 0xf000 || second & 0xd000 != 0xd000 {
        return None;
    }
    let (first, second) = (u32::from(first), u32::from(second));
    let sign = first >> 10 & 1;
    let bit = |place: u32| 1 ^ (second >> place & 1) ^ sign;
    let offset = sign << 24 | bit(13) << 23 | bit(11) << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
    // 25 bits with a sign, relative to the next but one halfword pair.
    let signed = (offset << 7).cast_signed() >> 7;
    Some(address.wrapping_add(4).wrapping_add_signed(signed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_are_read_as_the_manual_has_them() {
        // movw r0, #52408; movt r0, #2050 at 0x8003fb8.
        assert_eq!(move_half(0xf240, 0xf64c, 0x40b8), Some((0, 52408)));
        assert_eq!(move_half(0xf2c0, 0xf6c0, 0x0002), Some((0, 2050)));
        assert_eq!(move_half(0xf240, 0xf6c0, 0x0002), None, "the other one");
        assert_eq!(call_target(0x0800_3fc0, 0xf004, 0xfc9d), Some(0x0800_88fe));
        // bl back to itself less four, and one forward.
        assert_eq!(call_target(0x0800_0100, 0xf7ff, 0xfffe), Some(0x0800_0100));
        assert_eq!(call_target(0x0800_0100, 0xf000, 0xf800), Some(0x0800_0104));
        assert_eq!(call_target(0x0800_0100, 0xf000, 0xb800), None, "a branch without return");
    }
}
