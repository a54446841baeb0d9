//! `selftest` of the unmodified release image, against models of the step timer, the encoder's counter and
//! the converter; with the jumpers that docs/wiring.md asks for, and without.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use stillbeam::board::serial::SerialBoard;
use stillbeam::board::{Reply, Session};
use stillbeam_host_tests::emulator::clock_cover::{ClockCover, Region};
use stillbeam_host_tests::emulator::stand_in::Registers;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};
use stillbeam_host_tests::step_timer::{Counted, LENGTH, StepTimer, register};

const PATIENCE: Duration = Duration::from_secs(60);
const STEP_TIMER: Region = Region { base: 0x4001_0000, length: LENGTH };
/// The counter of the encoder's timer.
const ENCODER: Region = Region { base: 0x4001_0424, length: 4 };
/// The analog output's data.
const ANALOG: Region = Region { base: 0x4000_7408, length: 4 };
const CONVERTER: Region = Region { base: 0x4001_2000, length: 0x50 };
const CONVERTER_STATUS: u32 = CONVERTER.base;
const CONVERTER_CONTROL: u32 = CONVERTER.base + 0x08;
const CONVERTER_DATA: u32 = CONVERTER.base + 0x4c;
const CONVERTER_ON: u32 = 1;
const CONVERTER_START: u32 = 1 << 30;
const CONVERTED: u32 = 1 << 1;
/// Clocks of the step timer that a look at it takes.
const CLOCKS_PER_LOOK: u32 = 2000;

/// What is behind the pins.
struct Machine {
    clocks: ClockCover,
    timer: StepTimer,
    analog: u32,
    converter: BTreeMap<u32, u32>,
    converted: bool,
    /// PA8-PC6 and PA11-PC7.
    jumpers: bool,
}

impl Machine {
    fn new(jumpers: bool) -> Self {
        Self {
            clocks: ClockCover::default(),
            timer: StepTimer::default(),
            analog: 0,
            converter: BTreeMap::new(),
            converted: false,
            jumpers,
        }
    }

    /// All of the step timer but its prescaler, which is written as half a word and is left at zero.
    fn regions() -> Vec<Region> {
        let (before, after) = (register::PSC, register::PSC + 4);
        let step_timer = [(0, before), (after, LENGTH - after)]
            .map(|(offset, length)| Region { base: STEP_TIMER.base + offset, length });
        let others = [ENCODER, ANALOG, CONVERTER];
        ClockCover::REGIONS.into_iter().chain(step_timer).chain(others).collect()
    }
}

impl Registers for Machine {
    fn read(&mut self, address: u32) -> u32 {
        match address {
            CONVERTER_STATUS => u32::from(self.converted) * CONVERTED,
            CONVERTER_DATA => {
                self.converted = false;
                // A few codes of offset.
                self.analog + 5
            }
            _ if STEP_TIMER.contains(address) => {
                self.timer.advance(CLOCKS_PER_LOOK);
                self.timer.read(address - STEP_TIMER.base)
            }
            // Counts modulo 2¹⁶.
            _ if ENCODER.contains(address) && self.jumpers => self.timer.counted().counts as u32 & 0xffff,
            _ if ENCODER.contains(address) => 0,
            _ if ClockCover::covers(address) => self.clocks.read(address),
            _ => self.converter.get(&address).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        match address {
            _ if STEP_TIMER.contains(address) => self.timer.write(address - STEP_TIMER.base, value),
            _ if ANALOG.contains(address) => self.analog = value,
            _ if ClockCover::covers(address) => self.clocks.write(address, value),
            _ => {
                let starts = CONVERTER_START | CONVERTER_ON;
                self.converted |= address == CONVERTER_CONTROL && value & starts == starts;
                self.converter.insert(address, value & !CONVERTER_START);
            }
        }
    }
}

/// Switches the tick's interrupt, TIM2 of number 28, off or on. Each access that is served lets virtual time
/// go on to the next tick, so there would be nothing but ticks; and the tick reads the encoder.
fn switch_tick(emulator: &mut Emulator, on: bool) {
    let register = if on { 0xe000_e100 } else { 0xe000_e180 };
    let mut client = emulator.debug().expect("a link");
    client.write_word(register, 1 << 28).expect("written");
    client.detach().expect("detached");
}

/// Lets the board test itself.
fn test(emulator: &mut Emulator, session: &mut Session, jumpers: bool) -> (Reply, Machine) {
    let machine = Mutex::new(Machine::new(jumpers));
    switch_tick(emulator, false);
    let reply = emulator
        .standing_in(&Machine::regions(), &machine, || session.command("selftest").expect("tested"))
        .expect("every access is served");
    switch_tick(emulator, true);
    (reply, machine.into_inner().expect("no panic"))
}

#[test]
fn the_board_tests_itself_and_says_in_a_table_what_it_found() {
    let Some(image) = std::env::var_os("STILLBEAM_IMAGE").map(PathBuf::from) else {
        println!("not run: no firmware image; `cargo xtask test` builds one and sets STILLBEAM_IMAGE");
        return;
    };
    let mut emulator = Emulator::boot(&image, &EmulatorOptions::default()).expect("the image boots");
    let path = emulator.serial_port().to_str().expect("a readable path").to_owned();
    let port = SerialBoard::open(&path).expect("the port opens");
    let mut session = Session::start_within(Box::new(port), PATIENCE).expect("the console answers");

    let (reply, machine) = test(&mut emulator, &mut session, true);
    println!("{}", reply.lines.join("\n"));
    assert_eq!(reply.ok_line, "ok selftest passed=8 failed=0");
    let rows: Vec<Vec<&str>> =
        reply.lines.iter().map(|line| line.split_ascii_whitespace().collect()).collect();
    assert_eq!(rows[0], ["test", "name", "least", "most", "found", "verdict"]);
    assert_eq!(rows[1], ["test", "crystal", "1", "1", "1", "ok"]);
    assert_eq!(rows[2], ["test", "train_up_counts", "400", "400", "400", "ok"]);
    assert_eq!(rows[5], ["test", "step_down_counts", "-2", "-2", "-2", "ok"]);
    assert_eq!(rows[6], ["test", "analog_low_codes", "209", "289", "254", "ok"]);
    let Counted { counts, cut, ambiguous, edges } = machine.timer.counted();
    assert_eq!((counts, cut, ambiguous, edges), (0, 0, 0, 804), "there and back");
    assert_eq!(machine.timer.read(register::CR1) & 1, 0, "the timer is at rest");

    let (reply, _) = test(&mut emulator, &mut session, false);
    assert_eq!(reply.ok_line, "ok selftest passed=4 failed=4");
    assert!(reply.lines.iter().any(|line| line.ends_with("400       0 FAILED")), "{:?}", reply.lines);

    // It is not for a drive that runs, and the board goes on as before.
    session.enable_virtual_drive().expect("enabled");
    session.command("selftest").expect_err("refused");
}
