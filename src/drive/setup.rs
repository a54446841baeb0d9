//! What the settings make of the drive, ready for one tick rate.

use super::{InputRoles, Lacking, Times};

/// Ready for the tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveSetup {
    /// How long things take.
    pub times: Times,
    /// What the settings alone leave lacking: [`Lacking::SETTINGS`] and [`Lacking::EMERGENCY_SETTING`].
    pub lacking: Lacking,
    /// What the general inputs mean.
    pub inputs: InputRoles,
    /// Whether what the drive is told is relative to where it stands: pulses or a velocity. An analog
    /// position is not: it has to be known, and an encoder that counts from the start does not know it.
    pub relative: bool,
}
