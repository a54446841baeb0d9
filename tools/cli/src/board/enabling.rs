//! Letting a board's drive run, and who has to agree to that.

use std::io::{BufRead, IsTerminal};
use std::time::Duration;

use super::{BoardError, BoardTarget, Session};
use crate::error::CliError;
use crate::streams::Streams;

/// How long a drive may take to come up or to stop, on the link's clock: longer than any setting of the
/// board.
const PATIENCE: Duration = Duration::from_secs(100);

/// Whether a person has agreed that a machine moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Consent {
    /// By `--yes`.
    Given,
    /// Ask for it.
    Ask,
}

impl Consent {
    /// What `--yes` says.
    pub fn from_yes(yes: bool) -> Self {
        if yes { Self::Given } else { Self::Ask }
    }
}

/// A drive that is enabled, and whether it was before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use = "whoever enabled a drive disables it"]
pub struct Enabled {
    was_enabled: bool,
}

impl Enabled {
    /// Leaves the drive as it was found.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn leave(self, session: &mut Session) -> Result<(), BoardError> {
        if self.was_enabled { Ok(()) } else { session.disable_drive() }
    }
}

impl BoardTarget {
    /// Enables the drive for `what`. Boards without hardware are told that nothing is wired and that they
    /// stand at zero. Behind a port something moves: it is said, and without consent asked for.
    ///
    /// # Errors
    /// [`CliError::Usage`] without consent; [`CliError::Board`] where the board refuses, with its remedy.
    pub fn enable(
        &self,
        session: &mut Session,
        what: &str,
        consent: Consent,
        streams: &mut Streams<'_>,
    ) -> Result<Enabled, CliError> {
        let Self::Port(port) = self else {
            session.enable_virtual_drive()?;
            return Ok(Enabled { was_enabled: true });
        };
        let was_enabled = session.drive_state()? == "enabled";
        let enabling = if was_enabled { "The drive" } else { "The drive will be enabled, and the axis" };
        streams.say(&format!(
            "{enabling} behind {port} will move: {what}. Ctrl-C ends this command, not the motion."
        ));
        if consent == Consent::Ask && !person_agrees(streams)? {
            return Err(CliError::Usage("nobody agreed, so nothing was moved".to_owned()));
        }
        session.enable_drive()?;
        Ok(Enabled { was_enabled })
    }
}

/// Asks on the terminal.
fn person_agrees(streams: &mut Streams<'_>) -> Result<bool, CliError> {
    let input = std::io::stdin();
    if !input.is_terminal() {
        return Err(CliError::Usage(
            "this moves a machine and nobody is there to agree; add --yes".to_owned(),
        ));
    }
    streams.say("Is the machine free to move? Type yes to go on:");
    let mut answer = String::new();
    if input.lock().read_line(&mut answer).is_err() {
        return Ok(false);
    }
    Ok(matches!(answer.trim(), "y" | "yes"))
}

impl Session {
    /// The drive's state: `not_ready`, `disabled`, `enabling`, `enabled`, `stopping` or `fault`.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub fn drive_state(&mut self) -> Result<String, BoardError> {
        Ok(self.command("status")?.line("drive").unwrap_or_default().to_owned())
    }

    /// Lets the drive run and waits until it does. Nothing is done where it already does.
    ///
    /// # Errors
    /// As [`Session::command`]: a refusal says what is lacking; [`BoardError::Timeout`].
    pub fn enable_drive(&mut self) -> Result<(), BoardError> {
        if self.drive_state()? == "enabled" {
            return Ok(());
        }
        self.command_when_ready("enable")?;
        self.wait_for_drive(&["enabled"])
    }

    /// Brings the setpoint to rest, switches the drive off and waits until it is.
    ///
    /// # Errors
    /// As [`Session::command`]; [`BoardError::Timeout`].
    pub fn disable_drive(&mut self) -> Result<(), BoardError> {
        self.command("disable")?;
        self.wait_for_drive(&["disabled", "not_ready", "fault"])
    }

    /// For a board with nothing wired to it: confirms the settings that run where the stored ones are
    /// damaged, waives the emergency input where nothing was said of it, says that the machine stands where
    /// the setpoint is where that is not known, and lets the drive run.
    ///
    /// # Errors
    /// As [`Session::enable_drive`].
    pub fn enable_virtual_drive(&mut self) -> Result<(), BoardError> {
        self.say_what_a_virtual_drive_lacks()?;
        self.enable_drive()
    }

    /// The same without letting the drive run.
    ///
    /// # Errors
    /// As [`Session::command`].
    pub(crate) fn say_what_a_virtual_drive_lacks(&mut self) -> Result<(), BoardError> {
        let status = self.command("status")?;
        let lacks =
            |what: &str| status.line("lacking").is_some_and(|line| line.split(' ').any(|word| word == what));
        if lacks("settings") {
            self.command("settings confirm")?;
        }
        if lacks("emergency_input") {
            self.command("set emergency.input waived")?;
            self.command_when_ready("apply")?;
        }
        if lacks("position") {
            let nm: f64 = status.line("setpoint_nm").and_then(|text| text.parse().ok()).unwrap_or(0.0);
            self.command_when_ready(&format!("position set {}", nm / 1e6))?;
        }
        Ok(())
    }

    fn wait_for_drive(&mut self, wanted: &[&str]) -> Result<(), BoardError> {
        let deadline = self.clock() + PATIENCE;
        loop {
            let state = self.drive_state()?;
            if wanted.contains(&state.as_str()) {
                return Ok(());
            }
            if self.clock() >= deadline {
                return Err(self.timeout(format!("the drive, which is {state},"), PATIENCE));
            }
            self.pause(Duration::from_millis(5));
        }
    }
}
