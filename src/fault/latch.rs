//! Faults that stop the machine until they are cleared.

/// Why the machine is stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// A tick was missed: the setpoint stood still while it should have moved.
    MissedTick = 1,
    /// The setpoint would have left the travel.
    Limit = 2,
    /// The encoder is off the setpoint by more than the window.
    Encoder = 3,
    /// The emergency input or command.
    Emergency = 4,
    /// The firmware started after a crash or a watchdog reset.
    Restart = 5,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 5] = [Self::MissedTick, Self::Limit, Self::Encoder, Self::Emergency, Self::Restart];

    /// The word that `status` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::MissedTick => "missed_tick",
            Self::Limit => "limit",
            Self::Encoder => "encoder",
            Self::Emergency => "emergency",
            Self::Restart => "restart",
        }
    }

    /// The fault of this number.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| *fault as u8 == number)
    }
}

/// What a fault does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// An event and a count, nothing else.
    Report,
    /// Holds the setpoint; the drive stays enabled.
    Hold,
    /// Holds the setpoint and disables the drive.
    Disable,
}

impl Reaction {
    /// Every reaction, from the mildest.
    pub const ALL: [Self; 3] = [Self::Report, Self::Hold, Self::Disable];

    /// Its word in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Report => "report",
            Self::Hold => "hold",
            Self::Disable => "disable",
        }
    }
}

/// The reactions that can be chosen. An emergency and a restart always disable the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reactions {
    /// To [`Fault::MissedTick`].
    pub missed_tick: Reaction,
    /// To [`Fault::Limit`]. The setpoint is held even if this is [`Reaction::Report`] for as long as it would go out.
    pub limit: Reaction,
    /// To [`Fault::Encoder`].
    pub encoder: Reaction,
}

impl Default for Reactions {
    fn default() -> Self {
        Self { missed_tick: Reaction::Hold, limit: Reaction::Hold, encoder: Reaction::Disable }
    }
}

impl Reactions {
    fn to(self, fault: Fault) -> Reaction {
        match fault {
            Fault::MissedTick => self.missed_tick,
            Fault::Limit => self.limit,
            Fault::Encoder => self.encoder,
            Fault::Emergency | Fault::Restart => Reaction::Disable,
        }
    }
}

/// Holds on to the first fault until it is cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latch {
    fault: Option<Fault>,
    drive_disabled: bool,
}

impl Latch {
    /// Reacts to a fault. A further one leaves the first in place, but may still disable the drive.
    pub fn trip(&mut self, fault: Fault, reactions: Reactions) {
        let reaction = reactions.to(fault);
        if reaction == Reaction::Report {
            return;
        }
        self.drive_disabled |= reaction == Reaction::Disable;
        self.fault = self.fault.or(Some(fault));
    }

    /// Goes on.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The fault that holds the machine.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Whether the drive is disabled.
    pub fn drive_disabled(&self) -> bool {
        self.drive_disabled
    }
}
