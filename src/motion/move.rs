//! A move from rest to rest, exact at its end.

use super::boxes::{BoxCourse, Boxes};
use super::fine::FinePosition;
use super::quintic::{self, QuinticCourse};
use super::{MotionError, MoveLimits, Profile};
use crate::units::{Nanometres, TickRate};

/// A move in progress.
#[derive(Clone, Debug, PartialEq)]
pub struct MovePlan {
    from: Nanometres,
    to: Nanometres,
    tick: u32,
    duration_ticks: u32,
    course: Course,
}

/// What has been travelled, by profile.
#[derive(Clone, Debug, PartialEq)]
enum Course {
    Boxes(BoxCourse),
    Quintic(QuinticCourse),
}

impl MovePlan {
    /// Plans the quickest move of this profile from `from` to `to_mm` within `limits`. A move of no distance
    /// takes no tick.
    ///
    /// # Errors
    /// [`MotionError`] when the setpoint could leave the travel, or the move would take too many ticks: over
    /// 5 million for an S-curve, 16 million for the others.
    pub fn new(
        from: Nanometres,
        to_mm: f64,
        profile: Profile,
        limits: &MoveLimits,
        rate: TickRate,
    ) -> Result<Self, MotionError> {
        let to = limits.check_position(to_mm)?;
        if limits.shaper_gain > 1.0 {
            limits.check_span(from.to_mm().min(to.to_mm()), from.to_mm().max(to.to_mm()))?;
        }
        let distance_nm = to.0.abs_diff(from.0);
        let (course, duration_ticks) = Course::plan(distance_nm, profile, limits, rate)
            .map_err(|ticks| MotionError::TooLong { seconds: ticks * rate.period_s() })?;
        let duration_ticks = if from == to { 0 } else { duration_ticks };
        Ok(Self { from, to, tick: 0, duration_ticks, course })
    }

    /// How many ticks the move takes from its start to the tick that reaches the target.
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }

    /// Where the move ends.
    pub fn target(&self) -> Nanometres {
        self.to
    }

    /// The position of the next tick; `None` once the target has been reached.
    // Two motions have one; a call through memory would cost as much as the step itself.
    #[inline(always)]
    pub fn step(&mut self) -> Option<FinePosition> {
        if self.tick >= self.duration_ticks {
            return None;
        }
        self.tick += 1;
        if self.tick == self.duration_ticks {
            return Some(self.to.into());
        }
        let travelled = match &mut self.course {
            Course::Boxes(course) => course.step(self.tick),
            Course::Quintic(course) => course.step(),
        };
        let from = FinePosition::from(self.from);
        Some(if self.to > self.from { from + travelled } else { from - travelled })
    }
}

impl Course {
    /// The course and its ticks, or how many too many.
    fn plan(
        distance_nm: u32,
        profile: Profile,
        limits: &MoveLimits,
        rate: TickRate,
    ) -> Result<(Self, u32), f64> {
        let per_tick = limits.per_tick(rate);
        let distance = f64::from(distance_nm.max(1));
        let boxes = match profile {
            Profile::Trapezoid => Boxes::trapezoid(distance, per_tick)?,
            Profile::SCurve => Boxes::s_curve(distance, per_tick)?,
            Profile::MinimumJerk => {
                let ticks = quintic::shortest_ticks(distance, per_tick)?;
                return Ok((Self::Quintic(QuinticCourse::new(ticks, distance_nm)), ticks));
            }
        };
        Ok((Self::Boxes(BoxCourse::new(boxes, distance_nm)), boxes.duration_ticks()))
    }
}
