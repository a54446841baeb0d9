//! What recordings cannot decide, whatever is found in them.

use stillbeam_plant::Model;

use crate::study::{Study, reach};

/// Recordings within this share of the largest count as driven equally hard.
const SAME_AMPLITUDE: f64 = 0.8;

impl Study {
    /// What these recordings cannot decide, whatever is found in them.
    pub(crate) fn find_caps(&mut self, model: &Model) {
        let reaches: Vec<f64> = self
            .train
            .iter()
            .chain(&self.held_out)
            .filter_map(|record| match &record.input {
                Some(input) => Some(reach(input)),
                None => record.outputs.first().map(|output| reach(&output.samples)),
            })
            .collect();
        let most = reaches.iter().copied().fold(0.0, f64::max);
        self.one_amplitude = reaches.iter().all(|reach| *reach > SAME_AMPLITUDE * most);
        if self.one_amplitude && reaches.len() > 1 {
            self.caps.push(
                "all recordings were driven equally hard: how an effect grows with amplitude is seen only within them; \
                 record a run at another amplitude"
                    .to_owned(),
            );
        }
        // Modes that are not moved by a base may have none: those of a circuit, say.
        let has_base = match model {
            Model::BeamOnBase(_) => true,
            Model::Modal(_) => model.input_is_motion(),
            _ => false,
        };
        let is_known = model.input().is_none_or(|input| input.column == "base_position_m");
        let sees_base = self
            .train
            .iter()
            .any(|record| record.outputs.iter().any(|output| output.column == "base_position_m"));
        if has_base && !is_known && !sees_base {
            self.caps.push(
                "the base was not recorded: what the drive does cannot be told from what the base does, nor a late drive from a \
                 late sensor; record base_position_m"
                    .to_owned(),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use stillbeam_plant::Model;
    use stillbeam_recording::Recording;

    use crate::study::Study;

    /// What is said of runs of a mode with this input.
    fn said(input: &str) -> Vec<String> {
        let text = format!(
            r#"
            schema = 1
            kind = "modal"
            input = {{ column = "{input}" }}
            output = [{{ column = "reading_V" }}]
            [[mode]]
            frequency_hz = 2.0
            damping_ratio = 0.01
            participation = [1.0]
            "#
        );
        let model = Model::from_toml("mode.toml", &text).unwrap();
        let run = |amplitude: f64| {
            let time_s: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
            let swung = |rate: f64| time_s.iter().map(|t| amplitude * (rate * t).sin()).collect::<Vec<f64>>();
            let (driven, read) = (swung(3.0), swung(3.1));
            Recording::new(format!("run {amplitude}"), time_s)
                .with_column(input, driven)
                .with_column("reading_V", read)
        };
        let mut study = Study::new(&model, &[run(0.01), run(0.02)], &[]).unwrap();
        study.find_caps(&model);
        study.caps
    }

    #[test]
    fn a_base_that_was_not_recorded_is_missed_only_where_there_is_one() {
        let missed = |input: &str| said(input).iter().any(|cap| cap.starts_with("the base was not recorded"));
        assert!(missed("setpoint_m"));
        assert!(!missed("base_position_m"), "the input is the base");
        assert!(!missed("drive_V"), "a circuit has no base");
    }
}
