//! The names under which settings are read and set, with meaning, unit and range.

use core::fmt;
use core::str::FromStr;

use super::{DriveKey, HomingKey, INPUTS, InputKey, ModeSetting, SafetyKey, Settings, SourceKey};
use crate::decimal::{self, Decimal};
use crate::motion::Profile;
use crate::shaper::{KnownTypes, MAX_MODES, Mode, ShaperType};
use crate::units::{MAX_TRAVEL_MM, TickRate};

/// The name of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Key {
    /// `tick.rate_hz`
    TickRate,
    /// `modeN.…`, N from 1; the number here counts from zero.
    Mode(usize, ModeKey),
    /// `shaper.source`
    ShaperSource,
    /// `move.velocity_mm_s`
    Velocity,
    /// `move.acceleration_mm_s2`
    Acceleration,
    /// `travel.min_mm`
    TravelMin,
    /// `travel.max_mm`
    TravelMax,
    /// `stream.decimation`
    StreamDecimation,
    /// `analog.full_scale_mm`
    AnalogFullScale,
    /// `move.profile`
    Profile,
    /// `move.jerk_mm_s3`
    Jerk,
    /// `base.moving_mass_kg`
    MovingMass,
    /// Outputs, encoder, emergency input and what faults do.
    Drive(DriveKey),
    /// Enabling and stopping.
    Safety(SafetyKey),
    /// `inputN.…`, N from 1; the number here counts from zero.
    Input(usize, InputKey),
    /// `source` and `source.…`
    Source(SourceKey),
    /// `home.…`
    Homing(HomingKey),
}

/// Which value of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModeKey {
    /// `frequency_hz`
    Frequency,
    /// `damping_ratio`
    DampingRatio,
    /// `type`
    Type,
}

/// Where the shaper that runs comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ShaperSource {
    /// From the settings of the modes.
    Designed = 0,
    /// From the table that was uploaded.
    Uploaded = 1,
}

impl ShaperSource {
    /// Both, in the order of [`Self::WORDS`].
    const ALL: [Self; 2] = [Self::Designed, Self::Uploaded];

    /// Their words on the console; the place of a word is its number in the flash.
    pub const WORDS: [&'static str; 2] = ["designed", "uploaded"];

    /// The word on the console.
    pub fn name(self) -> &'static str {
        Choice::new(&Self::WORDS, self as u8).word()
    }
}

/// The value of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Value {
    /// A number in the key's unit.
    Number(f64),
    /// A shaper type, or none.
    Shaper(Option<ShaperType>),
    /// One of the key's words.
    Word(Choice),
}

/// One word of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Choice {
    words: &'static [&'static str],
    place: u8,
}

impl Choice {
    /// The word at a place of a list; the list's end gives an empty word.
    pub(super) fn new(words: &'static [&'static str], place: u8) -> Self {
        Self { words, place }
    }

    /// The word that reads like this, in either case.
    pub(super) fn find(words: &'static [&'static str], text: &str) -> Option<Self> {
        let place = words.iter().position(|word| word.eq_ignore_ascii_case(text))?;
        Some(Self { words, place: u8::try_from(place).ok()? })
    }

    /// The word.
    pub fn word(self) -> &'static str {
        self.words.get(usize::from(self.place)).copied().unwrap_or_default()
    }

    /// The word's place in its list, from zero.
    pub fn place(self) -> u8 {
        self.place
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => Decimal(*number).fmt(f),
            Self::Shaper(Some(kind)) => write!(f, "{kind}"),
            Self::Shaper(None) => f.write_str("off"),
            Self::Word(choice) => f.write_str(choice.word()),
        }
    }
}

