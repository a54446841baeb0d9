//! What was found and is not shaped for.

/// What was found and is not shaped for.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Why, with its frequency.
    pub why: String,
}
