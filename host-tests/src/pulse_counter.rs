//! The counter of another controller's pulses, TIM3, as its registers are described in RM0090
//! (general-purpose timers): the inputs' filters, their exclusive or, and the encoder interface that counts
//! the edges of both; and the pins that it looks at.
//!
//! It takes the writes of whoever sets it up, changes of its pins, and time in clocks of the timer. An edge
//! is known at once where a real timer takes a few clocks more to synchronise it, the same for every pin.

/// Offsets of the registers.
pub mod register {
    /// Control 1.
    pub const CR1: u32 = 0x00;
    /// Control 2.
    pub const CR2: u32 = 0x04;
    /// Slave mode.
    pub const SMCR: u32 = 0x08;
    /// Capture and compare mode of channels 1 and 2.
    pub const CCMR1: u32 = 0x18;
    /// Capture and compare enable.
    pub const CCER: u32 = 0x20;
    /// Counter.
    pub const CNT: u32 = 0x24;
    /// Prescaler.
    pub const PSC: u32 = 0x28;
    /// Auto-reload.
    pub const ARR: u32 = 0x2c;
}

/// Bytes of the timer's registers.
pub const LENGTH: u32 = 0x50;

/// The pins, in the order of the timer's channels: PA6, PA7, PC8.
pub const PINS: usize = 3;

/// An input behind its filter.
#[derive(Debug, Clone, Copy, Default)]
struct Filtered {
    level: bool,
    /// What is there before the filter.
    input: bool,
    /// The clock of the next change behind the filter, if the input stays as it is.
    changes_at: Option<u64>,
}

/// The timer with its pins.
#[derive(Debug, Clone, Default)]
pub struct PulseCounter {
    registers: [u32; (LENGTH / 4) as usize],
    pins: [bool; PINS],
    inputs: [Filtered; 2],
    clock: u64,
    ambiguous: u32,
}

impl PulseCounter {
    /// Writes a register; others than those of [`register`] are kept and do nothing.
    pub fn write(&mut self, offset: u32, value: u32) {
        if let Some(register) = self.registers.get_mut((offset / 4) as usize) {
            *register = value;
        }
        self.look_at_pins();
    }

    /// What a register reads.
    pub fn read(&self, offset: u32) -> u32 {
        self.registers.get((offset / 4) as usize).copied().unwrap_or_default()
    }

    /// Edges of both inputs at once, of which no decoder knows the direction.
    pub fn ambiguous(&self) -> u32 {
        self.ambiguous
    }

    /// Sets a pin at this clock, which is not before the one that was last named.
    pub fn set_pin(&mut self, clock: u64, pin: usize, level: bool) {
        self.advance(clock);
        self.pins[pin] = level;
        self.look_at_pins();
    }

    /// Goes on to this clock.
    pub fn advance(&mut self, clock: u64) {
        while let Some(next) = self.inputs.iter().filter_map(|input| input.changes_at).min() {
            if next > clock {
                break;
            }
            self.clock = next;
            let changed = self.inputs.map(|input| input.changes_at == Some(next));
            for (input, changed) in self.inputs.iter_mut().zip(changed) {
                if changed {
                    input.level = input.input;
                    input.changes_at = None;
                }
            }
            self.count(changed);
        }
        self.clock = clock;
    }

    /// The exclusive or of all pins goes to the first input where CR2 says so (TI1S).
    fn look_at_pins(&mut self) {
        let [first, second, third] = self.pins;
        let all = self.read(register::CR2) & (1 << 7) != 0;
        let levels = [if all { first ^ second ^ third } else { first }, second];
        for (channel, level) in levels.into_iter().enumerate() {
            let (every, samples) = self.filter(channel);
            let input = &mut self.inputs[channel];
            if level != input.input {
                input.input = level;
                let first_sample = self.clock.div_ceil(every) * every;
                input.changes_at = (level != input.level).then(|| first_sample + (samples - 1) * every);
            }
        }
    }

    /// Clocks from one sample to the next, and how many equal ones a change takes (ICxF, with CKD 0).
    fn filter(&self, channel: usize) -> (u64, u64) {
        let value = self.read(register::CCMR1) >> (8 * channel + 4) & 15;
        match value {
            0 => (1, 1),
            1 => (1, 2),
            2 => (1, 4),
            3 => (1, 8),
            4..=9 => (1 << (value / 2 - 1), if value.is_multiple_of(2) { 6 } else { 8 }),
            10..=12 => (16, [5, 6, 8][value as usize - 10]),
            _ => (32, [5, 6, 8][value as usize - 13]),
        }
    }

