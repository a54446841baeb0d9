//! How the model was chosen, and what is not in it.

use maud::{Markup, html};
use stillbeam_identify::{IdentifiedModes, NoiseModel, Rejected};

/// The steps of the choice, the noise, and the list of what was left out; nothing where there is nothing to
/// say.
pub fn section(modes: &IdentifiedModes) -> Markup {
    html! {
        @if !modes.model_choice.is_empty() {
            h3 { "How the model was chosen" }
            table {
                thead { tr {
                    th { "step" } th { "free numbers" } th { "rms of what is left" } th { "kept" } th { "why" }
                } }
                tbody { @for step in &modes.model_choice {
                    tr {
                        td { (step.what) }
                        td { (step.parameters) }
                        td { (format!("{:.3e}", step.residual_rms)) }
                        td { (if step.kept { "yes" } else { "no" }) }
                        td { (step.reason) }
                    }
                } }
            }
        }
        p.muted { (noise(modes.noise)) }
        @if !modes.rejected.is_empty() {
            h3 { "Not in the result" }
            ul { @for entry in &modes.rejected { li { (rejected(entry)) } } }
        }
    }
}

fn noise(noise: NoiseModel) -> String {
    match noise {
        NoiseModel::White => {
            "Noise: no filter; what is left is white, or its stamps are too uneven for one.".to_owned()
        }
        NoiseModel::Autoregressive { order } => {
            format!("Noise: coloured; fitted through the filter of an autoregression of order {order}.")
        }
        NoiseModel::NotNoise { apart, .. } => format!(
            "What is left is not independent noise: with a noise model the modes would move by {apart:.1} standard errors. The plain fit is shown."
        ),
    }
}

fn rejected(entry: &Rejected) -> String {
    match entry {
        Rejected::Pole { frequency_hz, damping_ratio: Some(damping), reason } => {
            format!("{frequency_hz:.4} Hz, damping ratio {damping:.5}: {reason}")
        }
        Rejected::Pole { frequency_hz, reason, .. } => format!("{frequency_hz:.4} Hz: {reason}"),
        Rejected::Samples { recording, count, first_s, last_s, reason } => {
            format!("{count} samples of {recording} between {first_s:.4} s and {last_s:.4} s: {reason}")
        }
    }
}
