//! The serial console: bytes in, replies out, requests to the interrupt.
//!
//! It does no input or output of its own, so it runs the same behind a UART, a pseudo-terminal or a test. A
//! reply is any number of lines and then one that begins with `ok` or `err`. docs/protocol.md is the
//! reference.

mod announcement;
pub mod checksum;
mod commands;
pub mod error;
mod help;
pub mod line;
mod link;
mod long_work;
pub mod upload;

use core::fmt::Write;

use heapless::String;
use heapless::spsc::{Consumer, Producer};

use crate::brown_out::BrownOut;
use crate::control::Request;
use crate::drive::State;
use crate::fault::{Event, EventLog, Fault};
use crate::motion::{MotionMemory, PieceMemory, PlanOutline};
use crate::real_time::Asked;
use crate::restart::{Restart, Start};
use crate::settings::{Settings, StoreError, Stored};
use crate::shaper::{ShaperTable, UploadedTable};
use crate::source::SourceKind;
use crate::telemetry::{Activity, Flags, Status, Streaming};
use crate::units::TickRate;

use announcement::Announced;
use checksum::{Checked, ReplyWithChecksum};
pub use error::{Busy, CommandError, Refused};
use line::{LineEditor, LineFault, MAX_LINE};
use link::HostWatch;
use long_work::{LongWork, Step};
use upload::Upload;

/// The longest reply in bytes; what takes the output must have room for it. Every reply is below it by test.
pub const MAX_REPLY: usize = 6144;

/// What the console says about the firmware and the board it runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Version of the firmware.
    pub version: &'static str,
    /// Name of the board.
    pub board: &'static str,
    /// Tells builds apart: the CRC-32 of the image, or zero where there is none.
    pub build: u32,
    /// The clock that the tick timer divides by a whole number, in hertz.
    pub timer_clock_hz: u32,
    /// The supply below which the chip keeps itself in reset, where that is known.
    pub brown_out: Option<BrownOut>,
}

impl Identity {
    /// The same with the build's number and the brown-out level.
    pub fn with(self, build: u32, brown_out: BrownOut) -> Self {
        Self { build, brown_out: Some(brown_out), ..self }
    }
}

/// What a command asks of whoever owns the flash, which may take long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Store what [`Console::settings_to_store`] and [`Console::table_to_store`] give with
    /// [`crate::settings::SettingsStore::save`] and tell [`Console::saved`] how it went.
    Save,
    /// Forget the record of a crash.
    ForgetCrash,
    /// Start anew.
    Reboot(Start),
    /// Let the board test itself and tell [`Console::self_tested`] what it found.
    SelfTest,
    /// Write the level into the option bytes and tell [`Console::brown_out_set`] what they say then.
    SetBrownOut(BrownOut),
}

/// The console's ends of the queues.
pub struct Links<'m> {
    /// Requests to the interrupt.
    pub requests: Producer<'m, Request<'m>>,
    /// History memory of replaced cascades and what motions borrowed, coming back.
    pub retired: Consumer<'m, MotionMemory<'m>>,
    /// What has happened.
    pub events: EventLog<'m>,
    /// The newest values.
    pub status: &'m Status,
    /// What single bytes ask for.
    pub asked: &'m Asked,
}

/// Memory that the console lends to the interrupt.
pub struct Memory<'m> {
    /// The history that no table uses.
    pub spare_history: &'m mut [i32],
    /// A plan that arrives, and one that has.
    pub plans: [&'m mut PieceMemory; 2],
}

