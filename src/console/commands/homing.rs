//! `home`, and where moves may go before.

use core::fmt::Write;

use super::say;
use crate::console::Console;
use crate::console::error::{CommandError, HomingLacks, Refused};
use crate::control::Request;
use crate::homing::{HomingPlan, Sense};
use crate::motion::{MotionError, MoveLimits};

/// The part of the encoder's window that says that a stop holds the machine.
const STOP_SHARE: f64 = 0.5;

impl Console<'_> {
    /// Looks for the reference.
    pub(super) fn home(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        const COMMAND: &str = "home";
        self.require_motion(COMMAND)?;
        let lacks = |lacks| CommandError::Fault { command: COMMAND, reason: Refused::Homing(lacks) };
        let limits = self.live.limits();
        let window_mm = self.live.drive().encoder_window_mm();
        let error_mm = window_mm.unwrap_or(0.0) * STOP_SHARE;
        let plan = self.live.homing().plan(&limits, error_mm, self.table.tick_rate());
        let plan = plan.ok_or(lacks(HomingLacks::Method))?;
        if let Some(lacking) = self.homing_lacks(&plan) {
            return Err(lacks(lacking));
        }
        let needed_mm_s = self.live.homing().approach_mm_s();
        if needed_mm_s > limits.velocity_mm_s {
            let error = MotionError::Velocity { needed_mm_s, limit_mm_s: limits.velocity_mm_s };
            return Err(CommandError::Motion { command: COMMAND, error });
        }
        self.request(COMMAND, Request::Home(plan))?;
        self.lag_ticks = 0;
        say(out, format_args!("ok home ('status' says when the reference is known)"));
        Ok(())
    }

    fn homing_lacks(&self, plan: &HomingPlan) -> Option<HomingLacks> {
        let inputs = self.live.inputs().roles();
        let drive = self.live.drive();
        let end = plan.end();
        match plan.sense() {
            _ if !drive.is_relative() => Some(HomingLacks::RelativeDrive),
            Sense::Limit if inputs.has_limit(end) => None,
            Sense::Limit => Some(HomingLacks::Input(if end < 0 { "limit_min" } else { "limit_max" })),
            Sense::Home if inputs.has_home() => None,
            Sense::Home => Some(HomingLacks::Input("home")),
            Sense::Stop { .. } if drive.encoder_window_mm().is_some() => None,
            Sense::Stop { .. } => Some(HomingLacks::Window),
        }
    }

    /// The reach around where the drive was enabled, in mm, where positions do not count from a reference and
    /// should.
    fn unreferenced_mm(&self) -> Option<f64> {
        self.live.homing().unreferenced_mm().filter(|_| !self.status.is_referenced())
    }

    /// The positions that a motion may have now.
    pub(super) fn permitted_mm(&self) -> (f64, f64) {
        let MoveLimits { travel_mm, .. } = self.live.limits();
        match self.unreferenced_mm() {
            None => travel_mm,
            Some(reach_mm) => {
                let anchor_mm = self.status.anchor().to_mm();
                (anchor_mm - reach_mm, anchor_mm + reach_mm)
            }
        }
    }

    /// A refusal that says why the way is so short.
    pub(super) fn motion_refused(&self, command: &'static str, error: MotionError) -> CommandError<'static> {
        let error = match error {
            MotionError::Travel { position_mm, range_mm } if self.unreferenced_mm().is_some() => {
                MotionError::Unreferenced { position_mm, range_mm }
            }
            error => error,
        };
        CommandError::Motion { command, error }
    }
}