/// Why a value was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The text is not a finite decimal number.
    NotANumber,
    /// The number is outside the key's range.
    OutOfRange {
        /// The refused number.
        number: f64,
        /// The key, for its range and unit.
        key: Key,
    },
    /// The number must be whole.
    NotWhole {
        /// The refused number.
        number: f64,
    },
    /// Not a shaper type.
    UnknownType,
    /// Not one of the words.
    NotAWord {
        /// The words.
        words: &'static [&'static str],
    },
    /// The number is too close to zero.
    TooSmall {
        /// The refused number.
        number: f64,
        /// The least size.
        least: f64,
    },
    /// The travel would end before it starts.
    EmptyTravel {
        /// First and last position as they would be, in mm.
        travel_mm: (f64, f64),
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotANumber => f.write_str("not a number"),
            Self::OutOfRange { number, key } => {
                let (low, high) = key.range();
                write!(f, "{} is outside {}..{}", Decimal(*number), Decimal(low), Decimal(high))?;
                if key.unit().is_empty() { Ok(()) } else { write!(f, " {}", key.unit()) }
            }
            Self::NotWhole { number } => write!(f, "{} is not a whole number", Decimal(*number)),
            Self::UnknownType => write!(f, "unknown shaper type; use off, {KnownTypes}"),
            Self::NotAWord { words } => {
                f.write_str("not one of")?;
                words.iter().try_for_each(|word| write!(f, " {word}"))
            }
            Self::TooSmall { number, least } => {
                write!(
                    f,
                    "{} is too close to zero; at least {least} or at most -{least}",
                    Decimal(*number),
                    least = Decimal(*least)
                )
            }
            Self::EmptyTravel { travel_mm } => {
                write!(f, "travel {}..{} mm would be empty", Decimal(travel_mm.0), Decimal(travel_mm.1))
            }
        }
    }
}

impl Key {
    /// Every key, in the order in which they are listed.
    pub fn all() -> impl Iterator<Item = Self> {
        let modes = (0..MAX_MODES).flat_map(|index| ModeKey::ALL.map(|part| Self::Mode(index, part)));
        [Self::TickRate]
            .into_iter()
            .chain(modes)
            .chain([Self::ShaperSource])
            .chain([
                Self::Profile,
                Self::Velocity,
                Self::Acceleration,
                Self::Jerk,
                Self::MovingMass,
                Self::TravelMin,
                Self::TravelMax,
                Self::StreamDecimation,
                Self::AnalogFullScale,
            ])
            .chain(DriveKey::ALL.map(Self::Drive))
            .chain(SafetyKey::ALL.map(Self::Safety))
            .chain((0..INPUTS).flat_map(|input| InputKey::ALL.map(|key| Self::Input(input, key))))
            .chain(SourceKey::ALL.map(Self::Source))
            .chain(HomingKey::ALL.map(Self::Homing))
    }

