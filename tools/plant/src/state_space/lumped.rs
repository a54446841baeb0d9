//! Bodies, springs and dampers as a state space.

use nalgebra::{DMatrix, DVector};

use super::{InjectionPoint, Output, Row, StateSpace};
use crate::linear::LinearSystem;
use crate::model::{Connection, GROUND, LumpedModel, Quantity};

/// Where a body stands in the state, or that it is moved by the input, or that it is the ground.
#[derive(Clone, Copy, PartialEq)]
enum Body {
    Ground,
    Moved,
    Free(usize),
}

/// State: displacements of the free bodies, in file order, then their velocities.
pub(super) fn of_lumped(model: &LumpedModel) -> StateSpace {
    let moved = model.input.as_ref().filter(|input| input.moves_body).map(|input| input.body.as_str());
    let free: Vec<_> = model.bodies.iter().filter(|body| moved != Some(body.name.as_str())).collect();
    let count = free.len();
    let body = |name: &str| match free.iter().position(|body| body.name == name) {
        Some(index) => Body::Free(index),
        None if moved == Some(name) => Body::Moved,
        None => Body::Ground,
    };
    let displacement = |body: Body| {
        let mut row = Row::zero(2 * count);
        match body {
            Body::Ground => {}
            Body::Moved => row.value = 1.0,
            Body::Free(index) => row.state[index] = 1.0,
        }
        row
    };
    let velocity = |body: Body| {
        let mut row = Row::zero(2 * count);
        match body {
            Body::Ground => {}
            Body::Moved => row.slope = 1.0,
            Body::Free(index) => row.state[count + index] = 1.0,
        }
        row
    };
    // A unit force on `a`, its reaction on `b`.
    let force = |a: Body, b: Body| {
        let mut column = vec![0.0; 2 * count];
        for (body, sign) in [(a, 1.0), (b, -1.0)] {
            if let Body::Free(index) = body {
                column[count + index] += sign / free[index].mass;
            }
        }
        column
    };
    let mut system = LinearSystem {
        a: DMatrix::zeros(2 * count, 2 * count),
        value: vec![0.0; 2 * count],
        slope: vec![0.0; 2 * count],
    };
    for index in 0..count {
        system.a[(index, count + index)] = 1.0;
    }
    let mut connect = |connection: &Connection, row: &dyn Fn(Body) -> Row| {
        let [a, b] = [&connection.between[0], &connection.between[1]].map(|name| body(name));
        let column = force(a, b);
        let mut relative = row(a);
        relative.add(-1.0, &row(b));
        for (place, entry) in column.iter().enumerate() {
            let factor = -connection.constant * entry;
            system.value[place] += factor * relative.value;
            system.slope[place] += factor * relative.slope;
            for (other, coefficient) in relative.state.iter().enumerate() {
                system.a[(place, other)] += factor * coefficient;
            }
        }
    };
    model.springs.iter().for_each(|spring| connect(spring, &displacement));
    model.dampers.iter().for_each(|damper| connect(damper, &velocity));
    if let Some(input) = model.input.as_ref().filter(|input| !input.moves_body) {
        for (entry, share) in system.value.iter_mut().zip(force(body(&input.body), Body::Ground)) {
            *entry += input.signal.gain * share;
        }
    }
    let unit = model.displacement_unit();
    let point = |name: String, a: Body, b: Body, stiffness: f64| {
        let (mut z, mut v) = (displacement(a), velocity(a));
        z.add(-1.0, &displacement(b));
        v.add(-1.0, &velocity(b));
        InjectionPoint {
            name,
            displacement: z,
            velocity: v,
            force: force(a, b),
            displacement_unit: unit.clone(),
            force_unit: model.force_unit(),
            stiffness,
            is_coordinate: b == Body::Ground,
        }
    };
    let mut points: Vec<InjectionPoint> = Vec::new();
    for each in &free {
        let stiffness = model.stiffness_between(&each.name, GROUND);
        points.push(point(each.name.clone(), body(&each.name), Body::Ground, stiffness));
    }
    for (index, first) in model.bodies.iter().enumerate() {
        for second in &model.bodies[index + 1..] {
            let name = format!("{}-{}", first.name, second.name);
            let stiffness = model.stiffness_between(&first.name, &second.name);
            points.push(point(name, body(&first.name), body(&second.name), stiffness));
        }
    }
    let outputs = model.outputs.iter().map(|output| {
        let against = output.relative_to.as_deref().map_or(Body::Ground, &body);
        let relative = |row: &dyn Fn(Body) -> Row| {
            let mut relative = row(body(&output.body));
            relative.add(-1.0, &row(against));
            relative
        };
        match output.quantity {
            Quantity::Position => Output::new(&output.column, relative(&displacement)),
            Quantity::Velocity => Output::new(&output.column, relative(&velocity)),
            Quantity::Acceleration => {
                Output::acceleration(&output.column, &relative(&velocity).state, &system, &points)
            }
        }
    });
    let outputs = outputs.collect();
    // A moved body carries what hangs on it along: at rest every free body has moved as far, if nothing else
    // holds it. What the ground holds is found from the balance of the springs.
    let rest = if moved.is_some() { rest_state(&system, count) } else { vec![0.0; 2 * count] };
    StateSpace::assemble(system, rest, outputs, points)
}

/// Displacements at which a unit of a motion input, standing still, leaves every body at rest.
///
/// Bodies that no spring holds may rest anywhere; they are taken to have stayed at zero.
fn rest_state(system: &LinearSystem, count: usize) -> Vec<f64> {
    let stiffness = -system.a.view((count, 0), (count, count));
    let load = DVector::from_iterator(count, system.value[count..].iter().copied());
    let solved = stiffness.svd(true, true).solve(&load, 1e-12).unwrap_or_else(|_| DVector::zeros(count));
    solved.iter().copied().chain(std::iter::repeat_n(0.0, count)).collect()
}
