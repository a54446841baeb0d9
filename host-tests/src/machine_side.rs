//! What stands behind the pins of the released image: the step timer with a drive that counts, the lines of
//! drive and brake, and the analog output, all made from the image's accesses to their registers.
//!
//! The accesses come without their times. A tick begins where the image reads TIM9; a train is taken to begin
//! 1/32 of the tick later, which leaves it its 15/16.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::emulator::thumb::Direction;
use crate::emulator::unmodelled::Access;
use crate::step_timer::{Counted, LENGTH, StepTimer};

const STEP_TIMER: u32 = 0x4001_0000;
/// Where its registers end.
const STEP_TIMER_END: u32 = STEP_TIMER + LENGTH;
/// TIM9's counter, which every tick reads first.
const TICK_COUNTER: u32 = 0x4001_4024;
/// Port A's set and reset register: the direction.
const PORT_A: u32 = 0x4002_0018;
/// Port B's: enable, brake, and what others are told.
const PORT_B: u32 = 0x4002_0418;
/// The analog output's data.
const ANALOG: u32 = 0x4000_7408;

const DIRECTION_PIN: u32 = 11;
const ENABLE_PIN: u32 = 0;
const IN_POSITION_PIN: u32 = 5;
const CHARGE_PUMP_PIN: u32 = 6;
const BRAKE_PIN: u32 = 10;

/// The clock of the step timer.
const STEP_CLOCK_HZ: f64 = 168e6;
/// The part of a tick that passes before its train begins, as a divisor.
const BEFORE_TRAIN: u32 = 32;

/// What a tick has left behind when the next one begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickRecord {
    /// Steps that the drive has counted so far; two per step in quadrature.
    pub counts: i64,
    /// The code of the analog output.
    pub analog: u16,
    /// Whether the drive is enabled.
    pub enabled: bool,
    /// Whether the brake is open.
    pub brake_open: bool,
    /// The line "in position".
    pub in_position: bool,
    /// The charge pump's level.
    pub charge_pump: bool,
}

/// What must never happen, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Mishaps {
    /// Trains that were cut by a write.
    pub cut: u32,
    /// Edges that no drive can make sense of.
    pub ambiguous: u32,
    /// Times that the direction changed while a train was under way.
    pub turned_in_train: u32,
    /// Edges that came while the drive was off.
    pub edges_while_off: u64,
    /// Looks at the timer that said "at rest" while a train was under way: what the emulator always says.
    pub unseen_trains: u32,
}

/// The machine's side of the pins.
#[derive(Debug)]
pub struct MachineSide {
    timer: StepTimer,
    clocks_per_tick: u32,
    port_b: u32,
    analog: u16,
    ticking: bool,
    ticks: Vec<TickRecord>,
    mishaps: Mishaps,
}

impl MachineSide {
    /// A machine whose board ticks at `tick_hz`.
    pub fn new(tick_hz: f64) -> Self {
        let mut machine = Self {
            timer: StepTimer::default(),
            clocks_per_tick: 0,
            port_b: 0,
            analog: 0,
            ticking: false,
            ticks: Vec::new(),
            mishaps: Mishaps::default(),
        };
        machine.set_tick_rate(tick_hz);
        machine
    }

    /// The board ticks at `tick_hz` from now on. No train may be under way.
    pub fn set_tick_rate(&mut self, tick_hz: f64) {
        self.clocks_per_tick = (STEP_CLOCK_HZ / tick_hz) as u32;
    }

    /// The image has accessed a register.
    pub fn hear(&mut self, access: Access) {
        match (access.direction, access.address) {
            (Direction::Load, TICK_COUNTER) => self.begin_tick(),
            (Direction::Load, STEP_TIMER) => self.mishaps.unseen_trains += u32::from(self.timer.is_running()),
            (Direction::Store, STEP_TIMER..STEP_TIMER_END) => {
                self.timer.write(access.address - STEP_TIMER, access.value);
            }
            (Direction::Store, PORT_A) => self.set_port_a(access.value),
            (Direction::Store, PORT_B) => {
                self.port_b = (self.port_b & !(access.value >> 16)) | (access.value & 0xffff);
            }
            (Direction::Store, ANALOG) => self.analog = access.value as u16,
            _ => {}
        }
    }

    /// The ticks that have ended, from the board's tick 0 on.
    pub fn ticks(&self) -> &[TickRecord] {
        &self.ticks
    }

    /// What the drive has counted.
    pub fn counted(&self) -> Counted {
        self.timer.counted()
    }

    /// Levels of A and B, or of the step and nothing.
    pub fn step_outputs(&self) -> [bool; 2] {
        self.timer.outputs()
    }

    /// What went wrong so far.
    pub fn mishaps(&self) -> Mishaps {
        let Counted { cut, ambiguous, .. } = self.timer.counted();
        Mishaps { cut, ambiguous, ..self.mishaps }
    }

    fn is_enabled(&self) -> bool {
        self.port_b & (1 << ENABLE_PIN) != 0
    }

