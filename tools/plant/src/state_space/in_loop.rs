//! The linear plant with its controller around it: what forces that it does not know of do to a machine that
//! holds against them.

use nalgebra::DVector;

use super::{Row, StateSpace, fastest};
use crate::linear::dot;
use crate::model::Controller;

impl StateSpace {
    /// The plant in a loop whose reference stands still: `u = −kv (kp y + y')` of the first output `y`, put
    /// into every row that reads the input. Its own input is zero.
    ///
    /// As if the controller renewed its output all the time, knew the velocity at once and never clipped:
    /// true for motions that are slow beside its renewals. `None` where the first output feels the force at
    /// once, the loop then being algebraic.
    #[must_use]
    pub fn in_loop(&self, controller: &Controller) -> Option<Self> {
        let measured = &self.outputs.first()?.row;
        let rate: Vec<f64> =
            self.system.a.column_iter().map(|by_state| dot(&measured.state, by_state.as_slice())).collect();
        let feels = dot(&measured.state, &self.system.value).abs() + measured.value.abs();
        let has_slope = |row: &Row| row.slope != 0.0;
        let reads_slope = self.outputs.iter().any(|output| has_slope(&output.row))
            || self.system.slope.iter().any(|entry| *entry != 0.0);
        if feels > 0.0 || reads_slope {
            return None;
        }
        let Controller { kp, kv, .. } = *controller;
        let held = measured.state.iter().zip(&rate).map(|(place, rate)| -kv * (kp * place + rate));
        let held = Row { state: held.collect(), value: 0.0, slope: 0.0 };
        let mut closed = self.clone();
        let push = DVector::from_column_slice(&self.system.value);
        closed.system.a += push * DVector::from_column_slice(&held.state).transpose();
        closed.system.value.fill(0.0);
        let outputs = closed.outputs.iter_mut().map(|output| &mut output.row);
        let points =
            closed.points.iter_mut().flat_map(|point| [&mut point.displacement, &mut point.velocity]);
        for row in outputs.chain(points) {
            let share = std::mem::take(&mut row.value);
            row.add(share, &held);
        }
        closed.fastest_rad_s = fastest(&closed.system.a);
        Some(closed)
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_recording::Recording;

    use crate::model::{Model, Physics};
    use crate::simulate::{Hold, simulate};
    use crate::state_space::{ForceSeries, StateSpace};

    const SLIDE: &str = r#"
        schema = 1
        kind = "lumped"
        body = [{ name = "slider", mass = 4.8 }, { name = "load", mass = 0.9 }]
        spring = [{ between = ["slider", "load"], stiffness = 700.0 }]
        damper = [{ between = ["slider", "ground"], damping = 7.5 }, { between = ["slider", "load"], damping = 2.0 }]
        input = { column = "force_N", body = "slider" }
        output = [
            { column = "slider_m", body = "slider" },
            { column = "load_m", body = "load" },
            { column = "load_m_s2", body = "load", quantity = "acceleration" },
        ]
        [controller]
        kind = "cascade_pd"
        kp = 21.0
        kv = 206.0
        sample_s = 0.0002
        reference_column = "reference_m"
    "#;

    /// A disturbance that the machine's simulation applies as a law, and the loop here as a series, do the
    /// same.
    #[test]
    fn a_force_in_the_loop_moves_the_machine_as_it_does_in_its_simulation() {
        let model = Model::from_toml("slide.toml", SLIDE).unwrap();
        let time_s: Vec<f64> = (0..4000).map(|k| 0.001 * f64::from(k)).collect();
        let still = vec![0.0; time_s.len()];
        let run = Recording::new("run", time_s.clone())
            .with_column("force_N", still.clone())
            .with_column("reference_m", still.clone());
        for at in ["slider", "load"] {
            let mut pulled = model.clone();
            pulled.setup_mut().physics = vec![Physics::new("constant_force", at).with("force", 5.0)];
            let simulated = simulate(&pulled, &run).unwrap();
            let space = StateSpace::new(&model).unwrap();
            let point = space.find_point(at).unwrap().0;
            let closed = space.in_loop(model.setup().controller.as_ref().unwrap()).unwrap();
            let force = ForceSeries { point, samples: vec![5.0; time_s.len()] };
            let start = vec![0.0; closed.order()];
            let trace = closed.run(&time_s, &still, Hold::FirstOrder, &[force], &start).unwrap();
            for (output, samples) in closed.outputs().iter().zip(&trace.outputs) {
                let wanted = simulated.column(&output.column).unwrap();
                let largest = wanted.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
                // The law's force begins behind the first sample.
                let off = wanted.iter().zip(samples).skip(1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 0.01 * largest, "{at} {}: {off} of {largest}", output.column);
            }
            // At rest the loop is a spring of kp kv.
            let end = trace.outputs[0].last().unwrap();
            assert!((end / (5.0 / (21.0 * 206.0)) - 1.0).abs() < 1e-3, "{end}");
        }
    }

    #[test]
    fn a_loop_around_an_acceleration_is_refused() {
        let position = "{ column = \"slider_m\", body = \"slider\" }";
        let acceleration = "{ column = \"slider_m\", body = \"slider\", quantity = \"acceleration\" }";
        let open = SLIDE.split("[controller]").next().unwrap().replace(position, acceleration);
        let controller = Model::from_toml("slide.toml", SLIDE).unwrap().setup().controller.clone().unwrap();
        let space = StateSpace::new(&Model::from_toml("felt.toml", &open).unwrap()).unwrap();
        assert!(space.in_loop(&controller).is_none());
    }
}
