//! Faults that stop the machine until they are cleared.

use crate::drive::Stop;

/// Why the machine is stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Fault {
    /// A tick was missed while the setpoint moved.
    MissedTick = 1,
    /// The setpoint would have left the travel.
    Limit = 2,
    /// The encoder is off the setpoint by more than the window.
    Encoder = 3,
    /// The emergency input or command.
    Emergency = 4,
    /// The firmware started after a crash or a watchdog reset.
    Restart = 5,
    /// A limit input, and the setpoint was on its way there.
    LimitInput = 6,
    /// The drive says that it is not ready, or reports a fault.
    Drive = 7,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 7] = [
        Self::MissedTick,
        Self::Limit,
        Self::Encoder,
        Self::Emergency,
        Self::Restart,
        Self::LimitInput,
        Self::Drive,
    ];

    /// The word that `status` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::MissedTick => "missed_tick",
            Self::Limit => "limit",
            Self::Encoder => "encoder",
            Self::Emergency => "emergency",
            Self::Restart => "restart",
            Self::LimitInput => "limit_input",
            Self::Drive => "drive",
        }
    }

    /// The fault of this number.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| *fault as u8 == number)
    }
}

/// What a fault does. The order is that of the numbers in the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reaction {
    /// An event and a count, nothing else.
    Report,
    /// [`Stop::Hold`]: to rest, and the drive goes on holding.
    Category2,
    /// [`Stop::Coast`]: the drive is off at once.
    Category0,
    /// [`Stop::Controlled`]: to rest, then off.
    Category1,
}

impl Reaction {
    /// Every reaction, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Report, Self::Category2, Self::Category0, Self::Category1];

    /// Its word in settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Report => "report",
            Self::Category2 => "category_2",
            Self::Category0 => "category_0",
            Self::Category1 => "category_1",
        }
    }

    fn stop(self) -> Option<Stop> {
        match self {
            Self::Report => None,
            Self::Category2 => Some(Stop::Hold),
            Self::Category0 => Some(Stop::Coast),
            Self::Category1 => Some(Stop::Controlled),
        }
    }
}

/// The reactions that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Reactions {
    /// To [`Fault::MissedTick`].
    pub missed_tick: Reaction,
    /// To [`Fault::Limit`] and [`Fault::LimitInput`]. [`Reaction::Report`] is one of category 2 here: a
    /// setpoint beyond the travel is never put out, and one that moves is never frozen.
    pub limit: Reaction,
    /// To [`Fault::Encoder`].
    pub encoder: Reaction,
    /// To [`Fault::Emergency`] and [`Fault::Drive`]; never less than category 1.
    pub emergency: Reaction,
}

impl Default for Reactions {
    fn default() -> Self {
        let stop = Reaction::Category1;
        Self { missed_tick: stop, limit: stop, encoder: stop, emergency: stop }
    }
}

impl Reactions {
    /// How a fault is stopped for; `None` where it is only reported.
    pub fn to(self, fault: Fault) -> Option<Stop> {
        match fault {
            Fault::MissedTick => self.missed_tick.stop(),
            Fault::Limit | Fault::LimitInput => self.limit.stop().or(Some(Stop::Hold)),
            Fault::Encoder => self.encoder.stop(),
            Fault::Emergency | Fault::Drive => match self.emergency {
                Reaction::Category0 => Some(Stop::Coast),
                _ => Some(Stop::Controlled),
            },
            Fault::Restart => Some(Stop::Coast),
        }
    }
}

/// Holds on to the first fault until it is cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latch {
    fault: Option<Fault>,
}

impl Latch {
    /// Takes a fault in. A further one leaves the first in place. Returns how to stop for it; `None` where it
    /// is only reported.
    pub fn trip(&mut self, fault: Fault, reactions: Reactions) -> Option<Stop> {
        let stop = reactions.to(fault)?;
        self.fault = self.fault.or(Some(fault));
        Some(stop)
    }

    /// Goes on.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The fault that holds the machine.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }
}