    /// The unit, empty for a bare number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::TickRate | Self::Mode(_, ModeKey::Frequency) => "Hz",
            Self::Mode(_, ModeKey::DampingRatio | ModeKey::Type) | Self::ShaperSource | Self::Profile => "",
            Self::Velocity => "mm/s",
            Self::Acceleration => "mm/s2",
            Self::Jerk => "mm/s3",
            Self::MovingMass => "kg",
            Self::TravelMin | Self::TravelMax | Self::AnalogFullScale => "mm",
            Self::StreamDecimation => "ticks",
            Self::Drive(key) => key.unit(),
            Self::Safety(key) => key.unit(),
            Self::Source(key) => key.unit(),
            Self::Homing(key) => key.unit(),
            Self::Input(..) => "",
        }
    }

    /// One sentence for `help`.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::TickRate => "Rate of the control interrupt; applied at rest.",
            Self::Mode(_, ModeKey::Frequency) => "Undamped natural frequency of the mode.",
            Self::Mode(_, ModeKey::DampingRatio) => "Damping ratio of the mode.",
            Self::Mode(_, ModeKey::Type) => "Type of the mode's shaper.",
            Self::ShaperSource => "The shaper that runs: of the modes, or the uploaded table.",
            Self::Profile => "Shape of moves; trapezoid does not limit jerk, nor do its stops.",
            Self::Velocity => "Largest velocity of the setpoint.",
            Self::Acceleration => "Largest acceleration of the setpoint; stops brake with it.",
            Self::Jerk => "Largest jerk of the setpoint, but for trapezoid moves and stops.",
            Self::MovingMass => "Mass that a sweep given in newtons accelerates; 0 for not known.",
            Self::TravelMin => "First permitted position.",
            Self::TravelMax => "Last permitted position.",
            Self::StreamDecimation => "Ticks per streamed sample when 'stream on' gives no number.",
            Self::AnalogFullScale => "Position at the end of the analog output's range, if it is a position.",
            Self::Drive(key) => key.meaning(),
            Self::Safety(key) => key.meaning(),
            Self::Input(_, key) => key.meaning(),
            Self::Source(key) => key.meaning(),
            Self::Homing(key) => key.meaning(),
        }
    }

    /// First and last accepted number. Shaper types and words have none and get an empty range.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::TickRate => TickRate::RANGE_HZ,
            Self::Mode(_, ModeKey::Frequency) => (Mode::MIN_FREQUENCY_HZ, TickRate::RANGE_HZ.1 / 2.0),
            Self::Mode(_, ModeKey::DampingRatio) => (0.0, Mode::MAX_DAMPING_RATIO),
            Self::Mode(_, ModeKey::Type) | Self::ShaperSource | Self::Profile => (0.0, 0.0),
            Self::Velocity => (0.01, 10_000.0),
            Self::Acceleration => (0.1, 200_000.0),
            Self::Jerk => (100.0, 1.0e9),
            Self::MovingMass => (0.0, 10_000.0),
            Self::TravelMin | Self::TravelMax => (-MAX_TRAVEL_MM, MAX_TRAVEL_MM),
            Self::StreamDecimation => (1.0, 1_000_000.0),
            Self::AnalogFullScale => (1.0, 1000.0),
            Self::Drive(key) => key.range(),
            Self::Safety(key) => key.range(),
            Self::Input(..) => (0.0, 0.0),
            Self::Source(key) => key.range(),
            Self::Homing(key) => key.range(),
        }
    }
}

impl Key {
    /// The accepted words; `None` where the value is something else.
    pub fn words(self) -> Option<&'static [&'static str]> {
        match self {
            Self::Profile => Some(&Profile::NAMES),
            Self::Drive(key) => key.words(),
            Self::Safety(key) => key.words(),
            Self::Input(_, key) => Some(key.words()),
            Self::Source(key) => key.words(),
            Self::Homing(key) => key.words(),
            Self::ShaperSource => Some(&ShaperSource::WORDS),
            _ => None,
        }
    }

    /// Whether a value is of the setting's kind and within its range.
    pub(super) fn accepts(self, value: Value) -> bool {
        match value {
            Value::Number(number) => in_range(self, number).is_ok(),
            Value::Shaper(_) => matches!(self, Self::Mode(_, ModeKey::Type)),
            Value::Word(choice) => {
                self.words().is_some_and(|words| usize::from(choice.place()) < words.len())
            }
        }
    }
}

impl ModeKey {
    const ALL: [Self; 3] = [Self::Frequency, Self::DampingRatio, Self::Type];

    fn name(self) -> &'static str {
        match self {
            Self::Frequency => "frequency_hz",
            Self::DampingRatio => "damping_ratio",
            Self::Type => "type",
        }
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mode(index, part) => return write!(f, "mode{}.{}", index + 1, part.name()),
            Self::TickRate => "tick.rate_hz",
            Self::ShaperSource => "shaper.source",
            Self::Velocity => "move.velocity_mm_s",
            Self::Acceleration => "move.acceleration_mm_s2",
            Self::TravelMin => "travel.min_mm",
            Self::TravelMax => "travel.max_mm",
            Self::StreamDecimation => "stream.decimation",
            Self::AnalogFullScale => "analog.full_scale_mm",
            Self::Profile => "move.profile",
            Self::Jerk => "move.jerk_mm_s3",
            Self::MovingMass => "base.moving_mass_kg",
            Self::Drive(key) => key.name(),
            Self::Safety(key) => key.name(),
            Self::Source(key) => key.name(),
            Self::Homing(key) => key.name(),
            Self::Input(input, key) => return write!(f, "input{}.{}", input + 1, key.name()),
        })
    }
}

/// There is no setting of this name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownKey;

