//! Settings of the general inputs: `input1.role`, `input1.active` and so on.

use super::{Choice, Refusal, Value};
use crate::drive::{ActiveLevel, InputRole, InputRoles};

/// How many general inputs there are.
pub const INPUTS: usize = 3;

/// What the general inputs mean, and at which level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InputSettings([(InputRole, ActiveLevel); INPUTS]);

/// Which setting of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum InputKey {
    /// `role`
    Role,
    /// `active`
    Active,
}

impl InputKey {
    /// Both, in the order in which they are listed.
    pub const ALL: [Self; 2] = [Self::Role, Self::Active];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Role => "role",
            Self::Active => "active",
        }
    }

    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Role => "What the general input is wired to.",
            Self::Active => {
                "Level at which it is active; safe: a broken wire, which is low, stops the machine."
            }
        }
    }

    /// The accepted words. A word's place is its number in the flash, so the order stays.
    pub(super) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Role => &InputRole::WORDS,
            Self::Active => &ActiveLevel::WORDS,
        }
    }

    /// The number in the flash.
    pub(super) fn id(self, input: usize) -> u8 {
        34 + 2 * input as u8 + u8::from(self == Self::Active)
    }
}

impl InputSettings {
    /// Ready for the tick.
    pub fn roles(&self) -> InputRoles {
        InputRoles::new(self.0)
    }

    pub(super) fn get(&self, input: usize, key: InputKey) -> Value {
        let (role, active) = self.0.get(input).copied().unwrap_or_default();
        let place = match key {
            InputKey::Role => role as u8,
            InputKey::Active => active as u8,
        };
        Value::Word(Choice::new(key.words(), place))
    }

    pub(super) fn put_word(&mut self, input: usize, key: InputKey, word: Choice) -> Result<(), Refusal> {
        let refusal = Refusal::NotAWord { words: key.words() };
        let Some((role, active)) = self.0.get_mut(input) else { return Err(refusal) };
        let place = usize::from(word.place());
        match key {
            InputKey::Role => *role = *InputRole::ALL.get(place).ok_or(refusal)?,
            InputKey::Active => *active = *ActiveLevel::ALL.get(place).ok_or(refusal)?,
        }
        Ok(())
    }
}
