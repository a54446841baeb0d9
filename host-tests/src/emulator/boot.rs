//! The start-up of the image, with every access to the covered registers served by the driver.

use std::io::{Read, Write};
use std::time::{Duration, Instant};

use super::access::{AccessError, PendingAccess};
use super::clock_cover::ClockCover;
use super::error::EmulatorError;
use super::image::ImageSymbols;
use super::rsp::{RspClient, RspError};
use super::thumb::Direction;
use super::tick_alignment;

const PC: u8 = 15;

/// What happened during the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BootReport {
    /// Number of register accesses that the driver served.
    pub served_accesses: usize,
    /// Wall-clock time from the first instruction to the end of the start-up.
    pub duration: Duration,
}

/// Why the start-up failed; the caller adds what the emulator printed.
#[derive(Debug)]
pub(super) enum BootFailure {
    Link(RspError),
    Emulator(EmulatorError),
}

impl From<RspError> for BootFailure {
    fn from(error: RspError) -> Self {
        Self::Link(error)
    }
}

impl From<EmulatorError> for BootFailure {
    fn from(error: EmulatorError) -> Self {
        Self::Emulator(error)
    }
}

/// What a start-up finds.
#[derive(Debug, Clone, Default)]
pub(super) struct Circumstances {
    /// The registers that the driver stands in for.
    pub cover: ClockCover,
    /// The virtual time of the reset, in ns.
    pub reset_at: u32,
    /// The core stays stopped at the end: a link that is closed leaves it so.
    pub held: bool,
}

/// Runs a CPU that is stopped at reset up to the end of its start-up, then lets go of it.
pub(super) fn boot<S: Read + Write>(
    mut client: RspClient<S>,
    symbols: &ImageSymbols,
    circumstances: Circumstances,
    limit: Duration,
) -> Result<BootReport, BootFailure> {
    let watched = || ClockCover::REGIONS.into_iter().chain([tick_alignment::REGION]);
    for region in watched() {
        client.watch(region.base, region.length)?;
    }
    client.break_at(symbols.boot_complete())?;
    let held = circumstances.held;
    let report = StartUp {
        client: &mut client,
        symbols,
        circumstances,
        served: 0,
        last_access: None,
        reported_complete: false,
        tick_started: false,
    }
    .run(limit)?;
    for region in watched() {
        client.unwatch(region.base, region.length)?;
    }
    if !held {
        client.detach()?;
    }
    Ok(report)
}

struct StartUp<'a, S> {
    client: &'a mut RspClient<S>,
    symbols: &'a ImageSymbols,
    circumstances: Circumstances,
    served: usize,
    last_access: Option<(Direction, u32, u32)>,
    /// The image has called `stillbeam_boot_complete`.
    reported_complete: bool,
    /// The image has started the timer of its tick, before or after that call.
    tick_started: bool,
}

impl<S: Read + Write> StartUp<'_, S> {
    fn run(mut self, limit: Duration) -> Result<BootReport, BootFailure> {
        let begun = Instant::now();
        while !(self.reported_complete && self.tick_started) {
            // A start-up that polls a covered register for ever never stops by itself.
            let left = limit.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return Err(self.timed_out(limit)?.into());
            }
            let stop = match self.client.resume(left) {
                Err(RspError::Timeout { .. }) => {
                    self.client.interrupt()?;
                    return Err(self.timed_out(limit)?.into());
                }
                other => other?,
            };
            let pc = self.client.register(PC)?;
            if stop.watchpoint.is_some() {
                self.serve(pc)?;
            } else if pc == self.symbols.boot_complete() {
                self.reported_complete = true;
                self.client.unbreak(pc)?;
            } else {
                return Err(BootFailure::Emulator(EmulatorError::UnexpectedStop {
                    location: self.symbols.describe(pc),
                    signal: stop.signal,
                }));
            }
        }
        Ok(BootReport { served_accesses: self.served, duration: begun.elapsed() })
    }

    /// Does what the instruction at `pc` asks for, on the register file, and steps over it.
    fn serve(&mut self, pc: u32) -> Result<(), BootFailure> {
        let access = PendingAccess::at(self.client, pc).map_err(|error| match error {
            AccessError::Link(error) => BootFailure::Link(error),
            AccessError::Instruction(source) => {
                EmulatorError::Instruction { location: self.symbols.describe(pc), source }.into()
            }
        })?;
        let address = access.address;
        if !ClockCover::covers(address) && !tick_alignment::REGION.contains(address) {
            let location = self.symbols.describe(pc);
            return Err(EmulatorError::Stray { location, address }.into());
        }
        let value = match access.direction() {
            Direction::Load => {
                let value = self.circumstances.cover.read(address);
                access.load(self.client, value)?;
                value
            }
            Direction::Store => {
                let value = access.stored(self.client)?;
                if tick_alignment::REGION.contains(address) {
                    self.tick_started |=
                        tick_alignment::generate_event(self.client, value, self.circumstances.reset_at)?;
                } else {
                    self.circumstances.cover.write(address, value);
                }
                value
            }
        };
        access.pass(self.client)?;
        self.served += 1;
        self.last_access = Some((access.direction(), address, value));
        Ok(())
    }

    fn timed_out(&mut self, limit: Duration) -> Result<EmulatorError, BootFailure> {
        let pc = self.client.register(PC)?;
        let last_access = match self.last_access {
            None => "none".to_owned(),
            Some((Direction::Load, address, value)) => {
                format!("a read of {value:#x} at {address:#010x}")
            }
            Some((Direction::Store, address, value)) => {
                format!("a write of {value:#x} to {address:#010x}")
            }
        };
        Ok(EmulatorError::BootTimeout {
            waiting_for: if self.reported_complete {
                "the image did not start its tick timer (TIM2, by an update event through EGR)"
            } else {
                "the image did not call `stillbeam_boot_complete`"
            },
            limit,
            location: self.symbols.describe(pc),
            served: self.served,
            last_access,
        })
    }
}

#[cfg(test)]
#[path = "boot_tests.rs"]
mod tests;
