//! One access of the image to a register that somebody stands in for: the CPU is stopped before it, and led
//! past it.

use std::io::{Read, Write};

use super::rsp::{RspClient, RspError};
use super::thumb::{self, Direction, Offset, UnsupportedInstruction, WordAccess};

const PC: u8 = 15;
const PROGRAM_STATUS: u8 = 25;

/// Why an access cannot be served.
#[derive(Debug)]
pub(super) enum AccessError {
    Link(RspError),
    Instruction(UnsupportedInstruction),
}

impl From<RspError> for AccessError {
    fn from(error: RspError) -> Self {
        Self::Link(error)
    }
}

/// The access that the CPU stands before.
#[derive(Debug, Clone, Copy)]
pub(super) struct PendingAccess {
    pub address: u32,
    access: WordAccess,
    written_back: Option<u32>,
    pc: u32,
}

impl PendingAccess {
    /// Decodes the instruction at `pc`, where the CPU is stopped.
    pub fn at<S: Read + Write>(client: &mut RspClient<S>, pc: u32) -> Result<Self, AccessError> {
        let bytes = client.memory(pc, 4)?;
        let (first, second) = match *bytes.as_slice() {
            [a, b, c, d] => (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])),
            // `memory` has checked the length.
            _ => (0, 0),
        };
        let access = thumb::decode(first, second).map_err(AccessError::Instruction)?;
        Ok(Self::of(client, access, pc)?)
    }

    /// The same of an instruction that is decoded already.
    pub fn of<S: Read + Write>(
        client: &mut RspClient<S>,
        access: WordAccess,
        pc: u32,
    ) -> Result<Self, RspError> {
        let base_value = client.register(access.base)?;
        let index_value = match access.offset {
            Offset::Immediate(_) => 0,
            Offset::Register { index, .. } => client.register(index)?,
        };
        let (address, written_back) = access.resolve(base_value, index_value);
        Ok(Self { address, access, written_back, pc })
    }

    /// The instruction.
    pub fn instruction(&self) -> WordAccess {
        self.access
    }

    /// Load or store.
    pub fn direction(&self) -> Direction {
        self.access.direction
    }

    /// What a store writes.
    pub fn stored<S: Read + Write>(&self, client: &mut RspClient<S>) -> Result<u32, RspError> {
        client.register(self.access.transfer)
    }

    /// Gives a load what it reads.
    pub fn load<S: Read + Write>(&self, client: &mut RspClient<S>, value: u32) -> Result<(), RspError> {
        client.set_register(self.access.transfer, value)
    }

    /// Steps over the access.
    pub fn pass<S: Read + Write>(self, client: &mut RspClient<S>) -> Result<(), RspError> {
        if let Some(base) = self.written_back {
            client.set_register(self.access.base, base)?;
        }
        let status = client.register(PROGRAM_STATUS)?;
        let advanced = thumb::advance_it_block(status);
        if advanced != status {
            client.set_register(PROGRAM_STATUS, advanced)?;
        }
        client.set_register(PC, self.pc + self.access.length)
    }
}
