//! What a person asks for, in the words of the console.

use crate::decimal;
use core::fmt;

use super::{
    Amplitude, DecayPlan, DecaySpec, MotionContext, MotionError, MotionPlan, MovePlan, MultisinePlan,
    MultisineSpec, Phases, PulsePlan, PulseSpec, SweepKind, SweepPace, SweepPlan, SweepSpec,
};

/// A motion as it was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionSpec {
    /// To a position in mm.
    Move {
        /// Where to, in mm.
        to_mm: f64,
    },
    /// A sine of changing frequency.
    Sweep(SweepSpec),
    /// Many sines at once.
    Multisine(MultisineSpec),
    /// There and back.
    Pulse(PulseSpec),
    /// A move and hold.
    Decay(DecaySpec),
    /// The command that was uploaded.
    Play {
        /// Whether as its mirror image.
        back: bool,
    },
}

/// A motion's words were missing, too many or not understood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotAMotion {
    /// The command.
    pub command: &'static str,
    /// How it is used.
    pub usage: &'static str,
}

impl fmt::Display for NotAMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "usage: {}", self.usage)
    }
}

impl core::error::Error for NotAMotion {}

/// How each motion is asked for; the first word is its command.
pub const USAGES: [&str; 6] = [
    "move POSITION_MM",
    "sweep linear|exponential FROM_HZ TO_HZ SECONDS|RATE AMPLITUDE",
    "multisine FROM_HZ TO_HZ PERIOD_S PERIODS AMPLITUDE_MM [schroeder|SEED]",
    "pulse DISTANCE_MM [SECONDS]",
    "decay DISTANCE_MM SECONDS",
    "play [back]",
];

const COMMANDS: [&str; 6] = ["move", "sweep", "multisine", "pulse", "decay", "play"];

type Words<'l> = core::str::SplitAsciiWhitespace<'l>;

impl MotionSpec {
    /// Reads a motion from the words after its command; `None` when the command is of no motion.
    pub fn parse(command: &str, words: Words<'_>) -> Option<Result<Self, NotAMotion>> {
        let (command, usage) = COMMANDS.into_iter().zip(USAGES).find(|(name, _)| *name == command)?;
        Some(Self::read(command, words).ok_or(NotAMotion { command, usage }))
    }

    fn read(command: &str, mut words: Words<'_>) -> Option<Self> {
        let words = &mut words;
        let spec = match command {
            "move" => Self::Move { to_mm: number(words)? },
            "sweep" => Self::Sweep(SweepSpec {
                kind: match words.next()? {
                    "linear" => SweepKind::Linear,
                    "exponential" => SweepKind::Exponential,
                    _ => return None,
                },
                from_hz: number(words)?,
                to_hz: number(words)?,
                pace: pace(words.next()?)?,
                amplitude: amplitude(words.next()?)?,
            }),
            "multisine" => Self::Multisine(MultisineSpec {
                from_hz: number(words)?,
                to_hz: number(words)?,
                period_s: number(words)?,
                periods: words.next()?.parse().ok()?,
                amplitude_mm: number(words)?,
                phases: match words.next() {
                    None | Some("schroeder") => Phases::Schroeder,
                    Some(seed) => Phases::Random(seed.parse().ok()?),
                },
            }),
            "pulse" => Self::Pulse(PulseSpec {
                distance_mm: number(words)?,
                duration_s: match words.next() {
                    None => None,
                    Some(word) => Some(finite(word)?),
                },
            }),
            "play" => Self::Play {
                back: match words.next() {
                    None => false,
                    Some("back") => true,
                    Some(_) => return None,
                },
            },
            "decay" => Self::Decay(DecaySpec { distance_mm: number(words)?, hold_s: number(words)? }),
            _ => return None,
        };
        if words.next().is_none() { Some(spec) } else { None }
    }

    /// The word it begins with.
    pub fn command(&self) -> &'static str {
        match self {
            Self::Move { .. } => "move",
            Self::Sweep(_) => "sweep",
            Self::Multisine(_) => "multisine",
            Self::Pulse(_) => "pulse",
            Self::Decay(_) => "decay",
            Self::Play { .. } => "play",
        }
    }

    /// Plans it. `memory` is taken when the motion needs a table.
    ///
    /// # Errors
    /// [`MotionError`], and nothing has been taken.
    pub fn plan<'m>(
        &self,
        context: &MotionContext,
        memory: &mut Option<&'m mut [i32]>,
    ) -> Result<MotionPlan<'m>, MotionError> {
        Ok(match self {
            Self::Move { to_mm } => MotionPlan::Move(MovePlan::new(
                context.start,
                *to_mm,
                context.profile,
                &context.limits,
                context.rate,
            )?),
            Self::Sweep(spec) => MotionPlan::Sweep(SweepPlan::new(spec, context)?),
            Self::Multisine(spec) => {
                let table = memory.take().unwrap_or_default();
                MotionPlan::Multisine(MultisinePlan::new(spec, context, table).map_err(|refused| {
                    *memory = Some(refused.memory);
                    refused.error
                })?)
            }
            Self::Pulse(spec) => MotionPlan::Pulse(PulsePlan::new(spec, context)?),
            Self::Decay(spec) => MotionPlan::Decay(DecayPlan::new(spec, context)?),
            // What was uploaded is the console's.
            Self::Play { .. } => return Err(MotionError::NoPlan),
        })
    }
}

fn number(words: &mut Words<'_>) -> Option<f64> {
    finite(words.next()?)
}

fn finite(word: &str) -> Option<f64> {
    decimal::parse(word).filter(|number| number.is_finite())
}

/// `80`, `80s`, `0.1Hz/s` or `2oct/min`.
fn pace(word: &str) -> Option<SweepPace> {
    let (value, unit) = with_unit(word)?;
    match unit {
        "" | "s" => Some(SweepPace::Seconds(value)),
        "Hz/s" => Some(SweepPace::HertzPerSecond(value)),
        "oct/min" => Some(SweepPace::OctavesPerMinute(value)),
        _ => None,
    }
}

/// `1`, `1mm`, `500mm/s2` or `2N`.
fn amplitude(word: &str) -> Option<Amplitude> {
    let (value, unit) = with_unit(word)?;
    match unit {
        "" | "mm" => Some(Amplitude::Position(value)),
        "mm/s2" => Some(Amplitude::Acceleration(value)),
        "N" => Some(Amplitude::Force(value)),
        _ => None,
    }
}

/// A number and what follows it, which begins with the first letter that is not of an exponent.
fn with_unit(word: &str) -> Option<(f64, &str)> {
    let is_unit = |character: char| character.is_ascii_alphabetic() && !matches!(character, 'e' | 'E');
    let end = word.find(is_unit).unwrap_or(word.len());
    let (digits, unit) = word.split_at_checked(end)?;
    Some((finite(digits)?, unit))
}
