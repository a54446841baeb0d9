//! The drive's states and what makes it go from one to the next.

/// What a person is told of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum State {
    /// Off, and something that enabling needs is lacking ([`super::Lacking`]).
    #[default]
    NotReady = 0,
    /// Off, and `enable` would do.
    Disabled = 1,
    /// Told to run, and not yet free to move: the drive takes hold of the axis, then the brake opens.
    Enabling = 2,
    /// Motions may start.
    Enabled = 3,
    /// The setpoint comes to rest, or the brake closes.
    Stopping = 4,
    /// A fault is to be cleared first. The drive is off, or holds after a stop of category 2.
    Fault = 5,
}

impl State {
    /// Every state.
    pub const ALL: [Self; 6] =
        [Self::NotReady, Self::Disabled, Self::Enabling, Self::Enabled, Self::Stopping, Self::Fault];

    /// The word that `status` prints.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotReady => "not_ready",
            Self::Disabled => "disabled",
            Self::Enabling => "enabling",
            Self::Enabled => "enabled",
            Self::Stopping => "stopping",
            Self::Fault => "fault",
        }
    }

    /// The state of this number, if there is one.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|state| *state as u8 == number)
    }
}

/// How a stop ends, by IEC 60204-1. The setpoint of the last two is braked within the limit of acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stop {
    /// Category 0: the drive is off at once, and the machine coasts.
    Coast,
    /// Category 1: to rest, the brake closed, then off.
    Controlled,
    /// Category 2: to rest, and the drive goes on holding.
    Hold,
}

/// What happens to the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// Whether all that enabling needs is there. Counts while the drive is off; what is lost later is a
    /// fault.
    Permit(bool),
    /// A person or host says so.
    Enable,
    /// A person or host says so.
    Disable,
    /// A fault, to be stopped for like this.
    Fault(Stop),
    /// The setpoint stands still.
    AtRest,
    /// A tick has passed.
    Tick,
    /// A person or host has seen the fault, and its cause is gone.
    Clear,
}

/// How long things take, in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// From the enable signal until the drive holds the axis.
    pub hold: u32,
    /// Until an opened brake no longer drags.
    pub release: u32,
    /// Until a closed brake holds.
    pub engage: u32,
    /// The longest that a setpoint may take to come to rest before the drive is switched off all the same.
    pub ramp: u32,
}

/// What the state puts out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The drive may run.
    pub enable: bool,
    /// The brake is open.
    pub brake_open: bool,
}

/// Where in its state the drive is. `left` are ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    #[default]
    Off,
    /// The outputs have the actual position for a tick before the drive may follow them.
    Adopting,
    TakingHold {
        left: u32,
    },
    Releasing {
        left: u32,
    },
    On,
    Ramping {
        left: u32,
        then_hold: bool,
    },
    Engaging {
        left: u32,
    },
    /// After a stop of category 2.
    Holding,
}

/// The drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    phase: Phase,
    fault: bool,
    permit: bool,
}

impl Drive {
    /// Its state.
    pub fn state(self) -> State {
        match self.phase {
            Phase::Off if self.fault => State::Fault,
            Phase::Off if self.permit => State::Disabled,
            Phase::Off => State::NotReady,
            Phase::Adopting | Phase::TakingHold { .. } | Phase::Releasing { .. } => State::Enabling,
            Phase::On => State::Enabled,
            Phase::Ramping { .. } | Phase::Engaging { .. } => State::Stopping,
            Phase::Holding => State::Fault,
        }
    }

    /// What it puts out.
    pub fn outputs(self) -> Outputs {
        Outputs {
            enable: !matches!(self.phase, Phase::Off | Phase::Adopting),
            brake_open: matches!(
                self.phase,
                Phase::Releasing { .. } | Phase::On | Phase::Ramping { .. } | Phase::Holding
            ),
        }
    }

    /// Whether motions may start and go on.
    #[inline]
    pub fn may_move(self) -> bool {
        matches!(self.phase, Phase::On)
    }

