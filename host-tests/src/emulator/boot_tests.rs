//! The driver against a board in memory that stops where it is told to.

use std::collections::{BTreeMap, VecDeque};
use std::io;

use super::*;

const RCC_CR: u32 = 0x4002_3800;
const TIM2_EGR: u32 = 0x4000_0014;
const TIM2_CNT: u32 = 0x4000_0024;
const TIM5_CNT: u32 = 0x4000_0c24;
const BOOT_COMPLETE: u32 = 0x0800_0400;
/// `str r1, [r0]`, `ldr r2, [r0]`.
const STORE: u16 = 0x6001;
const LOAD: u16 = 0x6802;

/// One stop of the CPU: registers change as the code between would have changed them.
#[derive(Clone)]
struct Stop {
    pc: u32,
    watched: bool,
    registers: Vec<(u8, u32)>,
}

/// A stub with just enough behind it.
#[derive(Default)]
struct Board {
    registers: BTreeMap<u8, u32>,
    words: BTreeMap<u32, u32>,
    stops: VecDeque<Stop>,
    /// Registers at the moment of each resumption.
    seen: Vec<BTreeMap<u8, u32>>,
    commands: Vec<String>,
    incoming: Vec<u8>,
    outgoing: VecDeque<u8>,
}

impl Board {
    fn answer(&mut self, command: &str) -> Option<String> {
        let number = |text: &str| u32::from_str_radix(text, 16).expect("hex");
        let word = |value: u32| format!("{:08x}", value.swap_bytes());
        let (name, rest) = command.split_at(1);
        Some(match name {
            "p" => word(self.registers.get(&(number(rest) as u8)).copied().unwrap_or(0)),
            "P" => {
                let (register, value) = rest.split_once('=').expect("register=value");
                self.registers.insert(number(register) as u8, number(value).swap_bytes());
                "OK".to_owned()
            }
            "m" => {
                let (address, _) = rest.split_once(',').expect("address,length");
                word(self.words.get(&number(address)).copied().unwrap_or(0))
            }
            "M" => {
                let (place, value) = rest.split_once(':').expect("address,length:value");
                let (address, _) = place.split_once(',').expect("address,length");
                self.words.insert(number(address), number(value).swap_bytes());
                "OK".to_owned()
            }
            "c" => {
                self.seen.push(self.registers.clone());
                let stop = self.stops.pop_front()?;
                self.registers.extend(stop.registers);
                self.registers.insert(PC, stop.pc);
                if stop.watched { "T05thread:01;awatch:40023800;" } else { "T05thread:01;" }.to_owned()
            }
            _ => "OK".to_owned(),
        })
    }

    fn reply(&mut self, payload: &str) {
        let sum = payload.bytes().fold(0_u8, u8::wrapping_add);
        self.outgoing.extend(format!("${payload}#{sum:02x}").bytes());
    }
}

impl Read for &mut Board {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.outgoing.is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        self.outgoing.read(buffer)
    }
}

