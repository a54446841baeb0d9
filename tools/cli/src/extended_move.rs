//! A move of a model with left-out physics, a controller or sensors: run as a whole recording.

use stillbeam_plant::modes::clamped_modes;
use stillbeam_plant::{
    BASE_POSITION, BeamSignal, Model, Move, PlantError, ResidualVibration, TIP_DEFLECTION, measure_move,
    simulate,
};
use stillbeam_recording::Recording;

use crate::base_move::{BaseMove, hold_ticks};

/// As [`BaseMove::simulate`], with forces, controller and limits of the drive; the sensors are left out,
/// because the move is judged by what the beam does.
pub(crate) fn simulate_extended(
    model: &Model,
    rate_hz: f64,
    setpoints_m: &[f64],
) -> Result<BaseMove, PlantError> {
    let (Some(&from_m), Some(&to_m)) = (setpoints_m.first(), setpoints_m.last()) else {
        return Err(PlantError::Measure { what: "there is no setpoint", remedy: "give at least one" });
    };
    let (model, slowest_hz) = judged(model)?;
    let column = match (&model.setup().controller, model.input()) {
        (Some(controller), _) => controller.reference_column.clone(),
        (None, Some(input)) if model.input_is_motion() => input.column.clone(),
        (None, input) => {
            let found = input.map(|input| input.column.clone());
            return Err(PlantError::NotPrescribed { found });
        }
    };
    let mut setpoint_m = setpoints_m.to_vec();
    setpoint_m.resize(setpoints_m.len() + hold_ticks(slowest_hz, rate_hz), to_m);
    let time_s: Vec<f64> = (0..setpoint_m.len()).map(|index| index as f64 / rate_hz).collect();
    let recording = Recording::new("move", time_s.clone()).with_column(column, setpoint_m.clone());
    let result = simulate(&model, &recording)?;
    let tip = match &model {
        Model::BeamOnBase(_) => TIP_DEFLECTION.to_owned(),
        _ => model.output_columns().swap_remove(0),
    };
    let tip_deflection_m = result.column(&tip)?.to_vec();
    // A modal model has no base of its own: it is taken to be where it was sent.
    let base_m = result.column(BASE_POSITION).unwrap_or(&setpoint_m);
    let tip_position_m: Vec<f64> =
        base_m.iter().zip(&tip_deflection_m).map(|(base, tip)| base + tip).collect();
    let metrics = measure_move(&time_s, &tip_position_m, &Move::new(0.0, from_m, to_m))?;
    let end_tick = setpoints_m.iter().rposition(|&setpoint_m| setpoint_m != to_m).map_or(0, |last| last + 1);
    let window = (ResidualVibration::WINDOW_PERIODS / slowest_hz * rate_hz).ceil() as usize;
    let after = tip_deflection_m.iter().skip(end_tick).take(window);
    let tip_peak_m = after.fold(0.0, |peak: f64, deflection_m| peak.max(deflection_m.abs()));
    let residual = ResidualVibration { mode_amplitudes_m: Vec::new(), tip_peak_m, end_tick };
    Ok(BaseMove { rate_hz, setpoint_m, tip_deflection_m, tip_position_m, metrics, residual })
}

/// The model without sensors, a beam with all its outputs, and its slowest frequency in hertz.
fn judged(model: &Model) -> Result<(Model, f64), PlantError> {
    let mut judged = model.clone();
    judged.setup_mut().sensors.clear();
    let slowest_hz = match &mut judged {
        Model::BeamOnBase(beam) => {
            // The first stays first: a controller feeds it back.
            let missing = BeamSignal::ALL.into_iter().filter(|signal| !beam.outputs.contains(signal));
            beam.outputs.extend(missing.collect::<Vec<_>>());
            clamped_modes(beam)?.first().map(|mode| mode.omega_rad_s / std::f64::consts::TAU)
        }
        Model::Modal(modal) => modal.modes.iter().map(|mode| mode.frequency_hz).reduce(f64::min),
        _ => None,
    };
    match slowest_hz {
        Some(slowest_hz) => Ok((judged, slowest_hz)),
        None => Err(PlantError::Measure {
            what: "this kind of model has no tip whose vibration could be judged",
            remedy: "simulate a recording with --input",
        }),
    }
}
