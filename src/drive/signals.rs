//! What the machine's surroundings are told.

/// Two lines, in every tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Signals {
    /// The drive is enabled, nothing is wrong, and the setpoint stands still for good.
    pub in_position: bool,
    /// A level that changes with every tick while no fault holds the machine. A relay that asks for the change drops out when
    /// ticks stay away too.
    pub charge_pump: bool,
}
