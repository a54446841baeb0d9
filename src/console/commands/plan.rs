//! `plan`: a command that was designed elsewhere, and `play`, which plays it.

use core::fmt::Write;

use super::say;
use super::upload::finish_upload;
use crate::console::Console;
use crate::console::error::{Busy, CommandError};
use crate::console::upload::{UploadError, UploadKind};
use crate::decimal::Decimal;
use crate::motion::{MotionError, MotionPlan, PlanOutline, PlayedPlan};

impl Console<'_> {
    /// Keeps the plan that has come, in place of the one before. Not while that one is played.
    pub(super) fn commit_plan(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.reclaim();
        let Some(memory) = self.plan_memory.as_mut() else {
            let reason = Busy::Activity(self.status.activity());
            return Err(CommandError::Busy { command: "plan", reason });
        };
        let outline =
            finish_upload(&mut self.upload, UploadKind::Plan, self.arriving, |tick_rate, bytes| {
                PlanOutline::of(tick_rate, bytes).map_err(UploadError::Plan)
            })?;
        // The memory of the plan before takes what comes next.
        core::mem::swap(&mut self.arriving, memory);
        self.upload = None;
        self.plan = Some(outline);
        let PlanOutline { crc32, pieces, ticks, distance, .. } = outline;
        say(
            out,
            format_args!(
                "ok plan committed crc32=0x{crc32:08x} pieces={pieces} ticks={ticks} distance_nm={}",
                distance.0
            ),
        );
        Ok(())
    }

    pub(super) fn show_plan(&self, out: &mut dyn Write) {
        self.show_upload(UploadKind::Plan, out);
        match &self.plan {
            None => say(out, format_args!("plan none")),
            Some(plan) => {
                let [velocity, acceleration, jerk] = plan.largest_mm();
                say(out, format_args!("plan 0x{:08x}", plan.crc32));
                say(out, format_args!("plan_rate_hz {}", Decimal(plan.tick_rate.hz())));
                say(out, format_args!("plan_pieces {}", plan.pieces));
                say(
                    out,
                    format_args!("plan_duration_ms {:.3}", Decimal(plan.tick_rate.seconds(plan.ticks) * 1e3)),
                );
                say(out, format_args!("plan_distance_nm {}", plan.distance.0));
                say(out, format_args!("plan_span_nm {} {}", plan.span.0.0, plan.span.1.0));
                say(out, format_args!("plan_velocity_mm_s {:.3}", Decimal(velocity)));
                say(out, format_args!("plan_acceleration_mm_s2 {:.1}", Decimal(acceleration)));
                say(out, format_args!("plan_jerk_mm_s3 {:.0}", Decimal(jerk)));
            }
        }
        say(out, format_args!("ok plan show"));
    }

    /// Plays the uploaded plan, or its mirror image, from where the command is.
    pub(super) fn play(&mut self, backwards: bool, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.reclaim();
        let context = self.motion_context();
        let refused = |error| CommandError::Motion { command: "play", error };
        let outline = self.plan.ok_or(refused(MotionError::NoPlan))?;
        if outline.tick_rate != context.rate {
            let (rate_hz, tick_hz) = (outline.tick_rate.hz(), context.rate.hz());
            return Err(refused(MotionError::PlanRate { rate_hz, tick_hz }));
        }
        // At rest nobody else has it.
        let pieces = self.plan_memory.take().ok_or(refused(MotionError::NoPlan))?;
        if let Err(error) = outline.check(pieces, backwards, &context) {
            self.plan_memory = Some(pieces);
            return Err(refused(error));
        }
        let plan = PlayedPlan::new(&outline, backwards, context.start, pieces);
        self.start_plan(MotionPlan::Played(plan), "play", &context, out)
    }
}
