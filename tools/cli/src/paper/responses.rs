//! Fig. 5: the response of the beam to the unshaped move beside that of models with each set of parameters.

use stillbeam_plant::{Mode, PlantError, PrescribedBase};

use super::printed::{DECREMENT_DAMPING, DESIGN, TABLE_1, rayleigh};
use super::sweeps::SweepResult;
use crate::base_move::BaseMove;
use crate::error::CliError;

/// Seconds of free vibration that are compared.
pub const COMPARED_S: f64 = 10.0;

/// One set of parameters and how well it foretells the response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Where the parameters come from.
    pub name: String,
    /// Natural frequencies of both modes, hertz.
    pub frequency_hz: [f64; 2],
    /// Damping ratios of both modes.
    pub damping_ratio: [f64; 2],
    /// Rayleigh's coefficients of them, `[1/s, s]`.
    pub rayleigh: [f64; 2],
    /// Root mean square of model minus beam over the compared time, as a fraction of that of the beam. Two
    /// signals of no relation have about 1.4.
    pub error: f64,
    /// The model's tip deflection in metres, one per sample of the move.
    pub tip_deflection_m: Vec<f64>,
}

/// Simulates the unshaped move with every set: the paper's four sweeps, its decrement, and our estimates from
/// the slowest sweep. All share the true participations, which the paper does not print.
///
/// # Errors
/// [`CliError::Plant`].
pub fn run(unshaped: &BaseMove, true_modes: &[Mode], ours: &SweepResult) -> Result<Vec<Response>, CliError> {
    let mut sets: Vec<(String, [f64; 2], [f64; 2])> = TABLE_1
        .iter()
        .map(|row| (format!("paper, {}", row.name()), row.frequency_hz, row.damping_ratio))
        .collect();
    let decrement_hz = DESIGN.map(|(frequency_hz, _)| frequency_hz);
    sets.push(("paper, logarithmic decrement".to_owned(), decrement_hz, [DECREMENT_DAMPING; 2]));
    if let [first, second] = ours.identified.modes.as_slice() {
        sets.push((
            format!("this project, {}", ours.printed.name()),
            [first.frequency_hz.value, second.frequency_hz.value],
            [first.damping_ratio.value, second.damping_ratio.value],
        ));
    }
    sets.into_iter()
        .map(|(name, frequency_hz, damping_ratio)| {
            respond(unshaped, true_modes, name.clone(), frequency_hz, damping_ratio)
                .map_err(CliError::plant(name))
        })
        .collect()
}

fn respond(
    unshaped: &BaseMove,
    true_modes: &[Mode],
    name: String,
    frequency_hz: [f64; 2],
    damping_ratio: [f64; 2],
) -> Result<Response, PlantError> {
    let modes = true_modes.iter().zip(frequency_hz.iter().zip(damping_ratio)).map(|(mode, (hz, zeta))| {
        Mode { frequency_hz: *hz, damping_ratio: zeta, participation: mode.participation.clone() }
    });
    let rate_hz = unshaped.rate_hz;
    let mut plant = PrescribedBase::from_modes(modes.collect(), None, rate_hz, 0.0)?;
    let first = unshaped.residual.end_tick;
    let compared = first..first + (COMPARED_S * rate_hz) as usize;
    let mut tip_deflection_m = vec![plant.tip_deflection_m()];
    let setpoints_m = unshaped.setpoint_m.iter().take(compared.end).skip(1);
    tip_deflection_m.extend(setpoints_m.map(|setpoint_m| plant.step(*setpoint_m)));
    let pairs = tip_deflection_m.iter().zip(&unshaped.tip_deflection_m).skip(first);
    let (mut difference, mut size) = (0.0, 0.0);
    for (model, beam) in pairs {
        difference += (model - beam).powi(2);
        size += beam * beam;
    }
    let error = (difference / size).sqrt();
    let rayleigh = rayleigh(frequency_hz, damping_ratio);
    Ok(Response { name, frequency_hz, damping_ratio, rayleigh, error, tip_deflection_m })
}
