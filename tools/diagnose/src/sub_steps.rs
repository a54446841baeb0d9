//! How long the sub-steps are between which the forces of laws are taken anew.

use std::f64::consts::TAU;

use stillbeam_plant::{Model, StepLengths};

/// Radians that the fastest motion turns in a sub-step, and its shortest and longest length in seconds, where
/// the machine is driven: a slow one too may cross a short wave or a stop quickly ...
const DRIVEN: (f64, [f64; 2]) = (0.1, [1e-4, 2e-3]);
/// ... and where nothing keeps it in step: what a sub-step gets wrong of the frequency adds up from period to
/// period.
const FREE: (f64, [f64; 2]) = (0.03, [1e-4, 5e-3]);

/// Radians that the fastest motion turns in a step along which forces are smooth, driven and free.
const SMOOTH: [f64; 2] = [1.0, 0.3];

/// The sub-steps of one recording.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SubSteps {
    /// The fastest motion in the recorded band, hertz.
    band_hz: f64,
    is_driven: bool,
    /// How often all of them are halved beside.
    pub(crate) halvings: u32,
}

impl SubSteps {
    pub(crate) fn new(band_hz: f64, is_driven: bool) -> Self {
        Self { band_hz, is_driven, halvings: 0 }
    }

    /// The same, all halved once more.
    pub(crate) fn halved(self) -> Self {
        Self { halvings: self.halvings + 1, ..self }
    }

    /// The longest sub-steps of a model: as long as what moves in the recorded band allows. Modes are
    /// independent and their linear part is exact whatever the step, so that of a free decay only those
    /// count in which a force acts.
    pub(crate) fn lengths(self, model: &Model) -> StepLengths {
        let (radians, [shortest_s, longest_s]) = if self.is_driven { DRIVEN } else { FREE };
        let pushed_hz = if self.is_driven { None } else { fastest_pushed_hz(model) };
        let fastest_hz = pushed_hz.map_or(self.band_hz, |hz| hz.min(self.band_hz));
        let per_radian_s = 1.0 / (TAU * fastest_hz.max(1e-9));
        let [driven, free] = SMOOTH;
        let smooth_s = if self.is_driven { driven } else { free } * per_radian_s;
        StepLengths {
            short_s: (radians * per_radian_s).clamp(shortest_s, longest_s),
            smooth_s: Some(smooth_s.max(shortest_s)),
            halvings: self.halvings,
        }
    }
}

/// Frequency of the fastest mode that a law sits in, where all laws sit in modes and nothing joins these.
fn fastest_pushed_hz(model: &Model) -> Option<f64> {
    let Model::Modal(modal) = model else { return None };
    if modal.setup.controller.is_some() {
        return None;
    }
    let frequency_hz = |location: &str| {
        let number = location.strip_prefix("mode ")?.parse::<usize>().ok()?;
        Some(modal.modes.get(number.checked_sub(1)?)?.frequency_hz)
    };
    let pushed = modal.setup.physics.iter().map(|law| frequency_hz(&law.location));
    pushed.collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::{Physics, SimulateOptions, simulate_with};
    use stillbeam_recording::Recording;

    use super::*;

    /// A free decay of two modes with a law in one of them.
    fn two_modes(law: Option<Physics>) -> Model {
        let text = "schema = 1\nkind = \"modal\"\n\
            mode = [{ frequency_hz = 1.1, damping_ratio = 0.005, participation = [1.0, 1.0] },\n\
            { frequency_hz = 6.9, damping_ratio = 0.004, participation = [0.5, 0.5] }]\n\
            input = { column = \"force_N\" }\noutput = [{ column = \"tip_m\" }, { column = \"tip_m_s2\", quantity = \"acceleration\" }]\n\
            initial = { \"mode 1\" = { displacement = 0.01 }, \"mode 2\" = { displacement = 0.004 } }";
        let mut model = Model::from_toml("two_modes.toml", text).unwrap();
        model.setup_mut().physics = law.into_iter().collect();
        model
    }

    fn steps() -> SubSteps {
        SubSteps::new(6.9, false)
    }

    #[test]
    fn the_mode_that_a_law_sits_in_sets_the_step_of_a_free_decay() {
        let slow = Physics::new("cubic_stiffness", "mode 1").with("stiffness", 1e4);
        let fast = Physics::new("cubic_stiffness", "mode 2").with("stiffness", 1e4);
        let shaken = Physics::new("periodic_disturbance", "environment").with("force", 1.0);
        let [slow, fast, shaken] =
            [slow, fast, shaken].map(|law| steps().lengths(&two_modes(Some(law))).short_s);
        assert!((slow * TAU * 1.1 - 0.03).abs() < 1e-9, "{slow} s");
        assert!((fast * TAU * 6.9 - 0.03).abs() < 1e-9, "{fast} s");
        assert!((shaken - fast).abs() < 1e-12, "a disturbance shakes all modes: {shaken} s");
        let driven = SubSteps::new(6.9, true).lengths(&two_modes(None)).short_s;
        assert!((driven - 2e-3).abs() < 1e-12, "{driven} s");
    }

    #[test]
    fn longer_steps_change_nothing_that_a_recording_shows() {
        let times: Vec<f64> = (0..4000).map(|k| 0.005 * f64::from(k)).collect();
        let recording = Recording::new("decay", times).with_column("force_N", vec![0.0; 4000]);
        let laws = [
            Physics::new("cubic_stiffness", "mode 1").with("stiffness", 2e4),
            Physics::new("coulomb_friction", "mode 1").with("force", 2e-3),
            Physics::new("hysteresis", "mode 1").with("stiffness", 0.5).with("beta", 300.0),
        ];
        for (law, columns) in laws.into_iter().zip([2, 1, 2]) {
            let id = law.id.clone();
            let model = two_modes(Some(law));
            let run = |longest_s: f64| {
                let options =
                    SimulateOptions { longest_step_s: Some(longest_s), ..SimulateOptions::default() };
                simulate_with(&model, &recording, &options).unwrap()
            };
            let (long, short) = (run(steps().lengths(&model).short_s), run(2e-4));
            // Where dry friction turns round, its force is either of two.
            for column in ["tip_m", "tip_m_s2"].into_iter().take(columns) {
                let [long, short] = [&long, &short].map(|run| run.column(column).unwrap());
                let most = short.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
                let worst = long.iter().zip(short).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-4 * most, "{id}: {worst} of {most}, {column}");
            }
        }
    }
}