impl FromStr for Key {
    type Err = UnknownKey;

    fn from_str(name: &str) -> Result<Self, UnknownKey> {
        Self::all().find(|key| same_text(key, name)).ok_or(UnknownKey)
    }
}

/// Compares what a value prints with a text, without a buffer.
fn same_text(value: &impl fmt::Display, text: &str) -> bool {
    struct Rest<'t>(&'t str);
    impl fmt::Write for Rest<'_> {
        fn write_str(&mut self, part: &str) -> fmt::Result {
            self.0 = self.0.strip_prefix(part).ok_or(fmt::Error)?;
            Ok(())
        }
    }
    let mut rest = Rest(text);
    fmt::Write::write_fmt(&mut rest, format_args!("{value}")).is_ok() && rest.0.is_empty()
}

impl Settings {
    /// The value of a setting.
    pub fn get(&self, key: Key) -> Value {
        match key {
            Key::TickRate => Value::Number(self.tick_rate.hz()),
            Key::Mode(index, part) => {
                self.modes.get(index).map_or(Value::Shaper(None), |mode| mode.get(part))
            }
            Key::ShaperSource => Value::Word(Choice::new(&ShaperSource::WORDS, self.shaper_source as u8)),
            Key::Velocity => Value::Number(self.limits.velocity_mm_s),
            Key::Acceleration => Value::Number(self.limits.acceleration_mm_s2),
            Key::TravelMin => Value::Number(self.limits.travel_mm.0),
            Key::TravelMax => Value::Number(self.limits.travel_mm.1),
            Key::StreamDecimation => Value::Number(f64::from(self.stream_decimation)),
            Key::AnalogFullScale => Value::Number(self.drive.analog.full_scale_mm),
            Key::Profile => Value::Word(Choice::new(&Profile::NAMES, self.profile as u8)),
            Key::Jerk => Value::Number(self.limits.jerk_mm_s3),
            Key::MovingMass => Value::Number(self.moving_mass_kg),
            Key::Drive(key) => self.drive.get(key),
            Key::Safety(key) => self.safety.get(key),
            Key::Input(input, key) => self.inputs.get(input, key),
            Key::Source(key) => self.source.get(key),
            Key::Homing(key) => self.homing.get(key),
        }
    }

    /// Sets a value from its text. A refused text changes nothing.
    ///
    /// # Errors
    /// [`Refusal`] says what the value should have been.
    pub fn set(&mut self, key: Key, text: &str) -> Result<(), Refusal> {
        let value = match key {
            Key::Mode(_, ModeKey::Type) => Value::Shaper(parse_shaper(text)?),
            _ => match key.words() {
                Some(words) => Value::Word(Choice::find(words, text).ok_or(Refusal::NotAWord { words })?),
                None => Value::Number(decimal::parse(text).ok_or(Refusal::NotANumber)?),
            },
        };
        self.put(key, value)
    }

    /// Sets a value. A refused value changes nothing.
    ///
    /// # Errors
    /// [`Refusal`] says what the value should have been.
    pub fn put(&mut self, key: Key, value: Value) -> Result<(), Refusal> {
        match (key, value) {
            (Key::Mode(index, ModeKey::Type), Value::Shaper(shaper)) => {
                self.change_mode(index, |mode| mode.shaper = shaper);
            }
            (Key::Mode(_, ModeKey::Type), Value::Number(_)) => return Err(Refusal::UnknownType),
            (Key::ShaperSource, Value::Word(choice)) => {
                let source = ShaperSource::ALL.get(usize::from(choice.place()));
                let refusal = Refusal::NotAWord { words: &ShaperSource::WORDS };
                self.shaper_source = *source.ok_or(refusal)?;
            }
            (Key::Drive(key), Value::Word(choice)) => self.drive.put_word(key, choice)?,
            (Key::Safety(key), Value::Word(choice)) => self.safety.put_word(key, choice)?,
            (Key::Input(input, key), Value::Word(choice)) => self.inputs.put_word(input, key, choice)?,
            (Key::Source(key), Value::Word(choice)) => self.source.put_word(key, choice)?,
            (Key::Homing(key), Value::Word(choice)) => self.homing.put_word(key, choice)?,
            (Key::Profile, value) => self.profile = profile(value)?,
            (_, Value::Shaper(_) | Value::Word(_)) => return Err(Refusal::NotANumber),
            (_, Value::Number(number)) => self.put_number(key, in_range(key, number)?)?,
        }
        Ok(())
    }

