//! The place where the force of a modal model's input acts, known by an output that reads its motion.

use super::modes::{Places, add_beside, sum_of_modes};
use super::{InjectionPoint, Row};
use crate::linear::{LinearSystem, dot};
use crate::model::{DRIVING_POINT, ModalModel, Quantity};
use crate::modes::Mode;

/// Whether the point's displacement is no combination of the modes' states, so that its velocity is
/// integrated.
pub(super) fn is_integrated(model: &ModalModel) -> bool {
    model
        .driving_output()
        .is_some_and(|(number, output)| output.quantity == Quantity::Velocity && !model.is_in_phase(number))
}

/// The point, and in the system its displacement where that is a state of its own; `force` is what a unit
/// force adds to the rates of the states.
pub(super) fn of(
    model: &ModalModel,
    modes: &[Mode],
    places: &Places,
    force: Vec<f64>,
    system: &mut LinearSystem,
) -> Option<InjectionPoint> {
    let (number, output) = model.driving_output()?;
    let sum = |order: usize| sum_of_modes(model, modes, places, number, order);
    let whole = |order: usize| {
        let mut row = sum(order);
        add_beside(&mut row, model, places, number, output.quantity);
        row
    };
    let (displacement, velocity) = match output.quantity {
        Quantity::Position => {
            let displacement = whole(0);
            let velocity = rate(&displacement, system);
            (displacement, velocity)
        }
        Quantity::Velocity => (displacement_of(&whole(1), sum(0), model, places, number, system), whole(1)),
        Quantity::Acceleration => (sum(0), sum(1)),
    };
    let (displacement_unit, force_unit) = model.driving_units();
    Some(InjectionPoint {
        name: DRIVING_POINT.to_owned(),
        displacement,
        velocity,
        force,
        displacement_unit,
        force_unit,
        stiffness: 0.0,
        is_coordinate: false,
    })
}

/// Time derivative of a row of states.
fn rate(row: &Row, system: &LinearSystem) -> Row {
    let state = system.a.column_iter().map(|rates| dot(&row.state, rates.as_slice())).collect();
    Row { state, value: dot(&row.state, &system.value), slope: 0.0 }
}

/// Integral of a velocity: a state of its own, or the modes' coordinates and the free motion's.
fn displacement_of(
    velocity: &Row,
    mut modes: Row,
    model: &ModalModel,
    places: &Places,
    number: usize,
    system: &mut LinearSystem,
) -> Row {
    if let Some(integral) = places.integral {
        for (column, share) in velocity.state.iter().enumerate() {
            system.a[(integral, column)] = *share;
        }
        let mut displacement = Row::zero(places.order);
        displacement.state[integral] = 1.0;
        return displacement;
    }
    if let (Some(rigid), Some(place)) = (&model.beside.rigid, places.rigid) {
        modes.state[place] += rigid.velocity.get(number).copied().unwrap_or(0.0);
    }
    modes
}
