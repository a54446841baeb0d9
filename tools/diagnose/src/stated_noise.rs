//! The noise of sensors, where a model file states it.

use stillbeam_plant::Model;

use crate::input_noise::flat_power;
use crate::noise::{NoiseFloor, NoiseSource, OutputResidual};

/// What a model says of the noise of its sensors, rounding included.
pub(crate) fn stated_noise(model: &Model) -> Vec<Option<f64>> {
    let of = |column: &String| {
        let sensor = model.setup().sensors.iter().find(|sensor| sensor.column == *column)?;
        let square = sensor.noise_rms.powi(2) + sensor.quantum.powi(2) / 12.0;
        (sensor.noise_rms > 0.0).then(|| square.sqrt())
    };
    model.output_columns().iter().map(of).collect()
}

impl NoiseFloor {
    /// As the model states it; where the readings show white noise that is louder than that, as they do.
    pub(crate) fn stated(self, rms: f64, parts: &[OutputResidual<'_>]) -> Self {
        let white = parts.iter().map(|part| flat_power(&part.record.outputs[part.output].samples));
        let shown = white.fold(f64::INFINITY, f64::min).sqrt().min(self.rms);
        Self { rms: rms.max(shown), source: NoiseSource::Stated, samples: f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Sensor;

    use super::*;
    use crate::comparison::compare;
    use crate::simulation::Hypothesis;
    use crate::study::Study;
    use crate::two_bodies::{NOISE_M, driven, slide, swept};

    #[test]
    fn a_noise_that_the_model_states_is_the_floor_unless_the_readings_are_louder() {
        let force = [swept(8.0), vec![0.0; 2000]].concat();
        for (stated_m, least, most) in [(1.5 * NOISE_M, 1.45, 1.55), (0.1 * NOISE_M, 0.7, 1.1)] {
            let mut machine = slide(31000.0, &[]);
            let recording = driven(&machine, &force, None, 5);
            for column in machine.output_columns() {
                let sensor = Sensor { noise_rms: stated_m, ..Sensor::ideal(column) };
                machine.setup_mut().sensors.push(sensor);
            }
            let mut study = Study::new(&machine, &[recording], &[]).unwrap();
            let compared = compare(&mut study, &Hypothesis::given(&machine)).unwrap();
            for floor in compared.floors.iter().flatten() {
                assert_eq!(floor.source, NoiseSource::Stated);
                let times = floor.rms / NOISE_M;
                assert!((least..most).contains(&times), "{times} times the noise");
            }
        }
    }
}
