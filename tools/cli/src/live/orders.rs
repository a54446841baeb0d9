//! What a page may ask of the board, and how the board is asked.

use serde::Deserialize;
use stillbeam_firmware::shaper::MAX_MODES;

use super::preview::{AskedMode, modes};
use crate::board::{BoardError, Session, StopLine};

/// How far the axis may be from where a page has shown it when its move is begun, in millimetres.
const SHOWN_WITHIN_MM: f64 = 0.001;

/// What a page asks for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "order", rename_all = "snake_case", deny_unknown_fields)]
pub enum Order {
    /// Let the drive run. Nothing else does.
    Enable,
    /// Brake and switch the drive off.
    Disable,
    /// Forget a fault whose cause is gone.
    Clear,
    /// Go from where the page shows the axis to a position, within limits.
    Move {
        /// Where the page has shown the command.
        from_mm: f64,
        /// The target.
        to_mm: f64,
        /// The limit of velocity.
        velocity_mm_s: f64,
        /// The limit of acceleration.
        acceleration_mm_s2: f64,
    },
    /// Swing around where the page shows the axis, exponentially from one frequency to another.
    Sweep {
        /// Where the page has shown the command.
        from_mm: f64,
        /// The frequency that it begins with.
        from_hz: f64,
        /// The frequency that it ends with.
        to_hz: f64,
        /// How long it takes.
        seconds: f64,
        /// How far it goes to either side.
        amplitude_mm: f64,
    },
    /// Shape for these modes and no others.
    Apply {
        /// One or two.
        modes: Vec<AskedMode>,
    },
    /// Pass commands through as they are.
    Bypass,
}

impl Order {
    /// Whether it moves the axis.
    pub fn is_motion(&self) -> bool {
        matches!(self, Self::Move { .. } | Self::Sweep { .. })
    }

    /// Whether it sets something in motion or lets the drive run, so that a stop that was asked for meanwhile
    /// cancels it.
    pub fn is_cancelled_by_stop(&self) -> bool {
        self.is_motion() || *self == Self::Enable
    }
}

/// Who does orders: the conversation with the board, and the stops that cancel them.
pub struct Doer<'b> {
    /// The conversation.
    pub session: &'b mut Session,
    /// The stops.
    pub stops: &'b StopLine,
    /// How many of them there were when the order was given.
    pub stops_before: u32,
    /// Whether nothing is wired to the board, so that it may be told what its inputs would have said.
    pub is_virtual: bool,
}

impl Doer<'_> {
    /// Does an order; the board's answer.
    ///
    /// # Errors
    /// Why it was not done, in words for the page.
    pub fn perform(&mut self, order: &Order) -> Result<String, String> {
        if order.is_cancelled_by_stop() {
            self.go_on()?;
        }
        match order {
            Order::Enable => self.enable(),
            Order::Disable => self.say("disable"),
            Order::Clear => self.say("clear"),
            Order::Bypass => self.say("shaper off"),
            Order::Apply { modes } => self.apply(modes),
            Order::Move { from_mm, to_mm, velocity_mm_s, acceleration_mm_s2 } => {
                self.make_move(*from_mm, *to_mm, [*velocity_mm_s, *acceleration_mm_s2])
            }
            Order::Sweep { from_mm, from_hz, to_hz, seconds, amplitude_mm } => {
                self.check_is_at(*from_mm)?;
                self.go_on()?;
                self.say(&format!("sweep exponential {from_hz} {to_hz} {seconds}s {amplitude_mm}mm"))
            }
        }
    }

    fn say(&mut self, line: &str) -> Result<String, String> {
        self.session.command(line).map(|reply| reply.ok_line).map_err(|error| words(&error))
    }

    /// Refuses where somebody has asked for a stop since the order was given.
    fn go_on(&self) -> Result<(), String> {
        if self.stops.pulls() == self.stops_before {
            return Ok(());
        }
        Err("a stop was asked for meanwhile, so this was not done; ask again".to_owned())
    }

    fn enable(&mut self) -> Result<String, String> {
        if self.is_virtual {
            self.session.say_what_a_virtual_drive_lacks().map_err(|error| words(&error))?;
            self.go_on()?;
        }
        self.say("enable")
    }

    fn apply(&mut self, asked: &[AskedMode]) -> Result<String, String> {
        let modes = modes(asked)?;
        let mut lines = vec!["set shaper.source designed".to_owned()];
        for number in 1..=MAX_MODES {
            match modes.get(number - 1) {
                Some(mode) => lines.extend([
                    format!("set mode{number}.frequency_hz {}", mode.frequency_hz()),
                    format!("set mode{number}.damping_ratio {}", mode.damping_ratio()),
                    format!("set mode{number}.type {}", mode.shaper()),
                ]),
                None => lines.push(format!("set mode{number}.type off")),
            }
        }
        let answer = self.stage_and_apply(&lines)?;
        self.say("shaper on")?;
        Ok(answer)
    }

    /// Refuses where the axis is not where a person has seen it.
    fn check_is_at(&mut self, from_mm: f64) -> Result<(), String> {
        let status = self.session.command("status").map_err(|error| words(&error))?;
        let found = status.line("command_nm").and_then(|text| text.parse::<f64>().ok());
        let is_mm = found.map_or(f64::NAN, |nm| nm / 1e6);
        // Not a number is not near.
        if (is_mm - from_mm).abs().is_nan() || (is_mm - from_mm).abs() > SHOWN_WITHIN_MM {
            return Err(format!(
                "the axis is at {is_mm} mm and not where the page showed it, {from_mm} mm; look again, then move"
            ));
        }
        Ok(())
    }

    fn make_move(&mut self, from_mm: f64, to_mm: f64, limits: [f64; 2]) -> Result<String, String> {
        self.check_is_at(from_mm)?;
        let [velocity, acceleration] = limits;
        let lines = [
            format!("set move.velocity_mm_s {velocity}"),
            format!("set move.acceleration_mm_s2 {acceleration}"),
        ];
        self.stage_and_apply(&lines)?;
        self.go_on()?;
        self.say(&format!("move {to_mm}"))
    }

    /// Stages what these lines say and nothing else, and applies it. Nothing stays staged where one of them
    /// is refused.
    fn stage_and_apply(&mut self, lines: &[String]) -> Result<String, String> {
        self.say("revert")?;
        let staged = lines.iter().try_for_each(|line| self.say(line).map(|_| ()));
        let applied = staged.and_then(|()| self.say("apply"));
        if applied.is_err() {
            self.say("revert")?;
        }
        applied
    }
}

/// A refusal in the board's words, or the error's own.
fn words(error: &BoardError) -> String {
    match error {
        BoardError::Refused { name, reason, .. } => format!("the board refuses: {name}: {reason}"),
        other => other.to_string(),
    }
}
