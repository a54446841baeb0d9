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
        let has_base = matches!(model, Model::BeamOnBase(_) | Model::Modal(_))
            && model.input().is_some_and(|input| input.column != "base_position_m");
        let sees_base = self
            .train
            .iter()
            .any(|record| record.outputs.iter().any(|output| output.column == "base_position_m"));
        if has_base && !sees_base {
            self.caps.push(
                "the base was not recorded: what the drive does cannot be told from what the base does, nor a late drive from a \
                 late sensor; record base_position_m"
                    .to_owned(),
            );
        }
    }
}