    fn put_number(&mut self, key: Key, number: f64) -> Result<(), Refusal> {
        match key {
            Key::Mode(index, ModeKey::Frequency) => {
                self.change_mode(index, |mode| mode.frequency_hz = number);
            }
            Key::Mode(index, ModeKey::DampingRatio) => {
                self.change_mode(index, |mode| mode.damping_ratio = number);
            }
            Key::Mode(_, ModeKey::Type) => return Err(Refusal::UnknownType),
            Key::ShaperSource => return Err(Refusal::NotAWord { words: &ShaperSource::WORDS }),
            Key::Profile => return Err(Refusal::NotAWord { words: &Profile::NAMES }),
            Key::Jerk => self.limits.jerk_mm_s3 = number,
            Key::MovingMass => self.moving_mass_kg = number,
            Key::TickRate => {
                self.tick_rate = TickRate::from_hz(number).ok_or(Refusal::OutOfRange { number, key })?;
            }
            Key::Velocity => self.limits.velocity_mm_s = number,
            Key::Acceleration => self.limits.acceleration_mm_s2 = number,
            Key::TravelMin => self.limits.travel_mm = travel(number, self.limits.travel_mm.1)?,
            Key::TravelMax => self.limits.travel_mm = travel(self.limits.travel_mm.0, number)?,
            Key::StreamDecimation => self.stream_decimation = whole(number)?,
            Key::AnalogFullScale => self.drive.analog.full_scale_mm = number,
            Key::Drive(key) => self.drive.put_number(key, number)?,
            Key::Safety(key) => self.safety.put_number(key, number)?,
            Key::Input(_, key) => return Err(Refusal::NotAWord { words: key.words() }),
            Key::Source(key) => self.source.put_number(key, number)?,
            Key::Homing(key) => self.homing.put_number(key, number)?,
        }
        Ok(())
    }

    fn change_mode(&mut self, index: usize, change: impl FnOnce(&mut ModeSetting)) {
        if let Some(mode) = self.modes.get_mut(index) {
            change(mode);
        }
    }
}

impl ModeSetting {
    fn get(&self, part: ModeKey) -> Value {
        match part {
            ModeKey::Frequency => Value::Number(self.frequency_hz),
            ModeKey::DampingRatio => Value::Number(self.damping_ratio),
            ModeKey::Type => Value::Shaper(self.shaper),
        }
    }
}

fn in_range(key: Key, number: f64) -> Result<f64, Refusal> {
    if !number.is_finite() {
        return Err(Refusal::NotANumber);
    }
    let (low, high) = key.range();
    if (low..=high).contains(&number) { Ok(number) } else { Err(Refusal::OutOfRange { number, key }) }
}

fn whole(number: f64) -> Result<u32, Refusal> {
    if libm::trunc(number) == number { Ok(number as u32) } else { Err(Refusal::NotWhole { number }) }
}

fn parse_shaper(text: &str) -> Result<Option<ShaperType>, Refusal> {
    if text.eq_ignore_ascii_case("off") {
        return Ok(None);
    }
    text.parse().map(Some).map_err(|_| Refusal::UnknownType)
}

fn profile(value: Value) -> Result<Profile, Refusal> {
    let words = &Profile::NAMES;
    let Value::Word(choice) = value else { return Err(Refusal::NotAWord { words }) };
    Profile::ALL.get(usize::from(choice.place())).copied().ok_or(Refusal::NotAWord { words })
}

fn travel(min_mm: f64, max_mm: f64) -> Result<(f64, f64), Refusal> {
    let travel_mm = (min_mm, max_mm);
    if min_mm < max_mm { Ok(travel_mm) } else { Err(Refusal::EmptyTravel { travel_mm }) }
}