    /// The encoder interface: by the level of the other input each edge is one up or one down.
    fn count(&mut self, changed: [bool; 2]) {
        const BOTH_INPUTS: u32 = 0x0101;
        let enabled = self.read(register::CR1) & 1 != 0;
        let decodes = self.read(register::SMCR) & 7 == 3
            && self.read(register::CCMR1) & 0x0303 == BOTH_INPUTS
            && self.read(register::CCER) == 0
            && self.read(register::PSC) == 0;
        if !enabled || !decodes {
            return;
        }
        let [first, second] = self.inputs.map(|input| input.level);
        let up = match changed {
            [true, true] => {
                self.ambiguous += 1;
                return;
            }
            [true, false] => first != second,
            [false, true] => first == second,
            [false, false] => return,
        };
        let period = self.read(register::ARR) + 1;
        let counter = &mut self.registers[(register::CNT / 4) as usize];
        *counter = (*counter + if up { 1 } else { period - 1 }) % period;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the board sets it up, at rest; an enabled counter of steps or of quadrature.
    fn counting(steps: bool, [direction, step]: [bool; 2]) -> PulseCounter {
        let mut counter = PulseCounter { pins: [direction, step, false], ..PulseCounter::default() };
        let filters = if steps { 0x5 << 4 | 0x2 << 12 } else { 0x3 << 4 | 0x3 << 12 };
        for (offset, value) in [
            (register::CR2, if steps { 1 << 7 } else { 0 }),
            (register::CCMR1, 0x0101 | filters),
            (register::ARR, 0xffff),
        ] {
            counter.write(offset, value);
        }
        counter.advance(1000);
        counter.write(register::SMCR, 3);
        counter.write(register::CR1, 1);
        counter
    }

    fn edges(counter: &PulseCounter) -> i16 {
        counter.read(register::CNT) as u16 as i16
    }

    const DIRECTION: usize = 0;
    const STEP: usize = 1;
    /// A quarter of a microsecond, as the wiring page asks for.
    const PULSE: u64 = 21;

    #[test]
    fn a_step_is_four_edges_whichever_its_level_at_rest_and_the_direction_is_that_at_its_edge() {
        for at_rest in [false, true] {
            for start in [false, true] {
                let mut counter = counting(true, [start, at_rest]);
                let (mut clock, mut steps) = (2000, 0_i16);
                for (round, up) in
                    [true, true, false, false, false, true, false, true].into_iter().enumerate()
                {
                    counter.set_pin(clock, DIRECTION, up);
                    clock += PULSE;
                    for _ in 0..=round {
                        counter.set_pin(clock, STEP, !at_rest);
                        counter.set_pin(clock + PULSE, STEP, at_rest);
                        clock += 2 * PULSE;
                        steps += if up { 1 } else { -1 };
                    }
                    counter.advance(clock);
                    assert_eq!(
                        (edges(&counter) + 1) >> 2,
                        steps,
                        "at rest {at_rest}, begun {start}, up {up}"
                    );
                }
                assert_eq!(counter.ambiguous(), 0);
            }
        }
    }

    #[test]
    fn a_direction_that_changes_with_the_end_of_a_pulse_loses_nothing() {
        for late in 0..40 {
            let mut counter = counting(true, [true, false]);
            for step in 0..10 {
                let clock = 2000 + 200 * step;
                let up = step % 2 == 0;
                counter.set_pin(clock, STEP, true);
                counter.set_pin(clock + PULSE, STEP, false);
                counter.set_pin(clock + PULSE + late, DIRECTION, !up);
            }
            counter.advance(10_000);
            assert_eq!(((edges(&counter) + 1) >> 2, counter.ambiguous()), (0, 0), "{late} clocks later");
        }
    }

    #[test]
    fn what_is_shorter_than_the_filter_counts_nothing() {
        for length in 1..14 {
            let mut counter = counting(true, [true, false]);
            counter.set_pin(2000, STEP, true);
            counter.set_pin(2000 + length, STEP, false);
            counter.advance(3000);
            assert_eq!(edges(&counter), 0, "{length} clocks");
        }
    }

    #[test]
    fn quadrature_counts_every_edge_up_and_down() {
        let mut counter = counting(false, [false, false]);
        let turn = [[true, false], [true, true], [false, true], [false, false]];
        let mut clock = 2000;
        for (round, turns) in [turn, {
            let mut back = turn;
            back.reverse();
            back
        }]
        .into_iter()
        .enumerate()
        {
            for _ in 0..3 {
                for levels in turns {
                    for (pin, level) in levels.into_iter().enumerate() {
                        counter.set_pin(clock, pin, level);
                    }
                    clock += PULSE;
                }
            }
            counter.advance(clock);
            // Back begins where the last turn has ended, so its first place is no edge.
            assert_eq!(edges(&counter), [12, 1][round]);
        }
    }
}
