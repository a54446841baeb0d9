//! Identified modes as a model file, for `simulate`.

use std::collections::BTreeMap;

use stillbeam_identify::IdentifiedModes;
use stillbeam_plant::{BASE_POSITION, Input, ModalModel, ModalOutput, Mode, Quantity, SETPOINT, Setup};
use stillbeam_recording::Column;

use crate::error::CliError;

/// The text of a modal model file. The participations of a free decay, which no free decay shows, are 1.
///
/// # Errors
/// [`CliError::ModelFile`] when the modes make no model.
pub fn modal_model_text(modes: &IdentifiedModes) -> Result<String, CliError> {
    Ok(modal_model(modes).to_toml()?)
}

fn modal_model(modes: &IdentifiedModes) -> ModalModel {
    let quantity = match unit_of(&modes.output).as_str() {
        "m_s" | "mm_s" | "rad_s" | "deg_s" => Quantity::Velocity,
        "m_s2" | "mm_s2" | "g" | "rad_s2" => Quantity::Acceleration,
        _ => Quantity::Position,
    };
    let input = modes.input.as_ref().map(|column| match unit_of(column).as_str() {
        // Any other position of the base goes by the name that the model format has for it.
        "m" if column != SETPOINT => Input::new(BASE_POSITION),
        // The equation is driven by minus the base's acceleration.
        "m_s2" => Input { column: column.clone(), gain: -1.0 },
        _ => Input::new(column.clone()),
    });
    ModalModel {
        modes: modes
            .modes
            .iter()
            .map(|mode| Mode {
                frequency_hz: mode.frequency_hz.value,
                damping_ratio: mode.damping_ratio.value,
                participation: vec![mode.participation.map_or(1.0, |participation| participation.value)],
            })
            .collect(),
        drive: None,
        input,
        outputs: vec![ModalOutput { column: modes.output.clone(), quantity }],
        fixed: BTreeMap::new(),
        setup: Setup::default(),
    }
}

fn unit_of(column: &str) -> String {
    Column { name: column.to_owned(), samples: Vec::new() }.unit().to_owned()
}
