//! The lines of the drive and of the machine's surroundings, as one number that the tick hands to the pins in
//! one store.

use super::Outputs;

/// Levels of lines; one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines(u8);

impl Lines {
    /// None of them.
    pub const NONE: Self = Self(0);
    /// Changes with every tick while no fault holds the machine. What asks for the change notices that ticks
    /// stay away, too.
    pub const CHARGE_PUMP: Self = Self(1);
    /// The drive may run.
    pub const ENABLE: Self = Self(2);
    /// The brake is open.
    pub const BRAKE_OPEN: Self = Self(4);
    /// The drive is enabled, nothing is wrong, and the setpoint stands still for good.
    pub const IN_POSITION: Self = Self(8);

    /// How many combinations there are.
    pub const COMBINATIONS: usize = 16;

    /// The combination with this number, below [`Self::COMBINATIONS`]; higher bits say nothing.
    pub const fn numbered(number: usize) -> Self {
        Self((number % Self::COMBINATIONS) as u8)
    }

    /// The number of this combination.
    #[inline]
    pub const fn number(self) -> usize {
        self.0 as usize % Self::COMBINATIONS
    }

    /// Whether a line is high.
    pub const fn contains(self, line: Self) -> bool {
        self.0 & line.0 != 0
    }

    /// What of it the tick of this number shows: a charge pump that is high is so in every other tick.
    #[inline]
    pub fn in_tick(self, tick: u32) -> Self {
        // Every line but the pump; the pump is the lowest bit, as the parity is the tick's.
        const STEADY: u32 = Lines::COMBINATIONS as u32 - 2;
        Self((tick & 1 | STEADY) as u8 & self.0)
    }

    /// The same with a line at this level.
    #[inline]
    pub fn with(self, line: Self, high: bool) -> Self {
        Self(if high { self.0 | line.0 } else { self.0 & !line.0 })
    }

    /// The same with what the drive's state puts out. Who is not enabled is not in position.
    pub fn with_drive(self, outputs: Outputs) -> Self {
        let lines = self.with(Self::ENABLE, outputs.enable).with(Self::BRAKE_OPEN, outputs.brake_open);
        if outputs.enable { lines } else { lines.with(Self::IN_POSITION, false) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_line_is_a_bit_of_its_own_among_all_combinations() {
        for number in 0..Lines::COMBINATIONS {
            let lines = Lines::numbered(number);
            assert_eq!(lines.number(), number);
            for line in [Lines::ENABLE, Lines::BRAKE_OPEN, Lines::IN_POSITION, Lines::CHARGE_PUMP] {
                assert!(lines.with(line, true).contains(line) && !lines.with(line, false).contains(line));
            }
        }
    }

    #[test]
    fn the_charge_pump_alone_changes_from_tick_to_tick() {
        for number in 0..Lines::COMBINATIONS {
            let lines = Lines::numbered(number);
            for tick in [0, 1, 2, 3, u32::MAX - 1, u32::MAX] {
                let shown = lines.contains(Lines::CHARGE_PUMP) && tick % 2 == 1;
                assert_eq!(lines.in_tick(tick), lines.with(Lines::CHARGE_PUMP, shown));
            }
        }
    }

    #[test]
    fn a_drive_that_is_switched_off_is_not_in_position() {
        let lines = Lines::NONE.with(Lines::IN_POSITION, true).with(Lines::CHARGE_PUMP, true);
        assert_eq!(lines.with_drive(Outputs::default()), Lines::CHARGE_PUMP);
        let enabled = lines.with_drive(Outputs { enable: true, brake_open: true });
        assert_eq!(enabled.number(), 15);
    }
}
