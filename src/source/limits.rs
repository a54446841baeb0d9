//! What the setpoint may do whatever is commanded: it stays within the travel, and within velocity and
//! acceleration.
//!
//! A setpoint that cannot be where the shaped command is goes after it: towards it as fast as may be, and
//! slower again in time to meet it without going past it, and to stand at the end of the travel. Whether a
//! velocity v can still be taken back within a distance d is v² ≤ 2 a d, which needs no root and no division.
//! Where that held in the last tick it holds for a velocity that is smaller by a: so there is always a way
//! on.

use crate::units::Nanometres;

/// The limits, per tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetpointLimits {
    /// The most that the setpoint moves in a tick, in nanometres.
    velocity: i64,
    /// The most that this changes from a tick to the next.
    acceleration: i64,
    first_nm: i32,
    last_nm: i32,
}

/// Positions are whole nanometres, so the second difference of a motion that is within the limit may be so
/// much above it.
const ROUNDING_NM: i64 = 2;

impl SetpointLimits {
    /// Velocity and acceleration in nanometres per tick and tick², of which whole ones count, one at least;
    /// and the travel.
    pub fn new(velocity: f64, acceleration: f64, [first, last]: [Nanometres; 2]) -> Self {
        // A cast from a float saturates.
        let whole = |nanometres: f64| i64::from((nanometres as i32).max(1));
        Self {
            velocity: whole(velocity),
            acceleration: whole(acceleration),
            first_nm: first.0,
            last_nm: last.0,
        }
    }

    /// The most that the setpoint moves in a tick, in nanometres.
    pub fn most_per_tick_nm(&self) -> i64 {
        self.velocity + ROUNDING_NM
    }

    /// The most that this changes from a tick to the next.
    pub fn most_change_nm(&self) -> i64 {
        self.acceleration + ROUNDING_NM
    }

    /// The position of the travel that is nearest to this one.
    #[inline]
    pub fn within_travel(&self, position_nm: i32) -> i32 {
        position_nm.max(self.first_nm).min(self.last_nm)
    }

    /// The setpoint after `now` and `before`, for a target that was at `target_before` in the last tick. All
    /// in nanometres, targets within the travel.
    #[inline]
    pub fn next(&self, before: i32, now: i32, target: i32, target_before: i32) -> i32 {
        let velocity = i64::from(now) - i64::from(before);
        let wanted = i64::from(target) - i64::from(now);
        let change = wanted - velocity;
        // What it would go faster than the target in this tick has to be gone in the next.
        let lag = i64::from(target_before) - i64::from(now);
        if wanted.abs() <= self.most_per_tick_nm()
            && change.abs().max(lag.abs()) <= self.most_change_nm()
            && self.ends_within_travel(wanted, now)
        {
            return target;
        }
        self.pursue(velocity, now, wanted, i64::from(target) - i64::from(target_before))
    }

    /// On the way to a target that is `distance` away from `now` after having moved by `pace` in this tick.
    #[cold]
    #[inline(never)]
    fn pursue(&self, velocity: i64, now: i32, distance: i64, pace: i64) -> i32 {
        let towards = if distance >= 0 { 1 } else { -1 };
        let most = self.acceleration;
        for change in [most, most >> 1, 0, -(most >> 1), -most] {
            let next = (velocity + towards * change).max(-self.velocity).min(self.velocity);
            // A limit that has become narrower is met by braking.
            if (next - velocity).abs() > most || !self.ends_within_travel(next, now) {
                continue;
            }
            let closing = towards * (next - pace);
            let left = towards * (distance - next);
            if closing <= 0 || self.can_be_taken_back(closing, left) {
                return moved(now, next);
            }
        }
        // Down, which the velocity of the last tick leaves room for.
        let slower = (velocity.abs() - most).max(0);
        moved(now, slower * velocity.signum())
    }

    /// Whether a setpoint that goes on from `now` with `velocity` can still be brought to rest within the
    /// travel. Back into it is always free.
    #[inline]
    fn ends_within_travel(&self, velocity: i64, now: i32) -> bool {
        let room = if velocity > 0 {
            i64::from(self.last_nm) - i64::from(now) - velocity
        } else {
            i64::from(now) + velocity - i64::from(self.first_nm)
        };
        velocity == 0 || self.can_be_taken_back(velocity.abs(), room)
    }

    /// Whether a velocity of this size comes to rest within `room`.
    #[inline]
    fn can_be_taken_back(&self, velocity: i64, room: i64) -> bool {
        room >= 0 && (velocity <= self.acceleration || velocity * velocity <= 2 * self.acceleration * room)
    }
}

/// Positions stay within the travel, or come back to it.
#[inline]
fn moved(now: i32, by: i64) -> i32 {
    (i64::from(now) + by).max(i64::from(i32::MIN)).min(i64::from(i32::MAX)) as i32
}
