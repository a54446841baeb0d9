//! How deep the stack has been: it is filled with a pattern before the image starts, and looked at
//! afterwards.

use std::io::{Read, Write};
use std::path::Path;

use object::{Object, ObjectSymbol};

use super::error::EmulatorError;
use super::rsp::{RspClient, RspError};

/// Not a likely value of code, data or addresses.
const PATTERN: u8 = 0xa5;
/// Bytes per packet of the debug link, which takes 4096 characters.
const CHUNK: usize = 1024;

/// Where the stack lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StackRegion {
    /// Lowest address.
    pub low: u32,
    /// The address above, where it begins to grow down.
    pub high: u32,
}

impl StackRegion {
    /// From the image's linker symbols `_stack_end` and `_stack_start`.
    pub(super) fn read(image: &Path) -> Result<Self, EmulatorError> {
        let fail = |reason: String| EmulatorError::Image { image: image.to_owned(), reason };
        let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
        let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
        let address = |name: &str| {
            let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
            let address = symbol.and_then(|symbol| u32::try_from(symbol.address()).ok());
            address.ok_or_else(|| fail(format!("it has no linker symbol `{name}` (see memory.x)")))
        };
        let region = Self { low: address("_stack_end")?, high: address("_stack_start")? };
        if region.low < region.high { Ok(region) } else { Err(fail(format!("no stack: {region:?}"))) }
    }

    /// Fills the whole stack with the pattern. The CPU must not have started.
    pub(super) fn paint<S: Read + Write>(self, client: &mut RspClient<S>) -> Result<(), RspError> {
        for address in (self.low..self.high).step_by(CHUNK) {
            let length = CHUNK.min((self.high - address) as usize);
            client.write_memory(address, &vec![PATTERN; length])?;
        }
        Ok(())
    }

    /// The most bytes that have been in use since it was painted.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails.
    pub fn deepest<S: Read + Write>(self, client: &mut RspClient<S>) -> Result<u32, RspError> {
        for address in (self.low..self.high).step_by(CHUNK) {
            let length = CHUNK.min((self.high - address) as usize);
            let untouched =
                client.memory(address, length)?.iter().take_while(|byte| **byte == PATTERN).count();
            if untouched < length {
                return Ok(self.high - address - untouched as u32);
            }
        }
        Ok(0)
    }
}
