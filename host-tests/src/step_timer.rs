//! The step timer, TIM1, as its registers are described in RM0090 (advanced-control timers): one-pulse mode,
//! repetition counter, PWM mode 2 and toggle on match; and what stands behind its pins, a drive that counts.
//!
//! It takes the writes of whoever drives it, the board's code in the emulator or a test, and time.

/// Offsets of the registers.
pub mod register {
    /// Control 1.
    pub const CR1: u32 = 0x00;
    /// Event generation.
    pub const EGR: u32 = 0x14;
    /// Capture and compare mode of channels 1 and 2.
    pub const CCMR1: u32 = 0x18;
    /// The same of channels 3 and 4.
    pub const CCMR2: u32 = 0x1c;
    /// Capture and compare enable.
    pub const CCER: u32 = 0x20;
    /// Prescaler.
    pub const PSC: u32 = 0x28;
    /// Auto-reload.
    pub const ARR: u32 = 0x2c;
    /// Repetitions.
    pub const RCR: u32 = 0x30;
    /// Compare value of channel 1.
    pub const CCR1: u32 = 0x34;
    /// Compare value of channel 4.
    pub const CCR4: u32 = 0x40;
    /// Break and dead time.
    pub const BDTR: u32 = 0x44;
}

/// Bytes of the timer's registers.
pub const LENGTH: u32 = 0x50;
const ENABLED: u32 = 1;
const ONE_PULSE: u32 = 1 << 3;

/// What the drive has counted, and what was wrong with what it got.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counted {
    /// Steps, up less down; two per step in quadrature.
    pub counts: i64,
    /// Edges that no drive can make sense of: A and B at the same time.
    pub ambiguous: u32,
    /// Trains that were cut by a write.
    pub cut: u32,
    /// Edges so far, of steps or of A and B.
    pub edges: u64,
}

/// The timer and the drive behind it.
#[derive(Debug, Clone, Default)]
pub struct StepTimer {
    registers: [u32; (LENGTH / 4) as usize],
    counter: u32,
    /// What UG loaded.
    prescaler: u32,
    repetitions_left: u32,
    /// Clocks of the timer that do not make a count yet.
    clocks: u32,
    /// The references of channels 1 and 4.
    outputs: [bool; 2],
    /// Level of the direction's pin.
    pub direction_up: bool,
    counted: Counted,
}

impl StepTimer {
    /// What the drive has counted.
    pub fn counted(&self) -> Counted {
        self.counted
    }

    /// Whether a train is under way.
    pub fn is_running(&self) -> bool {
        self.read(register::CR1) & ENABLED != 0
    }

    /// A and B, or the step and nothing.
    pub fn outputs(&self) -> [bool; 2] {
        self.outputs
    }

    /// What a register holds.
    pub fn read(&self, offset: u32) -> u32 {
        self.registers.get((offset / 4) as usize).copied().unwrap_or_default()
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, value: u32) {
        let running = self.is_running();
        match offset {
            register::CR1 if running && value & ENABLED == 0 => self.counted.cut += 1,
            register::ARR | register::PSC | register::RCR | register::CCR1 | register::CCR4 if running => {
                self.counted.cut += 1;
            }
            register::EGR => {
                if running {
                    self.counted.cut += 1;
                }
                self.counter = 0;
                self.clocks = 0;
                self.prescaler = self.read(register::PSC);
                self.repetitions_left = self.read(register::RCR);
                return;
            }
            _ => {}
        }
        if let Some(place) = self.registers.get_mut((offset / 4) as usize) {
            *place = value;
        }
        self.show();
    }

    /// Lets so many clocks of the timer, of 168 MHz, pass.
    pub fn advance(&mut self, clocks: u32) {
        let divider = self.prescaler + 1;
        let mut counts = (self.clocks + clocks) / divider;
        self.clocks = (self.clocks + clocks) % divider;
        while counts > 0 && self.is_running() {
            let reload = self.read(register::ARR) & 0xffff;
            let next = [self.read(register::CCR1), self.read(register::CCR4), reload + 1]
                .into_iter()
                .filter(|place| *place > self.counter)
                .min()
                .unwrap_or(reload + 1);
            let way = (next - self.counter).min(counts);
            counts -= way;
            self.counter += way;
            if self.counter > reload {
                self.counter = 0;
                self.end_period();
            }
            self.compare();
        }
    }

    fn end_period(&mut self) {
        if self.repetitions_left > 0 {
            self.repetitions_left -= 1;
        } else if self.read(register::CR1) & ONE_PULSE != 0 {
            self.registers[0] &= !ENABLED;
        }
    }

    fn mode(&self, channel: usize) -> u32 {
        if channel == 0 {
            (self.read(register::CCMR1) >> 4) & 7
        } else {
            (self.read(register::CCMR2) >> 12) & 7
        }
    }

    /// What a match changes.
    fn compare(&mut self) {
        let mut after = self.outputs;
        for (channel, place) in [(0, register::CCR1), (1, register::CCR4)] {
            if self.mode(channel) == 3 && self.counter == self.read(place) {
                after[channel] = !after[channel];
            }
        }
        self.put(after);
        self.show();
    }

    /// Outputs that follow from the counter and the mode alone.
    fn show(&mut self) {
        let mut after = self.outputs;
        for (channel, place) in [(0, register::CCR1), (1, register::CCR4)] {
            match self.mode(channel) {
                4 => after[channel] = false,
                // PWM mode 2: active from the match on.
                7 => after[channel] = self.is_running() && self.counter >= self.read(place),
                _ => {}
            }
        }
        self.put(after);
    }

    fn put(&mut self, after: [bool; 2]) {
        let before = std::mem::replace(&mut self.outputs, after);
        if before == after {
            return;
        }
        if self.mode(0) == 7 {
            if !before[0] && after[0] {
                self.counted.counts += if self.direction_up { 1 } else { -1 };
                self.counted.edges += 1;
            }
            return;
        }
        self.counted.edges += 1;
        let place = |[a, b]: [bool; 2]| i64::from(b) * 2 + i64::from(a != b);
        // A leads B upwards: 00, 10, 11, 01.
        match (place(after) - place(before)).rem_euclid(4) {
            1 => self.counted.counts += 1,
            3 => self.counted.counts -= 1,
            _ => self.counted.ambiguous += 1,
        }
    }
}
