//! Steps as long as the forces along them are smooth.
//!
//! Over a step of length h a force is the parabola through its values f₀, fₘ, f₁ at the start, in the middle
//! and at the end. Of that the mean (f₀ + 4fₘ + f₁)/6 and the rise f₁ − f₀ move the plant; what is left has
//! neither mean nor rise and moves it by a term in h⁵. Displacement and velocity in the middle are those of
//! the cubic through both ends. What comes out is of fourth order in h. The motion and the forces that it
//! makes are found together, by iteration from how the forces were before.

use super::engine::Element;
use super::steps::Gains;
use crate::catalogue::{Instant, Step};

/// Iterations at most; a smooth step takes three or four.
const MOST_ITERATIONS: usize = 10;

/// How far the force in the middle of a step may be from the mean of its ends, in shares of the largest
/// force: a parabola through the three is then right to 1e-4 of that force.
const BEND: f64 = 0.05;

/// The same where steps are halved so often beside: half a step bends by a quarter.
pub(super) fn most_bend(halvings: u32) -> f64 {
    BEND * (-2.0 * f64::from(halvings)).exp2()
}

/// Forces that change by less than this share of the largest have settled.
const SETTLED: f64 = 1e-7;

/// A force over a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Course {
    pub(super) start: f64,
    pub(super) mean: f64,
    /// From start to end.
    pub(super) rise: f64,
    /// The largest that there has been.
    largest: f64,
}

impl Course {
    pub(super) fn end(&self) -> f64 {
        self.start + self.rise
    }

    /// A quarter of the way, on the parabola: (3f₀ + 6fₘ − f₁)/8.
    fn at_a_quarter(&self) -> f64 {
        (9.0 * self.mean - self.start - 2.5 * self.rise) / 8.0
    }

    /// As after a short step with this mean force.
    pub(super) fn stepped(&mut self, force: f64) {
        *self = Self { start: force, mean: force, rise: 0.0, largest: self.largest.max(force.abs()) };
    }
}

impl Gains {
    /// Displacement and velocity at the end of a step at one port.
    #[inline]
    pub(super) fn end(&self, port: usize, seen: &Step, courses: &[Course]) -> (f64, f64) {
        let (mut z, mut v) = (seen.z_free, seen.v_free);
        for (index, course) in courses.iter().enumerate() {
            z += self.z[port][index] * course.mean + self.z_rise[port][index] * course.rise;
            v += self.v[port][index] * course.mean + self.v_rise[port][index] * course.rise;
        }
        (z, v)
    }
}

/// Where a law's place is at the start of a step, and what the drive exerts at both ends.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Begun {
    /// The motion without any force.
    pub(super) seen: Step,
    pub(super) efforts: [f64; 2],
}

impl Begun {
    fn instant(&self, share: f64, z: f64, v: f64) -> Instant {
        let [from, to] = self.efforts;
        let effort = from + share * (to - from);
        let time_s = self.seen.time_s + share * self.seen.step_s;
        let Step { z: z_start, v: v_start, v_gain, .. } = self.seen;
        Instant { time_s, z, v, effort, z_start, v_start, v_gain }
    }

    /// A quarter of the way along a step that ends like this.
    fn quarter(&self, z: f64, v: f64) -> Instant {
        let (seen, h) = (&self.seen, self.seen.step_s);
        let there = (27.0 * seen.z + 5.0 * z) / 32.0 + h * (9.0 * seen.v - 3.0 * v) / 64.0;
        let speed = 1.125 * (z - seen.z) / h + (3.0 * seen.v - 5.0 * v) / 16.0;
        self.instant(0.25, there, speed)
    }

    /// Middle and end of a step that ends like this.
    fn instants(&self, z: f64, v: f64) -> [Instant; 2] {
        let (seen, h) = (&self.seen, self.seen.step_s);
        let middle = 0.5 * (seen.z + z) + 0.125 * h * (seen.v - v);
        let speed = 1.5 * (z - seen.z) / h - 0.25 * (seen.v + v);
        [self.instant(0.5, middle, speed), self.instant(1.0, z, v)]
    }
}

/// Finds the forces of all laws over a step, which `courses` held of the step before; whether they are smooth
/// enough for a step of this length, bending no more than `most_bend` (see [`most_bend`]).
pub(super) fn smooth_forces(
    elements: &[Element],
    begun: &[Begun],
    gains: &Gains,
    courses: &mut [Course],
    most_bend: f64,
) -> bool {
    for ((element, begun), course) in elements.iter().zip(begun).zip(courses.iter_mut()) {
        let Some(start) = element.law.at(&begun.instant(0.0, begun.seen.z, begun.seen.v)) else {
            return false;
        };
        course.start = start;
        course.mean = start + 0.5 * course.rise;
    }
    for _ in 0..MOST_ITERATIONS {
        let mut is_settled = true;
        for (index, (element, begun)) in elements.iter().zip(begun).enumerate() {
            let (z, v) = gains.end(index, &begun.seen, courses);
            let [middle, end] = begun.instants(z, v);
            let (Some(middle), Some(end)) = (element.law.at(&middle), element.law.at(&end)) else {
                return false;
            };
            let course = &mut courses[index];
            let start = course.start;
            let (mean, rise) = ((start + 4.0 * middle + end) / 6.0, end - start);
            let largest = course.largest.max(start.abs()).max(middle.abs()).max(end.abs());
            let is_bent = (middle - 0.5 * (start + end)).abs() > most_bend * largest;
            if is_bent || !largest.is_finite() {
                return false;
            }
            is_settled &= (mean - course.mean).abs() <= SETTLED * largest;
            *course = Course { start, mean, rise, largest };
        }
        if is_settled {
            return are_parabolas(elements, begun, gains, courses, most_bend);
        }
    }
    false
}

/// Whether forces that have settled are where their parabolas say a quarter of the way along. A force that
/// runs like an odd function about the middle does not bend there, and still is no straight line.
fn are_parabolas(
    elements: &[Element],
    begun: &[Begun],
    gains: &Gains,
    courses: &[Course],
    most_bend: f64,
) -> bool {
    let most_off = most_bend.powf(1.5);
    elements.iter().zip(begun).zip(courses).enumerate().all(|(index, ((element, begun), course))| {
        let (z, v) = gains.end(index, &begun.seen, courses);
        let Some(force) = element.law.at(&begun.quarter(z, v)) else { return false };
        (force - course.at_a_quarter()).abs() <= most_off * course.largest
    })
}
