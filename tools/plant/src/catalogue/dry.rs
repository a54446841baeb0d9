//! Stick and slip: what all dry friction laws share.

use super::law::{Instant, Step};

/// Share of what friction may change a velocity by in a step.
const REST: f64 = 1e-9;

/// Mean force over a step of friction that opposes sliding with `kinetic(direction, speed)` and holds at rest
/// up to `holding(direction)`, the direction being that of the motion it prevents, ±1.
///
/// Set-valued and implicit, without any smoothing of the sign: a body that friction can hold has exactly no
/// velocity at the step's end. A reversal inside the step is placed where the velocity, taken as a straight
/// line, crosses zero; what follows is sticking or sliding the other way, and the mean of both parts is the
/// force. The error is of second order in the step.
pub(super) fn dry_force(step: &Step, kinetic: impl Fn(f64, f64) -> f64, holding: impl Fn(f64) -> f64) -> f64 {
    if step.v_gain <= 0.0 {
        return 0.0;
    }
    let to_rest = -step.v_free / step.v_gain;
    if is_at_rest(step.v, step.v_gain, &holding) {
        let direction = step.v_free.signum();
        if to_rest.abs() <= holding(direction) {
            return to_rest;
        }
        return sliding(step, direction, 0.0, &kinetic);
    }
    let direction = step.v.signum();
    let slid = sliding(step, direction, step.v.abs(), &kinetic);
    let end = step.v_end(slid);
    if end * direction >= 0.0 {
        return slid;
    }
    // It comes to rest inside the step.
    let moving = step.v / (step.v - end);
    let drift = step.v_free - step.v;
    let onwards = drift.signum();
    if onwards == direction || drift.abs() <= step.v_gain * holding(onwards) {
        return to_rest;
    }
    let back = -onwards * kinetic(onwards, 0.0);
    moving * slid + (1.0 - moving) * back
}

/// Friction at an instant of a step in which the body slides on in the direction it began with; `None` also
/// where it began at rest, and no more than rounding gives a direction.
pub(super) fn sliding_force(
    instant: &Instant,
    kinetic: impl Fn(f64, f64) -> f64,
    holding: impl Fn(f64) -> f64,
) -> Option<f64> {
    let direction = instant.v.signum();
    let slides = instant.moves_on() && !is_at_rest(instant.v_start, instant.v_gain, &holding);
    slides.then(|| -direction * kinetic(direction, instant.v.abs()))
}

/// Whether a velocity is what rounding leaves of none after a step that friction ended.
fn is_at_rest(v: f64, v_gain: f64, holding: &impl Fn(f64) -> f64) -> bool {
    v.abs() <= REST * v_gain * holding(v.signum())
}

/// Sliding all through the step, the speed that the force depends on being the mean of both ends.
fn sliding(step: &Step, direction: f64, speed: f64, kinetic: &impl Fn(f64, f64) -> f64) -> f64 {
    let mut force = -direction * kinetic(direction, speed);
    for _ in 0..8 {
        let end = (direction * step.v_end(force)).max(0.0);
        let next = -direction * kinetic(direction, 0.5 * (speed + end));
        if (next - force).abs() <= 1e-10 * next.abs() {
            return next;
        }
        force = next;
    }
    force
}