/// The state of the console.
pub struct Console<'m> {
    identity: Identity,
    editor: LineEditor,
    /// What runs now.
    live: Settings,
    /// What `apply` would make run.
    staged: Settings,
    /// What the flash holds, as far as is known.
    stored: Stored,
    store_fault: Option<StoreError>,
    /// The settings that run may not be those that were saved, and nobody has confirmed them.
    distrusted: bool,
    effect: Option<Effect>,
    /// What a command began and [`Self::work`] goes on with; its reply is still to come.
    long_work: Option<LongWork<'m>>,
    shaper_on: bool,
    table: ShaperTable,
    /// How much further back it looks until the next motion, for it was taken during one.
    lag_ticks: u32,
    /// The table that `shaper.source` may select.
    uploaded: Option<UploadedTable>,
    /// The table or plan on its way, and what has come of it.
    upload: Option<Upload>,
    arriving: &'m mut PieceMemory,
    /// The plan that `play` plays, and its memory, which is away meanwhile.
    plan: Option<PlanOutline>,
    plan_memory: Option<&'m mut PieceMemory>,
    streaming: Streaming,
    /// Whether lines without a checksum are refused.
    checksum_required: bool,
    /// Whether the reply to come has a checksum.
    reply_has_checksum: bool,
    spare_history: Option<&'m mut [i32]>,
    history_samples: usize,
    requests: Producer<'m, Request<'m>>,
    retired: Consumer<'m, MotionMemory<'m>>,
    events: EventLog<'m>,
    restart: Restart,
    status: &'m Status,
    asked: &'m Asked,
    host: HostWatch,
    announced: Announced,
}

impl<'m> Console<'m> {
    /// A console for a controller at rest that runs `table` under `settings`.
    pub fn new(
        identity: Identity,
        settings: Settings,
        table: ShaperTable,
        memory: Memory<'m>,
        links: Links<'m>,
    ) -> Self {
        let Links { requests, retired, events, status, asked } = links;
        let Memory { spare_history, plans: [arriving, plan_memory] } = memory;
        Self {
            identity,
            editor: LineEditor::new(),
            live: settings.clone(),
            staged: settings,
            stored: Stored::default(),
            store_fault: None,
            distrusted: false,
            effect: None,
            long_work: None,
            shaper_on: true,
            table,
            lag_ticks: 0,
            uploaded: None,
            upload: None,
            arriving,
            plan: None,
            plan_memory: Some(plan_memory),
            streaming: Streaming::default(),
            checksum_required: false,
            reply_has_checksum: false,
            history_samples: spare_history.len(),
            spare_history: Some(spare_history),
            requests,
            retired,
            events,
            restart: Restart::default(),
            status,
            asked,
            host: HostWatch::default(),
            announced: Announced::default(),
        }
    }

