//! A board in the emulator that is spoken to and stepped.

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{BoardError, Session};
use stillbeam_host_tests::emulator::interrupt_cost::Handler;
use stillbeam_host_tests::emulator::masked_sections::{MaskedSections, MaskingSites};
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, function_address};

use crate::cases::Case;

/// Ticks per case.
const TICKS: usize = 12;
/// How long sections with interrupts masked are watched.
const MASKED_DURATION: Duration = Duration::from_secs(20);
/// Wall-clock limit for whatever takes virtual time.
const PATIENCE: Duration = Duration::from_secs(60);

/// The board, its console and its tick.
pub struct Bench {
    // The console goes before the emulator it talks to.
    session: Session,
    emulator: Emulator,
    handler: Handler,
    /// Where the base is going next, so that every move has somewhere to go.
    target_mm: f64,
}

impl Bench {
    /// Boots the image, slow enough that a line of telemetry per tick can be sent.
    pub fn boot(image: &Path) -> Result<Self, Box<dyn Error>> {
        let handler = Handler { entry: function_address(image, "TIM2")? };
        let emulator = Emulator::boot(image, &EmulatorOptions { shift: 0, ..EmulatorOptions::default() })?;
        let path = emulator.serial_port().to_str().ok_or("the serial port's path is not text")?;
        let port = SerialBoard::open(path)?;
        let mut session = Session::start(Box::new(port))?;
        // A move that lasts: virtual time runs on between a command and the first breakpoint.
        for line in ["set move.velocity_mm_s 1", "apply"] {
            session.command_when_ready(line)?;
        }
        Ok(Self { session, emulator, handler, target_mm: 100.0 })
    }

    /// Brings the board into the state of a case, counts its ticks and returns them as a TOML table.
    pub fn measure(&mut self, case: &Case) -> Result<String, Box<dyn Error>> {
        // What scales an output changes only while the drive is off.
        self.session.disable_drive()?;
        for line in case.table() {
            self.session.command_when_ready(&line)?;
        }
        self.session.enable_virtual_drive()?;
        if !case.motion.follows() {
            self.session.wait_for_rest(PATIENCE)?;
        }
        let samples = self.session.command("info")?.line("history_samples").map(str::to_owned);
        let samples =
            samples.as_deref().and_then(|text| text.split(' ').next()).ok_or("no history_samples")?;
        let samples: u32 = samples.parse()?;
        for command in case.motion.commands(self.target_mm, case.shaper) {
            self.session.command_when_ready(&command)?;
        }
        self.target_mm = -self.target_mm;
        if case.streams {
            self.session.command("stream on 1")?;
        }
        let mut client = self.emulator.debug()?;
        let cost = self.handler.measure(&mut client, TICKS, PATIENCE)?;
        client.detach()?;
        self.session.command("stream off")?;
        let state = self.session.command("status")?.line("state").map(str::to_owned);
        if state.as_deref() != Some(case.motion.state()) {
            return Err(format!("{case:?}: the board is {state:?}").into());
        }
        if case.motion.changes_tables() {
            self.require_handover()?;
        }
        self.session.command("stop")?;
        self.session.wait_for_rest(PATIENCE)?;
        let (least, median, most) = cost.summary().ok_or("no tick was counted")?;
        let cycles = cost.cycles.iter().max().ok_or("no tick was counted")?;
        let Case { modes, shaper, streams, motion } = case;
        Ok(format!(
            "[[tick]]\nmodes = {modes}\nshaper = \"{shaper}\"\nstreams = {streams}\nmotion = \"{}\"\n\
             history_samples = {samples}\nleast = {least}\nmedian = {median}\nmost = {most}\ncycles = {cycles}\n",
            motion.name()
        ))
    }

    /// A third table is refused while two are at work.
    fn require_handover(&mut self) -> Result<(), Box<dyn Error>> {
        match self.session.command("shaper off") {
            Err(BoardError::Refused { .. }) => Ok(()),
            Ok(_) => Err("the handover was over before its ticks were counted".into()),
            Err(error) => Err(error.into()),
        }
    }

    /// Counts the instructions of the sections with interrupts masked while the console is busy, as a TOML
    /// table.
    pub fn masked_sections(&mut self, image: &Path) -> Result<String, Box<dyn Error>> {
        let sites = MaskingSites::read(image)?;
        self.session.command_when_ready("move 0")?;
        self.session.command("stream on 4")?;
        let mut client = self.emulator.debug()?;
        let found = std::thread::scope(|scope| {
            let measuring = scope.spawn(|| {
                let found = sites.measure(&mut client, MASKED_DURATION);
                client.detach().and(found)
            });
            // Replies are slow while every section is stepped through; what they say does not matter here.
            for line in ["get", "help", "info", "status", "apply", "stop", "events"].iter().cycle() {
                let _slow_is_well = self.session.command(line);
                if measuring.is_finished() {
                    break;
                }
            }
            measuring.join()
        });
        let found = found.map_err(|_| "the measurement panicked")??;
        self.session.command("stream off")?;
        self.session.command("stop")?;
        self.session.wait_for_rest(PATIENCE)?;
        let MaskedSections { sections, longest, .. } = found;
        let places = sites.addresses.len();
        Ok(format!("\n[masked]\nplaces = {places}\nsections = {sections}\nlongest = {longest}\n"))
    }

    /// Runs the commands that go deepest.
    pub fn say_everything(&mut self) -> Result<(), Box<dyn Error>> {
        for line in ["help", "get", "info", "status", "events", "apply", "move 1", "stop"] {
            self.session.command_when_ready(line)?;
        }
        self.session.wait_for_rest(PATIENCE)?;
        // The emulator has no flash to write, so this is refused after it has been tried to the end.
        match self.session.command("save") {
            Ok(_) | Err(BoardError::Refused { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// The deepest stack so far, start-up included, and what there is, as a TOML table.
    pub fn stack(&mut self) -> Result<String, Box<dyn Error>> {
        let stack = self.emulator.stack();
        let mut client = self.emulator.debug()?;
        let bytes = stack.deepest(&mut client)?;
        client.detach()?;
        Ok(format!("\n[stack]\nbytes = {bytes}\nroom = {}\n", stack.high - stack.low))
    }
}
