//! The step timer behind the debugger: every access of the released image to TIM1 and to the direction's pin goes to a
//! [`StepTimer`], for QEMU has none.
//!
//! Time passes for the model from tick to tick: the tick looks once, at its beginning, whether the last train has ended.

use std::io::{Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::clock_cover::Region;
use super::rsp::{RspClient, RspError};
use super::thumb::{self, Direction, Offset, WordAccess};
use crate::step_timer::{LENGTH, StepTimer, register};

const TIM1: Region = Region { base: 0x4001_0000, length: LENGTH };
/// Sets and resets pins of port A.
const PORT_A: Region = Region { base: 0x4002_0018, length: 4 };
/// The direction's pin.
const DIRECTION: u32 = 11;
const PC: u8 = 15;
const PROGRAM_STATUS: u8 = 25;
/// How often it is looked whether to end.
const LOOK: Duration = Duration::from_millis(200);

/// How the timer was set up before it was covered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Covered {
    /// A and B in quadrature instead of step and direction.
    pub quadrature: bool,
    /// Clocks of the timer per tick; the prescaler is 1 as at all rates from 2564 Hz up.
    pub clocks_per_tick: u32,
}

/// Serves a stopped CPU's accesses until `end` is set, then lets it run alone. The timer as it is then.
///
/// # Errors
///
/// [`RspError`] where the link fails or the image does what the decoder does not know.
pub fn serve<S: Read + Write>(
    mut client: RspClient<S>,
    covered: Covered,
    end: &AtomicBool,
) -> Result<StepTimer, RspError> {
    let mut timer = StepTimer::default();
    let mode = if covered.quadrature { 3 } else { 7 };
    timer.write(register::CCMR1, mode << 4);
    timer.write(register::CCMR2, mode << 12);
    for region in [TIM1, PORT_A] {
        client.watch(region.base, region.length)?;
    }
    while !end.load(Ordering::Relaxed) {
        match client.resume(LOOK) {
            Ok(_) => answer(&mut client, &mut timer, covered)?,
            Err(RspError::Timeout { .. }) => {
                let stop = client.interrupt()?;
                // It may have stopped by itself meanwhile.
                if stop.watchpoint.is_some() {
                    answer(&mut client, &mut timer, covered)?;
                }
            }
            Err(error) => return Err(error),
        }
    }
    for region in [TIM1, PORT_A] {
        client.unwatch(region.base, region.length)?;
    }
    client.detach()?;
    Ok(timer)
}

/// Does what the instruction asks for, on the model, and steps over it.
fn answer<S: Read + Write>(
    client: &mut RspClient<S>,
    timer: &mut StepTimer,
    covered: Covered,
) -> Result<(), RspError> {
    let pc = client.register(PC)?;
    let access = decode(client, pc)?;
    let index = match access.offset {
        Offset::Immediate(_) => 0,
        Offset::Register { index, .. } => client.register(index)?,
    };
    let (address, written_back) = access.resolve(client.register(access.base)?, index);
    match access.direction {
        Direction::Load => {
            let offset = address.wrapping_sub(TIM1.base);
            if offset == register::CR1 {
                timer.advance(covered.clocks_per_tick);
            }
            let value = if TIM1.contains(address) { timer.read(offset) } else { 0 };
            client.set_register(access.transfer, value)?;
        }
        Direction::Store => {
            let value = client.register(access.transfer)?;
            if TIM1.contains(address) {
                timer.write(address - TIM1.base, value);
            } else if value & (1 << DIRECTION) != 0 {
                timer.direction_up = true;
            } else if value & (1 << (DIRECTION + 16)) != 0 {
                timer.direction_up = false;
            }
        }
    }
    if let Some(base) = written_back {
        client.set_register(access.base, base)?;
    }
    let status = client.register(PROGRAM_STATUS)?;
    let advanced = thumb::advance_it_block(status);
    if advanced != status {
        client.set_register(PROGRAM_STATUS, advanced)?;
    }
    client.set_register(PC, pc + access.length)
}

fn decode<S: Read + Write>(client: &mut RspClient<S>, pc: u32) -> Result<WordAccess, RspError> {
    let bytes = client.memory(pc, 4)?;
    let half = |at: usize| {
        u16::from_le_bytes([
            bytes.get(at).copied().unwrap_or_default(),
            bytes.get(at + 1).copied().unwrap_or_default(),
        ])
    };
    thumb::decode(half(0), half(2)).map_err(|refused| RspError::Refused {
        command: format!("an access to the step timer at {pc:#010x}"),
        answer: refused.to_string(),
    })
}
