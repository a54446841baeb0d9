//! `plan`: a command that was designed elsewhere, and `play`, which plays it.

use core::fmt::Write;

use super::say;
use super::upload::finish_upload;
use crate::console::Console;
use crate::console::error::{Busy, CommandError};
use crate::console::long_work::LongWork;
use crate::console::upload::{UploadError, UploadKind};
use crate::decimal::Decimal;
use crate::motion::{
    MotionContext, MotionError, MotionPlan, PlanError, PlanOutline, PlanSurvey, PlayedPlan, StopSurvey,
};

impl<'m> Console<'m> {
    /// Begins to look at the plan that has come, which [`Console::work`] goes on with. Not while the one
    /// before is played.
    pub(super) fn commit_plan(&mut self) -> Result<(), CommandError<'static>> {
        self.reclaim();
        if self.plan_memory.is_none() {
            let reason = Busy::Activity(self.status.activity());
            return Err(CommandError::Busy { command: "plan", reason });
        }
        let survey = finish_upload(&mut self.upload, UploadKind::Plan, self.arriving, |tick_rate, bytes| {
            PlanSurvey::new(tick_rate, bytes).map_err(UploadError::Plan)
        })?;
        self.long_work = Some(LongWork::Survey(survey));
        Ok(())
    }

    /// Keeps the plan that has come, in place of the one before.
    pub(in crate::console) fn finish_commit(
        &mut self,
        outline: Result<PlanOutline, PlanError>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        self.upload = None;
        let refused =
            |error| CommandError::Upload { kind: UploadKind::Plan, error: UploadError::Plan(error) };
        let outline = outline.map_err(refused)?;
        let Some(memory) = self.plan_memory.as_mut() else {
            let reason = Busy::Activity(self.status.activity());
            return Err(CommandError::Busy { command: "plan", reason });
        };
        // The memory of the plan before takes what comes next.
        core::mem::swap(&mut self.arriving, memory);
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
        let refused = |error| self.motion_refused("play", error);
        let outline = self.plan.ok_or(refused(MotionError::NoPlan))?;
        if outline.tick_rate != context.rate {
            let (rate_hz, tick_hz) = (outline.tick_rate.hz(), context.rate.hz());
            return Err(refused(MotionError::PlanRate { rate_hz, tick_hz }));
        }
        if self.plan_memory.is_none() {
            return Err(refused(MotionError::NoPlan));
        }
        match outline.begin_check(backwards, &context).map_err(refused)? {
            Some(survey) => {
                self.long_work = Some(LongWork::Stops { survey, backwards });
                Ok(())
            }
            None => self.start_playing(&outline, backwards, &context, out),
        }
    }

    /// Plays the plan whose stops have been looked at, if they stay within the travel and nothing has
    /// happened in the meantime.
    pub(in crate::console) fn finish_play(
        &mut self,
        survey: &StopSurvey,
        backwards: bool,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        self.require_motion("play")?;
        let context = self.motion_context();
        let refused = |error| self.motion_refused("play", error);
        let outline = self.plan.ok_or(refused(MotionError::NoPlan))?;
        outline.check_stops(survey, backwards, &context).map_err(refused)?;
        self.start_playing(&outline, backwards, &context, out)
    }

    fn start_playing(
        &mut self,
        outline: &PlanOutline,
        backwards: bool,
        context: &MotionContext,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        // At rest nobody else has it.
        let no_plan = CommandError::Motion { command: "play", error: MotionError::NoPlan };
        let pieces = self.plan_memory.take().ok_or(no_plan)?;
        let plan = PlayedPlan::new(outline, backwards, context.start, pieces);
        self.start_plan(MotionPlan::Played(plan), "play", context, out)
    }
}