    /// The last tick has had its time.
    fn begin_tick(&mut self) {
        let edges = self.timer.counted().edges;
        let before_train = self.clocks_per_tick / BEFORE_TRAIN;
        self.timer.advance(self.clocks_per_tick - before_train);
        if self.ticking {
            self.ticks.push(TickRecord {
                counts: self.timer.counted().counts,
                analog: self.analog,
                enabled: self.is_enabled(),
                brake_open: self.port_b & (1 << BRAKE_PIN) != 0,
                in_position: self.port_b & (1 << IN_POSITION_PIN) != 0,
                charge_pump: self.port_b & (1 << CHARGE_PUMP_PIN) != 0,
            });
        }
        self.ticking = true;
        self.timer.advance(before_train);
        if !self.is_enabled() {
            self.mishaps.edges_while_off += self.timer.counted().edges - edges;
        }
    }

    fn set_port_a(&mut self, change: u32) {
        let up = match (change >> DIRECTION_PIN & 1 != 0, change >> (DIRECTION_PIN + 16) & 1 != 0) {
            (true, _) => true,
            (false, true) => false,
            (false, false) => return,
        };
        if up != self.timer.direction_up {
            self.mishaps.turned_in_train += u32::from(self.timer.is_running());
            self.timer.direction_up = up;
        }
    }
}

/// The machine as who stands in for registers sees it: it is told of the board by a thread of its own, so
/// that one has to wait until it has seen all that the board did before.
#[derive(Debug)]
pub struct Abreast {
    machine: Arc<Mutex<MachineSide>>,
    /// When it was asked first, and how many ticks it had seen then.
    first: Option<(u64, usize)>,
}

impl Abreast {
    /// From tick to tick at 4 kHz in the emulator.
    const TICK_CLOCKS: u64 = 21_000;
    /// Wall-clock limit for an emulator that tells nothing any more.
    const PATIENCE: Duration = Duration::from_secs(60);

    /// Of a board that ticks at 4 kHz.
    pub fn new(machine: Arc<Mutex<MachineSide>>) -> Self {
        Self { machine, first: None }
    }

    /// What the drive has counted until the tick of this time.
    ///
    /// # Panics
    /// Where the machine is not told of the board any more.
    pub fn counts(&mut self, clocks: u64) -> i64 {
        let deadline = Instant::now() + Self::PATIENCE;
        loop {
            let machine = self.machine.lock().unwrap_or_else(PoisonError::into_inner);
            let seen = machine.ticks().len();
            let (since, ticks) = *self.first.get_or_insert((clocks, seen));
            let due = ticks + ((clocks - since + Self::TICK_CLOCKS / 2) / Self::TICK_CLOCKS) as usize;
            if seen >= due {
                return machine.counted().counts;
            }
            drop(machine);
            assert!(Instant::now() < deadline, "the emulator tells nothing any more");
            std::thread::yield_now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step_timer::register;

    fn store(machine: &mut MachineSide, address: u32, value: u32) {
        machine.hear(Access { address, direction: Direction::Store, value });
    }

    fn tick(machine: &mut MachineSide) {
        machine.hear(Access { address: TICK_COUNTER, direction: Direction::Load, value: 0 });
    }

    /// Three steps of 1000 counts, as the board's driver writes them.
    fn train(machine: &mut MachineSide) {
        for (offset, value) in [
            (register::CCR1, 500),
            (register::ARR, 999),
            (register::RCR, 2),
            (register::EGR, 1),
            (register::CR1, 9),
        ] {
            store(machine, STEP_TIMER + offset, value);
        }
    }

    fn stepping() -> MachineSide {
        let mut machine = MachineSide::new(4000.0);
        store(&mut machine, STEP_TIMER + register::CCMR1, 7 << 4);
        tick(&mut machine);
        machine
    }

    #[test]
    fn a_train_of_an_enabled_drive_is_counted_in_its_tick() {
        let mut machine = stepping();
        store(&mut machine, PORT_B, 1 << ENABLE_PIN | 1 << BRAKE_PIN | 1 << CHARGE_PUMP_PIN);
        store(&mut machine, PORT_A, 1 << DIRECTION_PIN);
        store(&mut machine, ANALOG, 2048);
        train(&mut machine);
        tick(&mut machine);
        let expected = TickRecord {
            counts: 3,
            analog: 2048,
            enabled: true,
            brake_open: true,
            in_position: false,
            charge_pump: true,
        };
        assert_eq!((machine.ticks(), machine.mishaps()), (&[expected][..], Mishaps::default()));
        store(&mut machine, PORT_A, 1 << (DIRECTION_PIN + 16));
        train(&mut machine);
        tick(&mut machine);
        assert_eq!(machine.ticks()[1].counts, 0);
    }

    #[test]
    fn each_mishap_is_seen() {
        let mut off = stepping();
        train(&mut off);
        tick(&mut off);
        assert_eq!(off.mishaps().edges_while_off, 3);
        let mut cut = stepping();
        train(&mut cut);
        store(&mut cut, STEP_TIMER + register::CR1, 8);
        assert_eq!(cut.mishaps().cut, 1);
        let mut turned = stepping();
        train(&mut turned);
        store(&mut turned, PORT_A, 1 << DIRECTION_PIN);
        assert_eq!(turned.mishaps().turned_in_train, 1);
        let mut unseen = stepping();
        train(&mut unseen);
        unseen.hear(Access { address: STEP_TIMER, direction: Direction::Load, value: 0 });
        assert_eq!(unseen.mishaps().unseen_trains, 1);
    }
}
