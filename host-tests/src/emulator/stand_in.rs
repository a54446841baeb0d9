//! Standing in for peripherals that the emulator does not model while the image runs: every access to them
//! stops the CPU, is served, and is passed over.
//!
//! Virtual time goes on to the next event whenever the CPU is resumed, which would be the next tick: an
//! access in every tick would leave no time for anything but ticks. So TIM3 of the emulator, whose interrupt
//! the image leaves masked, makes an event every microsecond meanwhile. What the image itself does with TIM3
//! has to be stood in for then.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::access::{AccessError, PendingAccess};
use super::clock_cover::Region;
use super::rsp::{RspClient, RspError};
use super::thumb::{Direction, WordAccess};
use super::tick_alignment;
use super::{Emulator, EmulatorError};

const PC: u8 = 15;
/// How soon the end of the work is noticed where the image touches nothing.
const NOTICE: Duration = Duration::from_millis(200);

/// Registers that somebody stands in for.
pub trait Registers: Send {
    /// The image reads the word at `address`.
    fn read(&mut self, address: u32) -> u32;

    /// The image writes the word at `address`.
    fn write(&mut self, address: u32, value: u32);
}

impl Emulator {
    /// Serves the accesses to `regions` from `registers` while `work` is done.
    ///
    /// # Errors
    /// [`EmulatorError`] where the link fails, or the image touches a region by an instruction that is not
    /// decoded.
    ///
    /// # Panics
    /// Where `work` does.
    pub fn standing_in<R: Registers, T>(
        &mut self,
        regions: &[Region],
        registers: &Mutex<R>,
        work: impl FnOnce() -> T,
    ) -> Result<T, EmulatorError> {
        let mut client = self.debug()?;
        tick_alignment::start_metronome(&mut client, self.reset_at)
            .map_err(|source| self.link_failed(source))?;
        let done = AtomicBool::new(false);
        let (result, served) = std::thread::scope(|scope| {
            let serving = scope.spawn(|| serve(&mut client, regions, registers, &done));
            let result = {
                let _ends_serving = SetOnDrop(&done);
                work()
            };
            (result, serving.join())
        });
        match served {
            Ok(Ok(())) => {}
            Ok(Err((pc, AccessError::Instruction(source)))) => {
                return Err(EmulatorError::Instruction { location: self.symbols.describe(pc), source });
            }
            Ok(Err((_, AccessError::Link(source)))) => return Err(self.link_failed(source)),
            Err(panic) => std::panic::resume_unwind(panic),
        }
        tick_alignment::stop_metronome(&mut client).map_err(|source| self.link_failed(source))?;
        client.detach().map_err(|source| self.link_failed(source))?;
        Ok(result)
    }

    fn link_failed(&self, source: RspError) -> EmulatorError {
        EmulatorError::Link { source, output: self.process.output() }
    }
}

/// Work that panics must not leave the serving thread waiting.
struct SetOnDrop<'f>(&'f AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Serves until `done`; where the CPU was when it failed.
fn serve<S: Read + Write, R: Registers>(
    client: &mut RspClient<S>,
    regions: &[Region],
    registers: &Mutex<R>,
    done: &AtomicBool,
) -> Result<(), (u32, AccessError)> {
    let link = |error: RspError| (0, AccessError::Link(error));
    for region in regions {
        client.watch(region.base, region.length).map_err(link)?;
    }
    let mut decoded = BTreeMap::new();
    while !done.load(Ordering::Relaxed) {
        match client.resume(NOTICE) {
            Ok(_) => {
                let pc = client.register(PC).map_err(link)?;
                serve_one(client, registers, pc, &mut decoded).map_err(|error| (pc, error))?;
            }
            Err(RspError::Timeout { .. }) => drop(client.interrupt().map_err(link)?),
            Err(error) => return Err(link(error)),
        }
    }
    for region in regions {
        client.unwatch(region.base, region.length).map_err(link)?;
    }
    Ok(())
}

fn serve_one<S: Read + Write, R: Registers>(
    client: &mut RspClient<S>,
    registers: &Mutex<R>,
    pc: u32,
    decoded: &mut BTreeMap<u32, WordAccess>,
) -> Result<(), AccessError> {
    let access = match decoded.get(&pc) {
        Some(&known) => PendingAccess::of(client, known, pc)?,
        None => PendingAccess::at(client, pc)?,
    };
    decoded.insert(pc, access.instruction());
    match access.direction() {
        Direction::Load => {
            let value = locked(registers).read(access.address);
            access.load(client, value)?;
        }
        Direction::Store => {
            let value = access.stored(client)?;
            locked(registers).write(access.address, value);
        }
    }
    Ok(access.pass(client)?)
}

/// Whoever looked at the registers and panicked did not change them.
fn locked<R>(registers: &Mutex<R>) -> std::sync::MutexGuard<'_, R> {
    registers.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
