//! Springs that are made of straight pieces.

use super::law::{ForceLaw, Instant, Step};

/// A spring that only acts beyond `from`, on one side or both: force `-k (z − from)` for `z > from`, and the
/// mirror image if two-sided.
///
/// The mean force of a step is the difference of the potential energies over the way, so a contact that
/// begins or ends inside a step costs no energy and is placed where it happens.
pub(super) struct Beyond {
    pub(super) stiffness: f64,
    pub(super) from: f64,
    pub(super) two_sided: bool,
}

impl Beyond {
    fn energy(&self, z: f64) -> f64 {
        let depth = if self.two_sided { z.abs() - self.from } else { z - self.from };
        let depth = depth.max(0.0);
        0.5 * self.stiffness * depth * depth
    }

    pub(super) fn force_at(&self, z: f64) -> f64 {
        let (reach, sign) = if self.two_sided { (z.abs(), z.signum()) } else { (z, 1.0) };
        -self.stiffness * sign * (reach - self.from).max(0.0)
    }

    /// Whether no contact has begun or ended since the step did.
    pub(super) fn stays(&self, instant: &Instant) -> bool {
        let side = |z: f64| (z > self.from, self.two_sided && z < -self.from);
        side(instant.z) == side(instant.z_start)
    }

    /// Mean force on the way from one displacement to another.
    pub(super) fn between(&self, from: f64, to: f64) -> f64 {
        let way = to - from;
        // On a very short way the energies cancel; the mean of the ends is as good there.
        if way.abs() <= 1e-6 * (from.abs() + to.abs()) {
            return 0.5 * (self.force_at(from) + self.force_at(to));
        }
        (self.energy(from) - self.energy(to)) / way
    }
}

impl ForceLaw for Beyond {
    fn at(&self, instant: &Instant) -> Option<f64> {
        self.stays(instant).then(|| self.force_at(instant.z))
    }

    fn force(&self, step: &Step) -> f64 {
        step.settle(|force| self.between(step.z, step.z_end(force)))
    }
}