impl Write for &mut Board {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for &byte in bytes {
            match (byte, self.incoming.is_empty()) {
                (0x03, true) => self.reply("T02thread:01;"),
                (b'$', true) | (_, false) => self.incoming.push(byte),
                _ => {}
            }
            if self.incoming.len() > 3 && self.incoming[self.incoming.len() - 3] == b'#' {
                let packet = String::from_utf8(std::mem::take(&mut self.incoming)).expect("text");
                let command = &packet[1..packet.len() - 3];
                self.commands.push(command.to_owned());
                self.outgoing.push_back(b'+');
                if let Some(answer) = self.answer(command) {
                    self.reply(&answer);
                }
            }
        }
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn access(pc: u32, address: u32, value: u32) -> Stop {
    Stop { pc, watched: true, registers: vec![(0, address), (1, value)] }
}

fn complete() -> Stop {
    Stop { pc: BOOT_COMPLETE, watched: false, registers: vec![] }
}

/// A board whose code has `STORE` at ..00 and `LOAD` at ..02 of 0x08000100.
fn board(stops: impl IntoIterator<Item = Stop>) -> Board {
    let code = u32::from(STORE) | (u32::from(LOAD) << 16);
    Board {
        words: BTreeMap::from([(0x0800_0100, code), (0x0800_0102, u32::from(LOAD)), (TIM5_CNT, 123_456)]),
        stops: stops.into_iter().collect(),
        ..Board::default()
    }
}

fn run(board: &mut Board) -> Result<BootReport, String> {
    let symbols = ImageSymbols::of_functions(vec![
        (0x0800_0100, 0x20, "start_clocks".to_owned()),
        (BOOT_COMPLETE, 4, "stillbeam_boot_complete".to_owned()),
    ])
    .expect("the function is there");
    boot(RspClient::new(board), &symbols, Circumstances::default(), Duration::from_millis(30)).map_err(
        |failure| match failure {
            BootFailure::Emulator(error) => error.to_string(),
            BootFailure::Link(error) => error.to_string(),
        },
    )
}

fn start_timer() -> Stop {
    access(0x0800_0100, TIM2_EGR, 1)
}

#[test]
fn a_start_up_is_served_and_left_alone_afterwards() {
    let mut board = board([
        access(0x0800_0100, RCC_CR, 0x0001_0083),
        access(0x0800_0102, RCC_CR, 0),
        complete(),
        start_timer(),
    ]);
    let report = run(&mut board).expect("it boots");
    assert_eq!(report.served_accesses, 3);
    let after_load = &board.seen[2];
    assert_eq!(after_load[&2], 0x0003_0083, "HSE is ready as soon as it is on");
    assert_eq!(after_load[&PC], 0x0800_0104, "the load is stepped over");
    assert!(!board.words.contains_key(&RCC_CR), "no write reaches the emulator's own registers");
    for set in board.commands.iter().filter(|command| command.starts_with('Z')) {
        let removed = format!("z{}", &set[1..]);
        assert!(board.commands.contains(&removed), "{set} stays");
    }
    assert_eq!(board.commands.last().map(String::as_str), Some("D"));
}

#[test]
fn the_tick_timer_gets_an_offset_of_zero_in_either_order() {
    for stops in [[complete(), start_timer()], [start_timer(), complete()]] {
        let mut board = board(stops);
        run(&mut board).expect("it boots");
        assert_eq!(board.words.get(&TIM2_CNT), Some(&123_456), "counter = virtual time");
        assert!(!board.words.contains_key(&TIM2_EGR));
    }
}

#[test]
fn an_event_that_is_not_an_update_reaches_the_timer_and_starts_nothing() {
    let mut board = board([complete(), access(0x0800_0100, TIM2_EGR, 0x40), start_timer()]);
    run(&mut board).expect("it boots");
    assert_eq!(board.words.get(&TIM2_EGR), Some(&0x40));
}

#[test]
fn a_start_up_that_hangs_is_reported_with_where_and_what() {
    let mut hanging = board([access(0x0800_0100, RCC_CR, 0x83)]);
    let error = run(&mut hanging).expect_err("nothing follows");
    for part in ["stillbeam_boot_complete", "start_clocks+0x2", "1 covered", "0x83 to 0x40023800"] {
        assert!(error.contains(part), "{part} in {error}");
    }
    let error = run(&mut board([complete()])).expect_err("no timer");
    assert!(error.contains("did not start its tick timer"), "{error}");
}

#[test]
fn a_start_up_that_polls_for_ever_ends_at_the_limit() {
    let poll = access(0x0800_0102, RCC_CR, 0);
    let error = run(&mut board(std::iter::repeat_n(poll, 100_000))).expect_err("never ready");
    assert!(error.contains("a read of 0x83 at 0x40023800"), "{error}");
}

#[test]
fn accesses_that_cannot_be_served_are_refused_with_their_place() {
    let mut byte_access = board([access(0x0800_0100, RCC_CR, 0)]);
    byte_access.words.insert(0x0800_0100, 0x7001);
    let error = run(&mut byte_access).expect_err("strb");
    assert!(
        error.contains("start_clocks+0x0") && error.contains("STRB") && error.contains("7001"),
        "{error}"
    );
    let error = run(&mut board([access(0x0800_0100, 0x2000_0000, 0)])).expect_err("not covered");
    assert!(error.contains("0x20000000"), "{error}");
}

#[test]
fn another_breakpoint_is_not_mistaken_for_the_end() {
    let elsewhere = Stop { pc: 0x0800_0110, watched: false, registers: vec![] };
    let error = run(&mut board([elsewhere])).expect_err("not the end");
    assert!(error.contains("start_clocks+0x10") && error.contains("signal 5"), "{error}");
}
