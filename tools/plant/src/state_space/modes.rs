//! A modal model as a state space.

use nalgebra::DMatrix;

use super::{BaseMotion, InjectionPoint, Output, Row, StateSpace, drive_for};
use crate::linear::LinearSystem;
use crate::model::{ModalModel, Quantity, RealPole};
use crate::modes::Mode;

/// The modes as their input drives them.
pub(super) fn of_modes(model: &ModalModel, extra: &[Mode]) -> StateSpace {
    match &model.input {
        Some(input) if input.is_motion() => {
            let modes = all(model, extra);
            let motion = BaseMotion::new(&modes, drive_for(&input.column, model.drive.as_ref()));
            let outputs = (0..).zip(&model.outputs).map(|(number, output)| {
                let mut row = motion.row();
                for (index, mode) in modes.iter().enumerate() {
                    motion.add(&mut row, index, output.quantity, participation(mode, number));
                }
                Output::new(&output.column, row)
            });
            let outputs = outputs.collect();
            let points = motion.points(&modes, None, &coordinate_unit(model));
            motion.into_space(outputs, points)
        }
        input => of_forced_modes(model, extra, input.as_ref().map_or(0.0, |input| input.gain)),
    }
}

/// Modes driven by a force: state `q_1, q_1', q_2, q_2', ...`, and last a real pole's where there is one.
pub(super) fn of_forced_modes(model: &ModalModel, extra: &[Mode], gain: f64) -> StateSpace {
    let modes = all(model, extra);
    let size = 2 * modes.len() + usize::from(model.real_pole.is_some());
    let mut a = DMatrix::zeros(size, size);
    let mut value = vec![0.0; size];
    let mut points = Vec::new();
    let unit = coordinate_unit(model);
    for (index, mode) in modes.iter().enumerate() {
        let (q, dq) = (2 * index, 2 * index + 1);
        a[(q, dq)] = 1.0;
        a[(dq, q)] = -mode.omega_rad_s().powi(2);
        a[(dq, dq)] = -2.0 * mode.decay_per_s();
        value[dq] = gain;
        let only = |place: usize| {
            let mut row = Row::zero(size);
            row.state[place] = 1.0;
            row
        };
        points.push(InjectionPoint {
            name: format!("mode {}", index + 1),
            displacement: only(q),
            velocity: only(dq),
            force: only(dq).state,
            displacement_unit: unit.clone(),
            force_unit: format!("{unit}/s²"),
            stiffness: mode.omega_rad_s().powi(2),
            is_coordinate: true,
        });
    }
    if let Some(real) = &model.real_pole {
        a[(size - 1, size - 1)] = -1.0 / real.time_constant_s;
        value[size - 1] = gain;
    }
    let system = LinearSystem { a, slope: vec![0.0; size], value };
    let outputs = (0..).zip(&model.outputs).map(|(number, output)| {
        if let Some(real) = &model.real_pole {
            let position = beside(real, &modes, number, size);
            return match output.quantity {
                Quantity::Position => Output::new(&output.column, position),
                // The rate of a row is to it what an acceleration is to a velocity.
                _ => Output::acceleration(&output.column, &position.state, &system, &points),
            };
        }
        let offset = if output.quantity == Quantity::Position { 0 } else { 1 };
        let mut row = Row::zero(size);
        for (index, mode) in modes.iter().enumerate() {
            row.state[2 * index + offset] += participation(mode, number);
        }
        match output.quantity {
            Quantity::Acceleration => Output::acceleration(&output.column, &row.state, &system, &points),
            _ => Output::new(&output.column, row),
        }
    });
    let outputs = outputs.collect();
    StateSpace::assemble(system, vec![0.0; size], outputs, points)
}

/// A position output of modes beside a real pole.
fn beside(real: &RealPole, modes: &[Mode], output: usize, size: usize) -> Row {
    let of = |list: &[f64]| list.get(output).copied().unwrap_or(0.0);
    let mut row = Row::zero(size);
    for (index, mode) in modes.iter().enumerate() {
        row.state[2 * index] = participation(mode, output);
        // A further mode, of the left-out physics, has no rate.
        row.state[2 * index + 1] = real.rate_participation.get(index).map_or(0.0, |rate| of(rate));
    }
    row.state[size - 1] = of(&real.participation);
    row
}

fn all(model: &ModalModel, extra: &[Mode]) -> Vec<Mode> {
    model.modes.iter().chain(extra).cloned().collect()
}

/// A further mode may have been given one participation only: that of the first output.
fn participation(mode: &Mode, output: usize) -> f64 {
    mode.participation.get(output).copied().unwrap_or(0.0)
}

/// Participations are taken as dimensionless, so a coordinate has the unit of the first position output.
fn coordinate_unit(model: &ModalModel) -> String {
    let position = model.outputs.iter().find(|output| output.quantity == Quantity::Position);
    let unit = position.map(|output| crate::model::unit_of(&output.column)).filter(|unit| !unit.is_empty());
    unit.unwrap_or_else(|| "m".to_owned())
}
