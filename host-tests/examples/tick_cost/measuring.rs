//! A board in the emulator that is spoken to and stepped.

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use stillbeam::board::Session;
use stillbeam::board::serial::SerialBoard;
use stillbeam_host_tests::emulator::interrupt_cost::Handler;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions, function_address};

use crate::cases::{Case, Motion};

/// Ticks per case.
const TICKS: usize = 12;
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
        for line in case.table() {
            self.session.command_when_ready(&line)?;
        }
        self.session.wait_for_rest(PATIENCE)?;
        let samples = self.session.command("info")?.line("history_samples").map(str::to_owned);
        let samples =
            samples.as_deref().and_then(|text| text.split(' ').next()).ok_or("no history_samples")?;
        let samples: u32 = samples.parse()?;
        match case.motion {
            Motion::Rest => {}
            Motion::Move => {
                self.session.command_when_ready(&format!("move {}", self.target_mm))?;
                self.target_mm = -self.target_mm;
            }
            Motion::Sweep => {
                self.session.command_when_ready("sweep linear 1 2 200 0.05")?;
            }
        }
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
        self.session.command("stop")?;
        self.session.wait_for_rest(PATIENCE)?;
        let (least, median, most) = cost.summary().ok_or("no tick was counted")?;
        let Case { modes, shaper, streams, motion } = case;
        Ok(format!(
            "[[tick]]\nmodes = {modes}\nshaper = \"{shaper}\"\nstreams = {streams}\nmotion = \"{}\"\n\
             history_samples = {samples}\nleast = {least}\nmedian = {median}\nmost = {most}\n",
            motion.state()
        ))
    }

    /// The deepest stack so far, start-up included, in bytes.
    pub fn deepest_stack(&mut self) -> Result<u32, Box<dyn Error>> {
        let stack = self.emulator.stack();
        let mut client = self.emulator.debug()?;
        let bytes = stack.deepest(&mut client)?;
        client.detach()?;
        Ok(bytes)
    }
}
