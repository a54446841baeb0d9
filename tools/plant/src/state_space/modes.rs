//! A modal model as a state space.

use nalgebra::DMatrix;

use super::{BaseMotion, InjectionPoint, Output, Row, StateSpace, drive_for, driving_point};
use crate::linear::LinearSystem;
use crate::model::{DRIVING_POINT, ModalModel, Quantity};
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

/// Modes driven by a force: state `q_1, q_1', q_2, q_2', ...`, then a free motion's two, then the lags' or a
/// real pole's, and last the displacement of the driving point where it has to be integrated.
pub(super) fn of_forced_modes(model: &ModalModel, extra: &[Mode], gain: f64) -> StateSpace {
    let modes = all(model, extra);
    let places = Places::of(model, modes.len());
    let size = places.order;
    let mut a = DMatrix::zeros(size, size);
    let mut drive = vec![0.0; size];
    let mut points = Vec::new();
    let unit = coordinate_unit(model);
    for (index, mode) in modes.iter().enumerate() {
        let (q, dq) = (2 * index, 2 * index + 1);
        a[(q, dq)] = 1.0;
        a[(dq, q)] = -mode.omega_rad_s().powi(2);
        a[(dq, dq)] = -2.0 * mode.decay_per_s();
        drive[dq] = 1.0;
        let name = format!("mode {}", index + 1);
        points.push(coordinate(name, q, size, &unit, mode.omega_rad_s().powi(2)));
    }
    if let Some(r) = places.rigid {
        a[(r, r + 1)] = 1.0;
        drive[r + 1] = 1.0;
        points.push(coordinate("rigid".to_owned(), r, size, &unit, 0.0));
    }
    let poles = model.beside.lags.iter().map(|lag| lag.time_constant_s);
    let poles = poles.chain(model.real_pole.iter().map(|real| real.time_constant_s));
    for (p, time_constant_s) in (places.lags..).zip(poles) {
        a[(p, p)] = -1.0 / time_constant_s;
        drive[p] = 1.0;
    }
    let value: Vec<f64> = drive.iter().map(|share| gain * share).collect();
    let mut system = LinearSystem { a, slope: vec![0.0; size], value };
    points.extend(driving_point::of(model, &modes, &places, drive, &mut system));
    let outputs = (0..).zip(&model.outputs).map(|(number, output)| {
        let row = |order| sum_of_modes(model, &modes, &places, number, order);
        let mut readout = match (output.quantity, &model.real_pole) {
            (Quantity::Position, _) => Output::new(&output.column, row(0)),
            // The rate of a row is to it what an acceleration is to a velocity.
            (_, Some(_)) => Output::acceleration(&output.column, &row(0).state, &system, &points),
            (Quantity::Velocity, None) => Output::new(&output.column, row(1)),
            (Quantity::Acceleration, None) => {
                Output::acceleration(&output.column, &row(1).state, &system, &points)
            }
        };
        add_beside(&mut readout.row, model, &places, number, output.quantity);
        add_feedthrough(&mut readout, model.beside.feedthrough_of(number), gain, &points);
        readout
    });
    let outputs = outputs.collect();
    StateSpace::assemble(system, vec![0.0; size], outputs, points)
}

/// Where the parts of a modal model that a force drives stand in its state, behind the modes' pairs.
pub(super) struct Places {
    /// Of a free motion's displacement; its velocity follows.
    pub(super) rigid: Option<usize>,
    /// Of the first lag, or of the real pole.
    lags: usize,
    /// Of the driving point's displacement, where no state has it.
    pub(super) integral: Option<usize>,
    pub(super) order: usize,
}

impl Places {
    fn of(model: &ModalModel, modes: usize) -> Self {
        let rigid = model.beside.rigid.is_some().then_some(2 * modes);
        let lags = 2 * modes + if rigid.is_some() { 2 } else { 0 };
        let end = lags + model.beside.lags.len() + usize::from(model.real_pole.is_some());
        let integral = driving_point::is_integrated(model).then_some(end);
        Self { rigid, lags, integral, order: end + usize::from(integral.is_some()) }
    }
}

/// A coordinate whose displacement stands at `place` and whose velocity follows.
fn coordinate(name: String, place: usize, size: usize, unit: &str, stiffness: f64) -> InjectionPoint {
    let only = |place: usize| {
        let mut row = Row::zero(size);
        row.state[place] = 1.0;
        row
    };
    InjectionPoint {
        name,
        displacement: only(place),
        velocity: only(place + 1),
        force: only(place + 1).state,
        displacement_unit: unit.to_owned(),
        force_unit: format!("{unit}/s²"),
        stiffness,
        is_coordinate: true,
    }
}

/// An output's sum of the modes' coordinates (`order` 0) or of their rates (1); the position of modes beside
/// a real pole.
pub(super) fn sum_of_modes(
    model: &ModalModel,
    modes: &[Mode],
    places: &Places,
    output: usize,
    order: usize,
) -> Row {
    let of = |list: &[f64]| list.get(output).copied().unwrap_or(0.0);
    let mut row = Row::zero(places.order);
    for (index, mode) in modes.iter().enumerate() {
        row.state[2 * index + order] = participation(mode, output);
    }
    if let Some(real) = &model.real_pole {
        // A further mode, of the left-out physics, has no rate.
        for (index, rate) in real.rate_participation.iter().enumerate() {
            row.state[2 * index + 1] = of(rate);
        }
        row.state[places.lags] = of(&real.participation);
    }
    row
}

/// Adds to a row what an output of that quantity has of the states beside its modes in phase.
pub(super) fn add_beside(
    row: &mut Row,
    model: &ModalModel,
    places: &Places,
    number: usize,
    quantity: Quantity,
) {
    let beside = &model.beside;
    let of = |list: &[f64]| list.get(number).copied().unwrap_or(0.0);
    let quarter = usize::from(quantity != Quantity::Velocity);
    for index in 0..model.modes.len() {
        row.state[2 * index + quarter] += beside.quadrature_of(index, number);
    }
    if let (Some(rigid), Some(place)) = (&beside.rigid, places.rigid) {
        row.state[place] += of(&rigid.displacement);
        row.state[place + 1] += of(&rigid.velocity);
    }
    for (place, lag) in (places.lags..).zip(&beside.lags) {
        row.state[place] += of(&lag.participation);
    }
}

/// Adds to an output what it has of the input at once.
fn add_feedthrough(output: &mut Output, through: f64, gain: f64, points: &[InjectionPoint]) {
    output.row.value += gain * through;
    // A force at the driving point is to the structure what the input's is.
    let point = points.iter().position(|point| point.name == DRIVING_POINT);
    if let Some(point) = point.filter(|_| through != 0.0) {
        output.feedthrough.resize(points.len(), 0.0);
        output.feedthrough[point] += through;
    }
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
