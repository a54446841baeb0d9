//! Identified modes as a model file, for `simulate` and `diagnose`.
//!
//! What the fit found beside the modes goes along: a delay of the output as its sensor's, and the static
//! share of the modes beyond the band as one mode far above it, which a refit must not move, the real pole of
//! a base that slides with friction together with the rates of the modes. An offset belongs to a recording,
//! not to the structure, and stays with it.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use stillbeam_identify::{IdentifiedMode, IdentifiedModes};
use stillbeam_plant::{
    BASE_POSITION, Beside, Input, ModalModel, ModalOutput, Mode, Quantity, RealPole, SETPOINT, Sensor, Setup,
};
use stillbeam_recording::Column;

use crate::error::CliError;

/// A modal model file, and what of the result it cannot say.
pub struct ModalFile {
    /// The file.
    pub text: String,
    /// Sentences for whoever relies on it.
    pub remarks: Vec<String>,
}

/// How far above the highest mode the static share is put, as a ratio of frequencies: it then moves less than
/// a thousandth with frequency inside the band.
const BEYOND: f64 = 50.0;
/// The damping ratio of that mode; enough that a kink of the input does not ring it for long.
const BEYOND_DAMPING: f64 = 0.2;

/// A modal model file. The participations of a free decay, which no free decay shows, are 1.
///
/// # Errors
/// [`CliError::ModelFile`] when the modes make no model.
pub fn modal_file(modes: &IdentifiedModes) -> Result<ModalFile, CliError> {
    let mut remarks = Vec::new();
    if modes.input.is_none() {
        remarks.push("a free decay does not show participations: the model has 1 for each".to_owned());
    }
    let mut model = modal_model(modes);
    if let (Some(column), Some(input)) = (&modes.input, &model.input)
        && *column != input.column
    {
        let factor = metres_in(&unit_of(column)).map_or(String::new(), |(_, factor)| factor.to_owned());
        remarks.push(format!(
            "the model calls {column} {}, in metres: `diagnose` and `simulate` read it with --column {}={column}{factor}",
            input.column, input.column
        ));
    }
    if let Some(delay) = modes.delay_s {
        if delay.value > 0.0 {
            let column = modes.output.clone();
            model.setup.sensors.push(Sensor { delay_s: delay.value, ..Sensor::ideal(column) });
        } else {
            remarks.push(format!(
                "the output comes {:.6} s before the input: no sensor does that, the model leaves it out; compare the clocks",
                -delay.value
            ));
        }
    }
    if model.real_pole.is_some()
        && model.outputs.iter().any(|output| output.quantity == Quantity::Acceleration)
    {
        model.real_pole = None;
        remarks.push(
            "the real pole and the rates of the modes are not in the model, whose output is an acceleration; record a position or a velocity for that"
                .to_owned(),
        );
    }
    if let Some(direct) = modes.direct {
        match model.outputs.first().map(|output| output.quantity) {
            Some(Quantity::Position) => add_static_share(&mut model, per_metre(modes) * direct.value),
            _ => remarks.push(
                "the direct share of the input in the output is no position's and not in the model"
                    .to_owned(),
            ),
        }
    }
    Ok(ModalFile { text: model.to_toml()?, remarks })
}

/// A mode far above the others with the same static compliance.
fn add_static_share(model: &mut ModalModel, compliance: f64) {
    let highest_hz = model.modes.iter().map(|mode| mode.frequency_hz).fold(0.0, f64::max);
    let frequency_hz = BEYOND * highest_hz;
    let participation = compliance * (TAU * frequency_hz).powi(2);
    model.modes.push(Mode {
        frequency_hz,
        damping_ratio: BEYOND_DAMPING,
        participation: vec![participation],
    });
    if let Some(real) = &mut model.real_pole {
        real.rate_participation.push(vec![0.0]);
    }
    let number = model.modes.len();
    for parameter in ["frequency_hz", "damping_ratio", "participation"] {
        model.fixed.insert(format!("mode.{number}.{parameter}"), true);
    }
}

fn modal_model(modes: &IdentifiedModes) -> ModalModel {
    let quantity = quantity_of(&modes.output);
    let unit = modes.input.as_deref().map(unit_of).unwrap_or_default();
    let length = metres_in(&unit);
    let input = modes.input.as_ref().map(|column| match length {
        // Any other position of the base goes by the name that the model format has for it.
        Some(_) if column != SETPOINT => Input::new(BASE_POSITION),
        // The equation is driven by minus the base's acceleration.
        None if quantity_of(column) == Quantity::Acceleration => {
            Input { column: column.clone(), gain: -1.0, hold: None, noise_rms: None }
        }
        _ => Input::new(column.clone()),
    });
    let per_metre = per_metre(modes);
    let participation = |mode: &IdentifiedMode| {
        mode.participation.map_or(1.0, |participation| per_metre * participation.value)
    };
    ModalModel {
        modes: modes
            .modes
            .iter()
            .map(|mode| Mode {
                frequency_hz: mode.frequency_hz.value,
                damping_ratio: mode.damping_ratio.value,
                participation: vec![participation(mode)],
            })
            .collect(),
        real_pole: modes.real_pole.map(|real| RealPole {
            time_constant_s: real.time_constant_s.value,
            participation: vec![real.participation.value],
            rate_participation: modes
                .modes
                .iter()
                .map(|mode| vec![mode.rate_participation.map_or(0.0, |rate| rate.value)])
                .collect(),
        }),
        beside: Beside::default(),
        driving_point: None,
        drive: None,
        input,
        outputs: vec![ModalOutput { column: modes.output.clone(), quantity }],
        fixed: BTreeMap::new(),
        setup: Setup::default(),
    }
}

/// What a column is, by its unit.
pub fn quantity_of(column: &str) -> Quantity {
    match unit_of(column).as_str() {
        "m_s" | "mm_s" | "rad_s" | "deg_s" => Quantity::Velocity,
        "m_s2" | "mm_s2" | "g" | "rad_s2" => Quantity::Acceleration,
        _ => Quantity::Position,
    }
}

/// What was found is per unit of the recorded input: a motion of the model's is one in metres.
fn per_metre(modes: &IdentifiedModes) -> f64 {
    let unit = modes.input.as_deref().map(unit_of).unwrap_or_default();
    metres_in(&unit).map_or(1.0, |(metres, _)| 1.0 / metres)
}

/// Metres in a unit of length, and the factor as `--column` takes it.
fn metres_in(unit: &str) -> Option<(f64, &'static str)> {
    match unit {
        "m" => Some((1.0, "")),
        "cm" => Some((1e-2, "*0.01")),
        "mm" => Some((1e-3, "*0.001")),
        "um" => Some((1e-6, "*1e-6")),
        _ => None,
    }
}

fn unit_of(column: &str) -> String {
    Column { name: column.to_owned(), samples: Vec::new() }.unit().to_owned()
}