    /// Takes what the flash holds and asks the controller, which has not ticked yet, to run it. Stored
    /// settings that cannot run together stay staged, and the defaults run.
    ///
    /// # Errors
    /// Why they cannot, for [`Self::greet`] to print.
    pub fn restore(&mut self, stored: Result<Stored, StoreError>) -> Result<(), CommandError<'static>> {
        match stored {
            Ok(stored) => {
                self.uploaded = stored.table().cloned();
                self.distrusted = stored.damage().is_some();
                self.stored = stored;
            }
            Err(fault) => {
                self.store_fault = Some(fault);
                self.distrusted = true;
            }
        }
        self.run_stored()
    }

    /// Prints what a person sees first, and why the stored settings do not run, if [`Self::restore`] said so.
    pub fn greet(&self, restored: Result<(), CommandError<'static>>, out: &mut dyn Write) {
        let Identity { version, board, .. } = self.identity;
        let _best_effort = write!(out, "\r\nstillbeam {version} on {board}; 'help' lists the commands\r\n");
        if let Err(reason) = restored {
            let _best_effort = write!(out, "the stored settings are staged but do not run: {reason}\r\n");
        }
        if let Some(crash) = &self.restart.crash {
            let _best_effort = write!(out, "a crash was recorded, see 'info': {crash}\r\n");
        }
        let first = if self.restart.must_hold() { "'clear', then " } else { "" };
        let _best_effort = write!(out, "the drive is off; {first}'enable' lets it run\r\n");
        if let Some(fault) = self.store_fault {
            let _best_effort = write!(out, "no stored settings: {fault}\r\n");
        }
        if let Some(damage) = self.stored.damage() {
            let _best_effort = write!(out, "stored settings are damaged: {damage}; see 'get'\r\n");
        }
        self.prompt(out);
    }

    /// What the last line asks for beyond the queue to the interrupt. Its reply is not complete before this
    /// is carried out and reported, so whoever feeds bytes looks here after each.
    pub fn take_effect(&mut self) -> Option<Effect> {
        self.effect.take()
    }

    /// What telemetry was asked for last, for whoever sends it.
    pub fn streaming(&self) -> Streaming {
        self.streaming
    }

    /// What `save` stores: the settings that run, not those that are staged.
    pub fn settings_to_store(&self) -> &Settings {
        &self.live
    }

    /// The uploaded table that `save` stores, if there is one.
    pub fn table_to_store(&self) -> Option<&UploadedTable> {
        self.uploaded.as_ref()
    }

    /// Ends the reply to `save`: with what is stored now and the number of records written, or with the
    /// fault.
    pub fn saved(&mut self, result: Result<(Stored, u32), StoreError>, out: &mut dyn Write) {
        self.reply(out, |console, out| {
            let _best_effort = match result {
                Ok((stored, written)) => {
                    console.stored = stored;
                    console.store_fault = None;
                    write!(out, "ok save written={written} stored={}\r\n", console.stored.loaded())
                }
                Err(fault) => {
                    console.store_fault = Some(fault);
                    write!(out, "{}\r\n", CommandError::Flash(fault))
                }
            };
        });
        self.prompt(out);
    }

    /// Takes in why the firmware starts. Call before [`Self::greet`].
    pub fn note_restart(&mut self, restart: Restart) {
        self.note(Event::Reset, i32::from(restart.cause.0));
        if restart.cause.is_watchdog() {
            self.note(Event::Watchdog, 0);
        }
        if restart.crash.is_some() {
            self.note(Event::Crash, 0);
        }
        self.restart = restart;
    }

    /// Counts and keeps an event that the tick cannot know of.
    pub fn note(&mut self, event: Event, value: i32) {
        self.status.counters().add(event);
        self.events.add(self.status.tick(), event, value);
    }

    /// Ends the reply to `crash clear`.
    pub fn crash_forgotten(&mut self, out: &mut dyn Write) {
        self.restart.crash = None;
        self.reply(out, |_, out| {
            let _best_effort = out.write_str("ok crash clear\r\n");
        });
        self.prompt(out);
    }

    /// What runs now.
    pub fn settings(&self) -> &Settings {
        &self.live
    }

    /// Takes one byte from the serial port. Echo and replies, at most [`MAX_REPLY`] bytes, go to `out`.
    pub fn feed(&mut self, byte: u8, out: &mut dyn Write) {
        if self.take_real_time(byte, out) {
            return;
        }
        // Nobody should, but lines are answered in their order.
        while self.work(out) {}
        let Some(line) = self.editor.feed(byte, out) else { return };
        self.take_line(line, out);
        if self.effect.is_none() && self.long_work.is_none() {
            self.prompt(out);
        }
    }

    fn take_line(&mut self, line: Result<String<MAX_LINE>, LineFault>, out: &mut dyn Write) {
        let checked = line.as_ref().map(|line| Checked::of(line)).map_err(|fault| CommandError::Line(*fault));
        self.reply_has_checksum = self.checksum_required || matches!(checked, Ok(Checked::Good(_)));
        let command = checked.and_then(|checked| match checked {
            // Nothing but this very line ends what asked for checksums, so that a person is not locked out.
            Checked::Plain(line)
                if self.checksum_required && !line.trim().is_empty() && line != "checksum off" =>
            {
                Err(CommandError::NoChecksum)
            }
            Checked::Plain(line) | Checked::Good(line) => Ok(line),
            Checked::Damaged => Err(CommandError::Damaged),
        });
        if matches!(command, Err(CommandError::NoChecksum | CommandError::Damaged)) {
            self.note(Event::Crc, 0);
        }
        self.reply(out, |console, out| {
            let result = command.and_then(|line| match line.trim() {
                "" => Ok(()),
                line => console.execute(line, out),
            });
            if let Err(error) = result {
                let _best_effort = write!(out, "{error}\r\n");
            }
        });
    }

    /// Lets something be said, with a checksum where the line asked for it.
    fn reply(&mut self, out: &mut dyn Write, speak: impl FnOnce(&mut Self, &mut dyn Write)) {
        if self.reply_has_checksum {
            let mut reply = ReplyWithChecksum::new(out);
            speak(self, &mut reply);
            reply.finish();
        } else {
            speak(self, out);
        }
    }

    /// Goes on with what takes long, for a few milliseconds on the board, and ends the reply with it. Whoever
    /// feeds bytes calls this after each for as long as it says that there is more, and does in between
    /// whatever must not wait.
    pub fn work(&mut self, out: &mut dyn Write) -> bool {
        let Some(work) = self.long_work.take() else { return false };
        match work.go_on(self.arriving, self.plan_memory.as_deref()) {
            Step::More(work) => {
                self.long_work = Some(work);
                return true;
            }
            Step::Done(work) => self.reply(out, |console, out| {
                if let Err(error) = console.finish(work, out) {
                    let _best_effort = write!(out, "{error}\r\n");
                }
            }),
        }
        self.prompt(out);
        false
    }

    /// Whether the interrupt has still to take what the last line asked for. Who sends the reply waits until
    /// it has, at most one tick per request, so that `ok` means done and lines may follow each other without
    /// pause.
    pub fn has_waiting_request(&self) -> bool {
        !self.requests.is_empty()
    }

    /// The drive's state.
    pub fn drive_state(&self) -> State {
        self.status.drive()
    }

    /// The rate at which the timer has to run the tick.
    pub fn tick_rate(&self) -> TickRate {
        self.table.tick_rate()
    }

    /// Timer clocks per tick at that rate.
    pub fn clocks_per_tick(&self) -> u32 {
        self.tick_rate().clocks_per_tick(self.identity.timer_clock_hz)
    }

    fn prompt(&self, out: &mut dyn Write) {
        if self.editor.echo() {
            let _best_effort = out.write_str("> ");
        }
    }

    /// Takes back what the interrupt no longer needs.
    fn reclaim(&mut self) {
        while let Some(memory) = self.retired.dequeue() {
            match memory {
                MotionMemory::History(history) => self.spare_history = Some(history),
                MotionMemory::Pieces(pieces) => self.plan_memory = Some(pieces),
            }
        }
    }

    /// Refuses what must not happen while something moves or is about to.
    fn require_rest(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        self.require_taken(command)?;
        match self.status.activity() {
            Activity::Rest => Ok(()),
            Activity::Fault => {
                let fault = self.status.fault().unwrap_or(Fault::Restart);
                Err(CommandError::Fault { command, reason: Refused::Held(fault) })
            }
            activity => Err(CommandError::Busy { command, reason: Busy::Activity(activity) }),
        }
    }

    /// Refuses a motion unless commands come from here, the machine is at rest and the drive enabled.
    fn require_motion(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        let source = self.live.source().kind();
        if source != SourceKind::Moves {
            return Err(CommandError::Fault { command, reason: Refused::Source(source) });
        }
        self.require_rest(command)?;
        match self.status.drive() {
            State::Enabled => Ok(()),
            state @ (State::Enabling | State::Stopping) => {
                Err(CommandError::Busy { command, reason: Busy::Drive(state) })
            }
            State::NotReady | State::Disabled | State::Fault => {
                let reason = Refused::NotEnabled(self.status.lacking());
                Err(CommandError::Fault { command, reason })
            }
        }
    }

    /// Refuses what must not happen while the drive could follow it.
    fn require_drive_off(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        self.require_taken(command)?;
        let off = self.status.flags().contains(Flags::DRIVE_DISABLED);
        match self.status.drive() {
            state @ (State::Enabling | State::Stopping) => {
                Err(CommandError::Busy { command, reason: Busy::Drive(state) })
            }
            _ if off => Ok(()),
            _ => Err(CommandError::Fault { command, reason: Refused::DriveOn }),
        }
    }

    /// Refuses while a request waits, so that what is known of the controller is true.
    fn require_taken(&self, command: &'static str) -> Result<(), CommandError<'static>> {
        if self.has_waiting_request() {
            Err(CommandError::Busy { command, reason: Busy::Requests })
        } else {
            Ok(())
        }
    }

    fn request(&mut self, command: &'static str, request: Request<'m>) -> Result<(), CommandError<'static>> {
        self.requests.enqueue(request).map_err(|_| CommandError::Busy { command, reason: Busy::Requests })
    }
}
