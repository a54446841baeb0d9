//! `move`, `sweep`, `multisine`, `pulse`, `decay`, `stop`; `play` is in `plan`.

use core::fmt::Write;

use super::say;
use crate::console::Console;
use crate::console::error::{Busy, CommandError};
use crate::console::long_work::LongWork;
use crate::control::Request;
use crate::decimal::Decimal;
use crate::motion::multisine::MultisineRefused;
use crate::motion::{
    MotionContext, MotionError, MotionPlan, MotionSpec, MoveLimits, MultisineDrawing, MultisineSpec,
};
use crate::units::Nanometres;

impl<'m> Console<'m> {
    /// Plans a motion within all limits and hands it to the interrupt, or refuses and changes nothing. A
    /// multisine's table is drawn first, which [`Console::work`] does.
    pub(super) fn start(
        &mut self,
        spec: &MotionSpec,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        let command = spec.command();
        self.require_motion(command)?;
        let context = self.motion_context();
        if let MotionSpec::Multisine(spec) = spec {
            return self.start_drawing(spec, &context);
        }
        if let MotionSpec::Play { back } = spec {
            return self.play(*back, out);
        }
        let plan = spec.plan(&context, &mut None).map_err(|error| self.motion_refused(command, error))?;
        self.start_plan(plan, command, &context, out)
    }

    pub(super) fn start_plan(
        &mut self,
        plan: MotionPlan<'m>,
        command: &'static str,
        context: &MotionContext,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        let announced = Announced::of(&plan, self.table.duration_ticks());
        self.request(command, Request::Start(plan))?;
        // The interrupt ends it now.
        self.lag_ticks = 0;
        announced.say(command, context, out);
        Ok(())
    }

    pub(super) fn motion_context(&self) -> MotionContext {
        MotionContext {
            start: self.status.command(),
            limits: MoveLimits {
                shaper_gain: self.table.absolute_gain(),
                travel_mm: self.permitted_mm(),
                ..self.live.limits()
            },
            profile: self.live.profile(),
            moving_mass_kg: self.live.moving_mass_kg(),
            rate: self.table.tick_rate(),
        }
    }

    /// Begins to draw a table into the history that no shaper uses now.
    fn start_drawing(
        &mut self,
        spec: &MultisineSpec,
        context: &MotionContext,
    ) -> Result<(), CommandError<'static>> {
        self.reclaim();
        let memory = self.spare_history.take();
        let Some(memory) = memory else {
            return Err(CommandError::Busy { command: "multisine", reason: Busy::Handover });
        };
        match MultisineDrawing::new(spec, context, memory) {
            Ok(drawing) => self.long_work = Some(LongWork::Drawing(drawing)),
            Err(refused) => return Err(self.refused(refused)),
        }
        Ok(())
    }

    /// Starts the multisine that has been drawn, if nothing has happened in the meantime.
    pub(in crate::console) fn finish_drawing(
        &mut self,
        drawing: MultisineDrawing<'m>,
        out: &mut dyn Write,
    ) -> Result<(), CommandError<'static>> {
        if let Err(error) = self.require_motion("multisine") {
            self.spare_history = Some(drawing.into_memory());
            return Err(error);
        }
        let context = self.motion_context();
        match drawing.finish() {
            Ok(plan) => self.start_plan(MotionPlan::Multisine(plan), "multisine", &context, out),
            Err(refused) => Err(self.refused(refused)),
        }
    }

    fn refused(&mut self, refused: MultisineRefused<'m>) -> CommandError<'static> {
        self.spare_history = Some(refused.memory);
        let (command, error) = ("multisine", refused.error);
        match error {
            MotionError::Memory { .. } => CommandError::MotionMemory { command, error },
            _ => self.motion_refused(command, error),
        }
    }

    pub(super) fn stop(&mut self, out: &mut dyn Write) -> Result<(), CommandError<'static>> {
        self.request("stop", Request::Stop)?;
        say(out, format_args!("ok stop"));
        Ok(())
    }
}

/// What the reply says of a plan that the interrupt has already taken.
struct Announced {
    ticks: u32,
    settled_ticks: u32,
    detail: Detail,
}

enum Detail {
    None,
    Move { to: Nanometres },
    Multisine { lines: u32, period_ticks: u32, taper_ticks: u32, crest: f32 },
    Decay { move_ticks: u32 },
}

impl Announced {
    fn of(plan: &MotionPlan<'_>, shaper_ticks: u32) -> Self {
        let ticks = plan.duration_ticks();
        let detail = match plan {
            MotionPlan::Multisine(plan) => Detail::Multisine {
                lines: plan.lines(),
                period_ticks: plan.period_ticks(),
                taper_ticks: plan.taper_ticks(),
                crest: plan.crest(),
            },
            MotionPlan::Decay(plan) => Detail::Decay { move_ticks: plan.move_ticks() },
            MotionPlan::Move(plan) => Detail::Move { to: plan.target() },
            MotionPlan::Played(plan) => Detail::Move { to: plan.target() },
            MotionPlan::Sweep(_) | MotionPlan::Pulse(_) => Detail::None,
        };
        Self { ticks, settled_ticks: ticks + shaper_ticks, detail }
    }

    fn say(&self, command: &str, context: &MotionContext, out: &mut dyn Write) {
        let Self { ticks, settled_ticks, ref detail } = *self;
        let _best_effort = write!(out, "ok {command} ");
        let _best_effort = match detail {
            Detail::None => Ok(()),
            Detail::Move { to } => {
                write!(out, "from_mm={} to_mm={} ", Decimal(context.start.to_mm()), Decimal(to.to_mm()))
            }
            Detail::Multisine { lines, period_ticks, taper_ticks, crest } => write!(
                out,
                "lines={lines} crest={:.2} period_ticks={period_ticks} taper_ticks={taper_ticks} ",
                Decimal(f64::from(*crest))
            ),
            Detail::Decay { move_ticks } => {
                let record_s = context.rate.seconds(ticks);
                write!(out, "move_ticks={move_ticks} record_s={:.3} ", Decimal(record_s))
            }
        };
        say(out, format_args!("ticks={ticks} settled_ticks={settled_ticks}"));
    }
}
