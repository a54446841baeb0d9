//! The linear plant with springs and dampers to a motion that was recorded.

use nalgebra::DVector;

use super::{Row, StateSpace, fastest};

impl StateSpace {
    /// The plant with a spring (force per displacement) and a damper (force per velocity) from a point to a
    /// motion outside. The force by which that motion pulls, `stiffness · z + damping · v` of it, is left to
    /// whoever runs the plant.
    #[must_use]
    pub(crate) fn tied(mut self, point: usize, stiffness: f64, damping: f64) -> Self {
        let Some(place) = self.points.get(point) else { return self };
        let mut held = Row::zero(self.order());
        held.add(-stiffness, &place.displacement);
        held.add(-damping, &place.velocity);
        let force = DVector::from_column_slice(&place.force);
        self.system.a += &force * DVector::from_column_slice(&held.state).transpose();
        for (entries, share) in [(&mut self.system.value, held.value), (&mut self.system.slope, held.slope)] {
            entries.iter_mut().zip(force.iter()).for_each(|(entry, force)| *entry += share * force);
        }
        for output in &mut self.outputs {
            let felt = output.feedthrough.get(point).copied().unwrap_or(0.0);
            output.row.add(felt, &held);
        }
        self.fastest_rad_s = fastest(&self.system.a);
        self
    }
}
