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
use super::{Emulator, EmulatorError, stall, tick_alignment};

const PC: u8 = 15;
const PROGRAM_STATUS: u8 = 25;
/// The exception number in the program status.
const EXCEPTION: u32 = 0x1ff;
/// How soon the end of the work is noticed where the image touches nothing.
const NOTICE: Duration = Duration::from_millis(200);
/// The same where devices look at the time, which may mean something to them by itself.
const LOOK: Duration = Duration::from_millis(20);
/// Interrupt set-pending registers.
const NVIC_ISPR: u32 = 0xe000_e200;

/// Registers that somebody stands in for.
pub trait Registers: Send {
    /// Whether [`Self::observe`] does something, which takes time.
    const OBSERVES: bool = false;

    /// The image reads the word at `address`.
    fn read(&mut self, address: u32) -> u32;

    /// The image writes the word at `address`.
    fn write(&mut self, address: u32, value: u32);

    /// Before every access, and now and then where there is none: when it is, and what the core is about.
    fn observe(&mut self, moment: Moment) {
        let _nothing_changes_by_itself = moment;
    }

    /// What is to be done beyond the registers now, after an access or a look; asked until there is nothing.
    fn effect(&mut self) -> Option<Effect> {
        None
    }
}

/// When and where something happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Clocks of the board's timers, of which the emulator counts one per nanosecond of its time, since the
    /// reset.
    pub clocks: u64,
    /// The number of the exception that the core is in; 0 outside of all.
    pub exception: u32,
}

/// What a device does beyond its registers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Effect {
    /// The core stands still for so many clocks of the board's timers; interrupts become pending.
    Stall(u32),
    /// Memory from this address on holds something else.
    Memory(u32, Vec<u8>),
    /// The interrupt of this number becomes pending.
    Interrupt(u8),
    /// The chip is to be reset. Nothing more is served, and the core stays stopped until
    /// [`Emulator::reset`].
    Reset,
}

/// What is stood in for.
#[derive(Debug, Clone, Copy)]
pub struct Regions<'r> {
    /// Reads and writes.
    pub registers: &'r [Region],
    /// Writes alone: what is read there is the emulator's own memory.
    pub written: &'r [Region],
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
        self.standing_in_for(Regions { registers: regions, written: &[] }, registers, work)
    }

    /// The same, for memory that is written by rules of its own, too.
    ///
    /// # Errors
    /// As [`Self::standing_in`].
    ///
    /// # Panics
    /// Where `work` does.
    pub fn standing_in_for<R: Registers, T>(
        &mut self,
        regions: Regions<'_>,
        registers: &Mutex<R>,
        work: impl FnOnce() -> T,
    ) -> Result<T, EmulatorError> {
        let mut client = self.debug()?;
        tick_alignment::start_metronome(&mut client, self.reset_at)
            .map_err(|source| self.link_failed(source))?;
        let done = AtomicBool::new(false);
        let shift = self.shift;
        let (result, served) = std::thread::scope(|scope| {
            let server = Server::new(&mut client, registers, shift);
            let serving = scope.spawn(|| server.serve(regions, &done));
            let result = {
                let _ends_serving = SetOnDrop(&done);
                work()
            };
            (result, serving.join())
        });
        match served {
            Ok(Ok(End::Done)) => {}
            // A link that is closed leaves the core as it is.
            Ok(Ok(End::Reset)) => return Ok(result),
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

/// How serving ended.
enum End {
    Done,
    Reset,
}

/// Where the CPU was when it failed, and why.
type Failure = (u32, AccessError);

fn link(error: RspError) -> Failure {
    (0, AccessError::Link(error))
}

/// Serves accesses until the work is done.
struct Server<'a, S, R> {
    client: &'a mut RspClient<S>,
    registers: &'a Mutex<R>,
    shift: u8,
    decoded: BTreeMap<u32, WordAccess>,
    clocks: u64,
}

impl<'a, S: Read + Write, R: Registers> Server<'a, S, R> {
    fn new(client: &'a mut RspClient<S>, registers: &'a Mutex<R>, shift: u8) -> Self {
        Self { client, registers, shift, decoded: BTreeMap::new(), clocks: 0 }
    }

    fn serve(mut self, regions: Regions<'_>, done: &AtomicBool) -> Result<End, Failure> {
        for region in regions.registers {
            self.client.watch(region.base, region.length).map_err(link)?;
        }
        for region in regions.written {
            self.client.watch_writes(region.base, region.length).map_err(link)?;
        }
        let mut end = End::Done;
        while !done.load(Ordering::Relaxed) {
            if let End::Reset = self.serve_next()? {
                end = End::Reset;
                break;
            }
        }
        for region in regions.registers {
            self.client.unwatch(region.base, region.length).map_err(link)?;
        }
        for region in regions.written {
            self.client.unwatch_writes(region.base, region.length).map_err(link)?;
        }
        Ok(end)
    }

    /// Lets the CPU run to its next access, or until it is time for a look.
    fn serve_next(&mut self) -> Result<End, Failure> {
        match self.client.resume(if R::OBSERVES { LOOK } else { NOTICE }) {
            Ok(stop) => {
                self.observe().map_err(link)?;
                // A CPU that was told to stop may have come to an access first, and stops for that after it.
                if stop.watchpoint.is_some() {
                    let pc = self.client.register(PC).map_err(link)?;
                    self.serve_one(pc).map_err(|error| (pc, error))?;
                }
            }
            Err(RspError::Timeout { .. }) => {
                self.client.interrupt().map_err(link)?;
                self.observe().map_err(link)?;
            }
            Err(error) => return Err(link(error)),
        }
        self.carry_out().map_err(link)
    }

    fn observe(&mut self) -> Result<(), RspError> {
        if R::OBSERVES {
            let now = tick_alignment::clock(self.client)?;
            // The clock has 32 bits.
            self.clocks += u64::from(now.wrapping_sub(self.clocks as u32));
            let exception = self.client.register(PROGRAM_STATUS)? & EXCEPTION;
            locked(self.registers).observe(Moment { clocks: self.clocks, exception });
        }
        Ok(())
    }

    fn serve_one(&mut self, pc: u32) -> Result<(), AccessError> {
        let access = match self.decoded.get(&pc) {
            Some(&known) => PendingAccess::of(self.client, known, pc)?,
            None => PendingAccess::at(self.client, pc)?,
        };
        self.decoded.insert(pc, access.instruction());
        match access.direction() {
            Direction::Load => {
                let value = locked(self.registers).read(access.address);
                access.load(self.client, value)?;
            }
            Direction::Store => {
                let value = access.stored(self.client)?;
                locked(self.registers).write(access.address, value);
            }
        }
        Ok(access.pass(self.client)?)
    }

    fn carry_out(&mut self) -> Result<End, RspError> {
        loop {
            let effect = locked(self.registers).effect();
            match effect {
                None => return Ok(End::Done),
                Some(Effect::Reset) => return Ok(End::Reset),
                Some(Effect::Memory(address, bytes)) => self.client.write_block(address, &bytes)?,
                Some(Effect::Stall(clocks)) => stall::stall(self.client, clocks, self.shift)?,
                Some(Effect::Interrupt(number)) => {
                    let register = NVIC_ISPR + 4 * u32::from(number / 32);
                    self.client.write_word(register, 1 << (number % 32))?;
                }
            }
        }
    }
}

/// Whoever looked at the registers and panicked did not change them.
fn locked<R>(registers: &Mutex<R>) -> std::sync::MutexGuard<'_, R> {
    registers.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
