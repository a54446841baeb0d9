//! How long interrupts stay masked: every section between `cpsid i` and the `cpsie i` or `msr primask` that
//! ends it, counted instruction by instruction on the unmodified image.
//!
//! What is counted is what ran: a bound for the paths taken, not for all there are. A section inside a
//! section does not end the outer one, because it leaves interrupts as it found them.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use object::{Object, ObjectSection, SectionKind};

use super::error::EmulatorError;
use super::rsp::{RspClient, RspError};

const PC: u8 = 15;
/// `cpsid i`: interrupts off.
const MASK: [u8; 2] = [0x72, 0xb6];
/// `cpsie i`: interrupts on.
const UNMASK: u16 = 0xb662;
/// `msr primask, rN`, the register's number in the lowest bits of the first half: interrupts as they were.
const RESTORE: (u16, u16) = (0xf380, 0x8810);
/// More than any section takes; one that does not end stops here.
const LIMIT: u32 = 100_000;
/// Wall-clock limit for one instruction.
const STEP_LIMIT: Duration = Duration::from_secs(5);

/// Where an image masks interrupts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MaskingSites {
    /// Addresses of `cpsid i`. Constants that read like one may be among them; they are never executed.
    pub addresses: BTreeSet<u32>,
}

/// What was counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MaskedSections {
    /// How many sections ran.
    pub sections: usize,
    /// Instructions of the longest, both ends included.
    pub longest: u32,
    /// Where the longest began.
    pub longest_at: u32,
}

impl MaskingSites {
    /// Looks through all code of an image.
    ///
    /// # Errors
    ///
    /// [`EmulatorError::Image`] where it cannot be read.
    pub fn read(image: &Path) -> Result<Self, EmulatorError> {
        let fail = |reason: String| EmulatorError::Image { image: image.to_owned(), reason };
        let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
        let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
        let mut addresses = BTreeSet::new();
        for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
            let code = section.data().map_err(|error| fail(error.to_string()))?;
            let start = u32::try_from(section.address()).map_err(|error| fail(error.to_string()))?;
            let places = code.chunks_exact(2).zip((start..).step_by(2));
            addresses.extend(places.filter(|(halfword, _)| **halfword == MASK).map(|(_, address)| address));
        }
        Ok(Self { addresses })
    }

    /// Counts the sections that run in the next `duration` of wall-clock time. The CPU is stopped before and
    /// after.
    ///
    /// # Errors
    ///
    /// [`RspError`] where the link fails, or where a section does not end.
    pub fn measure<S: Read + Write>(
        &self,
        client: &mut RspClient<S>,
        duration: Duration,
    ) -> Result<MaskedSections, RspError> {
        let deadline = Instant::now() + duration;
        let mut found = MaskedSections::default();
        for &address in &self.addresses {
            client.break_at(address)?;
        }
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match client.resume(left.max(Duration::from_millis(1))) {
                Ok(_) => {}
                Err(RspError::Timeout { .. }) => {
                    client.interrupt()?;
                    break;
                }
                Err(error) => return Err(error),
            }
            let address = client.register(PC)?;
            let length = section_length(client)?;
            found.sections += 1;
            if length > found.longest {
                (found.longest, found.longest_at) = (length, address);
            }
            if left.is_zero() {
                break;
            }
        }
        for &address in &self.addresses {
            client.unbreak(address)?;
        }
        Ok(found)
    }
}

/// Steps from a `cpsid i` over the instruction that ends its section.
fn section_length<S: Read + Write>(client: &mut RspClient<S>) -> Result<u32, RspError> {
    for count in 1..=LIMIT {
        let pc = client.register(PC)?;
        let ends = match *client.memory(pc, 4)?.as_slice() {
            [a, b, c, d] => unmasks(client, u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]))?,
            // `memory` has checked the length.
            _ => false,
        };
        client.step(STEP_LIMIT)?;
        if ends {
            return Ok(count);
        }
    }
    Err(RspError::Endless { instructions: LIMIT })
}

/// Whether the instruction of these two halves turns interrupts on.
fn unmasks<S: Read + Write>(client: &mut RspClient<S>, first: u16, second: u16) -> Result<bool, RspError> {
    let (restore, restore_too) = RESTORE;
    if (first & !0xf, second) == (restore, restore_too) {
        return Ok(client.register((first & 0xf) as u8)? & 1 == 0);
    }
    Ok(first == UNMASK)
}
