//! What the general inputs mean.

use crate::telemetry::Flags;

/// What an input is wired to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum InputRole {
    /// Nothing that the firmware acts on.
    #[default]
    None,
    /// The drive's ready output.
    Ready,
    /// The drive's fault output.
    Fault,
    /// The limit switch at the lower end.
    LimitMin,
    /// The limit switch at the upper end.
    LimitMax,
    /// A reference switch, for homing.
    Home,
    /// The trigger of another instrument; recorded only.
    Trigger,
    /// Something else that stops the machine in an emergency.
    Emergency,
}

impl InputRole {
    /// Every role, in the order of their numbers in the flash.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Ready,
        Self::Fault,
        Self::LimitMin,
        Self::LimitMax,
        Self::Home,
        Self::Trigger,
        Self::Emergency,
    ];

    /// Their words in settings.
    pub const WORDS: [&'static str; 8] =
        ["none", "ready", "fault", "limit_min", "limit_max", "home", "trigger", "emergency"];

    /// Whether a broken wire, which reads low, has to read as active to be on the safe side.
    fn is_active_low_when_safe(self) -> bool {
        matches!(self, Self::Fault | Self::LimitMin | Self::LimitMax | Self::Emergency)
    }
}

/// At which level an input is active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ActiveLevel {
    /// As its role has it so that a broken wire stops the machine.
    #[default]
    Safe,
    /// High.
    High,
    /// Low.
    Low,
}

impl ActiveLevel {
    /// Every choice, in the order of their numbers in the flash.
    pub const ALL: [Self; 3] = [Self::Safe, Self::High, Self::Low];

    /// Their words in settings.
    pub const WORDS: [&'static str; 3] = ["safe", "high", "low"];
}

/// The general inputs, each a bit as in [`Flags::INPUTS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputRoles {
    /// Their levels while all is well.
    usual: u8,
    /// Those that are looked at.
    watched: u8,
    drive: u8,
    limit_min: u8,
    limit_max: u8,
    emergency: u8,
    home: u8,
    /// Of those the ones that are active low.
    home_low: u8,
}

impl InputRoles {
    /// The roles and active levels of the inputs in their order.
    pub fn new(inputs: [(InputRole, ActiveLevel); 3]) -> Self {
        let mut roles = Self::default();
        for ((role, level), Flags(bit)) in inputs.into_iter().zip(Flags::INPUTS) {
            let active_low = match level {
                ActiveLevel::Safe => role.is_active_low_when_safe(),
                ActiveLevel::High => false,
                ActiveLevel::Low => true,
            };
            // A drive that is not ready is what is unusual.
            let usual_high = active_low != (role == InputRole::Ready);
            let kind = match role {
                InputRole::None | InputRole::Trigger => continue,
                InputRole::Home => {
                    roles.home |= bit;
                    roles.home_low |= if active_low { bit } else { 0 };
                    continue;
                }
                InputRole::Ready | InputRole::Fault => &mut roles.drive,
                InputRole::LimitMin => &mut roles.limit_min,
                InputRole::LimitMax => &mut roles.limit_max,
                InputRole::Emergency => &mut roles.emergency,
            };
            *kind |= bit;
            roles.watched |= bit;
            roles.usual |= if usual_high { bit } else { 0 };
        }
        roles
    }

    /// The inputs that are not as they are while all is well.
    #[inline]
    pub fn unusual(&self, contacts: Flags) -> Unusual {
        Unusual((contacts.0 ^ self.usual) & self.watched)
    }

    /// Whether the drive is not ready, or reports a fault.
    pub fn drive_fails(&self, unusual: Unusual) -> bool {
        unusual.0 & self.drive != 0
    }

    /// Whether an input says that this is an emergency.
    pub fn is_emergency(&self, unusual: Unusual) -> bool {
        unusual.0 & self.emergency != 0
    }

    /// Whether a home switch is active.
    pub fn is_home(&self, contacts: Flags) -> bool {
        (contacts.0 ^ self.home_low) & self.home != 0
    }

    /// Whether there is a home switch.
    pub fn has_home(&self) -> bool {
        self.home != 0
    }

    /// Whether there is a limit switch at this end: -1 the lower, 1 the upper one.
    pub fn has_limit(&self, end: i32) -> bool {
        (if end < 0 { self.limit_min } else { self.limit_max }) != 0
    }

    /// The ends at which the machine is: -1 the lower, 1 the upper one.
    pub fn limits(&self, unusual: Unusual) -> impl Iterator<Item = i32> {
        [(self.limit_min, -1), (self.limit_max, 1)]
            .into_iter()
            .filter_map(move |(limit, end)| (unusual.0 & limit != 0).then_some(end))
    }
}

/// A set of inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Unusual(u8);

impl Unusual {
    /// Whether there is one.
    #[inline]
    pub fn any(self) -> bool {
        self.0 != 0
    }

    /// A bit for each, as in [`Flags::INPUTS`].
    #[inline]
    pub fn bits(self) -> u8 {
        self.0
    }

    /// Those that were not in `before`.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self(self.0 & !before.0)
    }
}
