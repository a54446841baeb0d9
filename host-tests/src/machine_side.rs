//! What stands behind the pins of the released image: the step timer with a drive that counts, the enable and brake lines, the
//! analog output, and an encoder that is wired to the steps.

use std::collections::BTreeMap;

use crate::emulator::clock_cover::Region;
use crate::emulator::stand_in::Registers;
use crate::step_timer::{Counted, LENGTH, StepTimer};

const STEP_TIMER: Region = Region { base: 0x4001_0000, length: LENGTH };
/// Port A's set and reset register: the direction.
const PORT_A: Region = Region { base: 0x4002_0018, length: 4 };
/// Port B's: enable and brake.
const PORT_B: Region = Region { base: 0x4002_0418, length: 4 };
/// The counter of the encoder's timer.
const ENCODER: Region = Region { base: 0x4001_0424, length: 4 };
/// The analog output's data, which every tick writes.
const ANALOG: Region = Region { base: 0x4000_7408, length: 4 };
/// The converter, which measures the analog output.
const CONVERTER: Region = Region { base: 0x4001_2000, length: 0x50 };
const CONVERTER_STATUS: u32 = CONVERTER.base;
const CONVERTER_CONTROL: u32 = CONVERTER.base + 0x08;
const CONVERTER_DATA: u32 = CONVERTER.base + 0x4c;
const CONVERTER_ON: u32 = 1;
const CONVERTER_START: u32 = 1 << 30;
const CONVERTED: u32 = 1 << 1;

const DIRECTION_PIN: u32 = 11;
const ENABLE_PIN: u32 = 0;
const IN_POSITION_PIN: u32 = 5;
const CHARGE_PUMP_PIN: u32 = 6;
const BRAKE_PIN: u32 = 10;
/// The emulator's timer counts nanoseconds where the board's counts clocks (`tick_alignment`), and the step timer's clock is
/// twice as fast.
const STEP_CLOCKS_PER_NS: u32 = 2;

/// The machine's side of the pins.
#[derive(Debug, Default)]
pub struct MachineSide {
    timer: StepTimer,
    levels_b: u32,
    /// When the timer was last brought up to date.
    at_ns: Option<u32>,
    analog_codes: Vec<u16>,
    /// The converter's registers but the status and the data.
    converter: BTreeMap<u32, u32>,
    converted: bool,
    /// Nothing connects the step timer's pins to the encoder's.
    pub jumpers_missing: bool,
    /// Levels of the charge pump that differ from the one before.
    pump_edges: u64,
    /// Writes of all lines, one per tick.
    line_writes: u64,
    /// Edges that came while the drive was off.
    edges_while_off: u64,
    /// Times that the drive was switched on.
    enables: u32,
    /// Times that the direction changed while a train was under way.
    turned_in_train: u32,
}

impl MachineSide {
    /// What the image must not reach itself.
    pub const REGIONS: [Region; 6] = [STEP_TIMER, PORT_A, PORT_B, ENCODER, ANALOG, CONVERTER];

    /// What the drive has counted.
    pub fn counted(&self) -> Counted {
        self.timer.counted()
    }

    /// A and B, or the step and nothing.
    pub fn step_outputs(&self) -> [bool; 2] {
        self.timer.outputs()
    }

    /// Whether the drive is enabled.
    pub fn is_enabled(&self) -> bool {
        self.levels_b & (1 << ENABLE_PIN) != 0
    }

    /// Whether the board says that the setpoint stands still for good.
    pub fn is_in_position(&self) -> bool {
        self.levels_b & (1 << IN_POSITION_PIN) != 0
    }

    /// Changes of the charge pump's level, and how often it could have changed, since the last time this was asked.
    pub fn take_pump_edges(&mut self) -> (u64, u64) {
        (std::mem::take(&mut self.pump_edges), std::mem::take(&mut self.line_writes))
    }

    /// Whether the brake is open.
    pub fn is_brake_open(&self) -> bool {
        self.levels_b & (1 << BRAKE_PIN) != 0
    }

    /// Edges that came while the drive was off.
    pub fn edges_while_off(&self) -> u64 {
        self.edges_while_off
    }

    /// Times that the drive was switched on.
    pub fn enables(&self) -> u32 {
        self.enables
    }

    /// Times that the direction changed while a train was under way.
    pub fn turned_in_train(&self) -> u32 {
        self.turned_in_train
    }

    /// The analog output's codes, one per tick, since the last time this was asked.
    pub fn take_analog_codes(&mut self) -> Vec<u16> {
        std::mem::take(&mut self.analog_codes)
    }

    /// Lets the timer run up to now.
    fn catch_up(&mut self, now_ns: u32) {
        let before = self.at_ns.replace(now_ns).unwrap_or(now_ns);
        let edges = self.timer.counted().edges;
        // Accesses come every tick; a board that stands still longer than this has no train left anyway.
        let passed_ns = now_ns.wrapping_sub(before).min(u32::MAX / 4);
        self.timer.advance(passed_ns * STEP_CLOCKS_PER_NS);
        if !self.is_enabled() {
            self.edges_while_off += self.timer.counted().edges - edges;
        }
    }

    /// The converter measures what the analog output shows: the last code.
    fn read_converter(&mut self, address: u32) -> u32 {
        match address {
            CONVERTER_STATUS => u32::from(self.converted) * CONVERTED,
            CONVERTER_DATA => {
                self.converted = false;
                self.analog_codes.last().copied().map_or(0, u32::from)
            }
            _ => self.converter.get(&address).copied().unwrap_or(0),
        }
    }

    fn set_port_a(&mut self, change: u32) {
        let up = match (change >> DIRECTION_PIN & 1 != 0, change >> (DIRECTION_PIN + 16) & 1 != 0) {
            (true, _) => true,
            (false, true) => false,
            (false, false) => return,
        };
        if up != self.timer.direction_up {
            self.turned_in_train += u32::from(self.timer.is_running());
            self.timer.direction_up = up;
        }
    }

    fn set_port_b(&mut self, change: u32) {
        let (was_enabled, before) = (self.is_enabled(), self.levels_b);
        self.levels_b = (self.levels_b & !(change >> 16)) | (change & 0xffff);
        self.enables += u32::from(self.is_enabled() && !was_enabled);
        self.pump_edges += u64::from((before ^ self.levels_b) >> CHARGE_PUMP_PIN & 1);
        self.line_writes += 1;
    }
}

impl Registers for MachineSide {
    fn read(&mut self, address: u32, now_ns: u32) -> u32 {
        self.catch_up(now_ns);
        if STEP_TIMER.contains(address) {
            self.timer.read(address - STEP_TIMER.base)
        } else if ENCODER.contains(address) && self.jumpers_missing {
            0
        } else if ENCODER.contains(address) {
            // Counts modulo 2¹⁶.
            self.timer.counted().counts as u32 & 0xffff
        } else {
            self.read_converter(address)
        }
    }

    fn write(&mut self, address: u32, value: u32, now_ns: u32) {
        self.catch_up(now_ns);
        if STEP_TIMER.contains(address) {
            self.timer.write(address - STEP_TIMER.base, value);
        } else if PORT_A.contains(address) {
            self.set_port_a(value);
        } else if PORT_B.contains(address) {
            self.set_port_b(value);
        } else if ANALOG.contains(address) {
            self.analog_codes.push(value as u16);
        } else if CONVERTER.contains(address) {
            self.converted |=
                address == CONVERTER_CONTROL && value & CONVERTER_START != 0 && value & CONVERTER_ON != 0;
            self.converter.insert(address, value & !CONVERTER_START);
        }
    }
}