    /// Whether a stop is under way, which is not over before the drive is off or holds.
    pub fn is_stopping(self) -> bool {
        matches!(self.phase, Phase::Ramping { .. } | Phase::Engaging { .. })
    }

    /// Whether the setpoint is to be braked.
    pub fn is_ramping(self) -> bool {
        matches!(self.phase, Phase::Ramping { .. })
    }

    /// Whether the drive is off and does not follow anything.
    pub fn is_off(self) -> bool {
        matches!(self.phase, Phase::Off | Phase::Adopting)
    }

    /// The drive after an event.
    #[must_use]
    pub fn after(self, event: Event, times: &Times) -> Self {
        let phase = match event {
            Event::Permit(permit) => return Self { permit, ..self },
            Event::Enable => self.told_to_enable(),
            Event::Disable => self.phase.told_to_stop(times),
            Event::Fault(stop) => {
                return Self { phase: self.phase.faulted(stop, times), fault: true, ..self };
            }
            Event::AtRest => self.phase.at_rest(times),
            Event::Tick => self.phase.tick(times),
            Event::Clear => return self.cleared(),
        };
        Self { phase, ..self }
    }

    fn told_to_enable(self) -> Phase {
        match self.phase {
            Phase::Off if self.permit && !self.fault => Phase::Adopting,
            phase => phase,
        }
    }

    fn cleared(self) -> Self {
        match self.phase {
            Phase::Off => Self { fault: false, ..self },
            Phase::Holding => Self { phase: Phase::On, fault: false, ..self },
            _ => self,
        }
    }
}

impl Phase {
    /// A stop of category 1.
    fn told_to_stop(self, times: &Times) -> Self {
        match self {
            // The brake is still closed.
            Self::Adopting | Self::TakingHold { .. } => Self::Off,
            Self::Releasing { .. } | Self::Holding => Self::engaging(times),
            Self::On => Self::Ramping { left: times.ramp, then_hold: false },
            Self::Ramping { left, .. } => Self::Ramping { left, then_hold: false },
            Self::Off | Self::Engaging { .. } => self,
        }
    }

    fn faulted(self, stop: Stop, times: &Times) -> Self {
        match (stop, self) {
            (Stop::Coast, _) => Self::Off,
            (Stop::Hold, Self::On) => Self::Ramping { left: times.ramp, then_hold: true },
            // Whatever else is under way already ends at least as safely.
            (Stop::Hold, Self::Ramping { .. } | Self::Holding) => self,
            (Stop::Hold | Stop::Controlled, _) => self.told_to_stop(times),
        }
    }

    fn at_rest(self, times: &Times) -> Self {
        match self {
            Self::Ramping { then_hold: true, .. } => Self::Holding,
            Self::Ramping { then_hold: false, .. } => Self::engaging(times),
            phase => phase,
        }
    }

    fn tick(self, times: &Times) -> Self {
        match self {
            Self::Adopting if times.hold > 0 => Self::TakingHold { left: times.hold },
            Self::Adopting => Self::releasing(times),
            Self::TakingHold { left: ..=1 } => Self::releasing(times),
            Self::TakingHold { left } => Self::TakingHold { left: left - 1 },
            Self::Releasing { left: ..=1 } => Self::On,
            Self::Releasing { left } => Self::Releasing { left: left - 1 },
            // The time is up: better to coast than to be driven on.
            Self::Ramping { left: ..=1, .. } | Self::Engaging { left: ..=1 } => Self::Off,
            Self::Ramping { left, then_hold } => Self::Ramping { left: left - 1, then_hold },
            Self::Engaging { left } => Self::Engaging { left: left - 1 },
            Self::Off | Self::On | Self::Holding => self,
        }
    }

    fn releasing(times: &Times) -> Self {
        if times.release > 0 { Self::Releasing { left: times.release } } else { Self::On }
    }

    fn engaging(times: &Times) -> Self {
        if times.engage > 0 { Self::Engaging { left: times.engage } } else { Self::Off }
    }
}
