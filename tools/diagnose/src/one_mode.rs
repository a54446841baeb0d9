//! What a parameter of one mode changes: only what that mode does.
//!
//! Modes are independent, so the derivative of all outputs by one mode's frequency, damping or participation
//! is that of a model of this mode alone. Simulating that costs one mode and not all of them.

use stillbeam_plant::Model;

use crate::parameters::FreeParameter;
use crate::simulation::Hypothesis;

/// One mode of a model, alone.
pub(crate) struct OneMode {
    mode: usize,
    /// The parameter's path in the model of that mode.
    pub(crate) path: String,
}

impl OneMode {
    /// Of a parameter that belongs to one of several independent modes; `None` where laws, a controller, a
    /// real pole or lags join them.
    pub(crate) fn of(hypothesis: &Hypothesis, parameter: &FreeParameter) -> Option<Self> {
        let Model::Modal(model) = &hypothesis.model else { return None };
        let is_joined = !model.setup.physics.is_empty() || model.setup.controller.is_some();
        let starts_elsewhere = !model.setup.initial.is_empty();
        let is_beside = model.real_pole.is_some() || !model.beside.is_empty();
        if is_joined || starts_elsewhere || is_beside || model.modes.len() < 2 {
            return None;
        }
        let (number, name) = parameter.path.strip_prefix("mode.")?.split_once('.')?;
        let mode = number.parse::<usize>().ok()?.checked_sub(1)?;
        (mode < model.modes.len()).then(|| Self { mode, path: format!("mode.1.{name}") })
    }

    /// The model of that mode alone, the parameter at this value.
    pub(crate) fn alone(&self, hypothesis: &Hypothesis, value: f64) -> Option<Hypothesis> {
        let mut alone = hypothesis.clone();
        let Model::Modal(model) = &mut alone.model else { return None };
        model.modes = vec![model.modes.get(self.mode)?.clone()];
        model.fixed.clear();
        alone.model.set_parameter(&self.path, value).ok()?;
        alone.model.check().ok()?;
        Some(alone)
    }

    /// Of an initial state of all modes that of this one.
    pub(crate) fn initial<'i>(&self, initial: &'i [f64]) -> &'i [f64] {
        initial.get(2 * self.mode..2 * self.mode + 2).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_identify::tall::{add_scaled, dot};
    use stillbeam_plant::SimulateOptions;
    use stillbeam_recording::{Recording, Role};

    use super::*;
    use crate::parameters::free_parameters;
    use crate::study::Study;

    /// Three modes under a force, two outputs.
    fn modes() -> Model {
        let text = r#"
            schema = 1
            kind = "modal"
            input = { column = "force_N" }
            output = [{ column = "tip_m" }, { column = "tip_m_s2", quantity = "acceleration" }]
            mode = [
                { frequency_hz = 2.1, damping_ratio = 0.02, participation = [0.4, 0.3] },
                { frequency_hz = 5.3, damping_ratio = 0.01, participation = [0.2, -0.3] },
                { frequency_hz = 9.7, damping_ratio = 0.03, participation = [-0.1, 0.2] },
            ]
        "#;
        Model::from_toml("modes.toml", text).unwrap()
    }

    #[test]
    fn one_mode_alone_changes_as_all_modes_do() {
        let model = modes();
        let time_s: Vec<f64> = (0..800).map(|k| 0.01 * f64::from(k)).collect();
        let force = time_s.iter().map(|t| (7.0 * t + 2.0 * t * t).sin()).collect();
        let driven = Recording::new("swept", time_s).with_column("force_N", force);
        let run = stillbeam_plant::simulate_with(&model, &driven, &SimulateOptions::default()).unwrap();
        let study = Study::new(&model, std::slice::from_ref(&run), std::slice::from_ref(&run)).unwrap();
        let stack = study.stack(Role::Train);
        let hypothesis = Hypothesis::given(&model);
        let initial = [0.1, -0.2, 0.05, 0.4, -0.3, 0.2];
        let mut seen = 0;
        for parameter in free_parameters(&hypothesis) {
            let Some(one) = OneMode::of(&hypothesis, &parameter) else { continue };
            seen += 1;
            let moved = 1.01 * parameter.given;
            let change = |values: [Hypothesis; 2], initial: &[f64]| {
                let [base, moved] = values.map(|h| stack.prediction(0, &h, initial).unwrap());
                let mut change = moved;
                add_scaled(&mut change, -1.0, &base);
                change
            };
            let with =
                |value: f64| hypothesis.with_values(std::slice::from_ref(&parameter), &[value]).unwrap();
            let all = change([with(parameter.given), with(moved)], &initial);
            let alone = |value: f64| one.alone(&hypothesis, value).unwrap();
            let mut off = change([alone(parameter.given), alone(moved)], one.initial(&initial));
            add_scaled(&mut off, -1.0, &all);
            let share = (dot(&off, &off) / dot(&all, &all)).sqrt();
            assert!(share < 1e-9, "{}: {share:e}", parameter.path);
        }
        assert!(seen >= 12, "frequency, damping and two participations of three modes: {seen}");
    }
}
