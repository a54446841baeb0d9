//! A beam on a base as a state space: base free under force, and base prescribed.

use nalgebra::DMatrix;

use super::{BaseMotion, InjectionPoint, Output, Row, StateSpace, drive_for};
use crate::drive::ServoDrive;
use crate::error::PlantError;
use crate::linear::LinearSystem;
use crate::model::{BeamOnBase, BeamSignal};
use crate::modes::{Mode, clamped_modes, coupled_modes, moved_mass_kg};

/// The beam as its input drives it.
pub(super) fn of_beam(model: &BeamOnBase, extra: &[Mode]) -> Result<StateSpace, PlantError> {
    let Some(input) = &model.input else {
        return of_forced_beam(model, extra, 0.0);
    };
    if !input.is_motion() {
        return of_forced_beam(model, extra, input.gain);
    }
    of_moved_beam(model, extra, drive_for(&input.column, model.drive.as_ref()))
}

/// The beam on a base that nobody moves.
pub(super) fn of_held_beam(model: &BeamOnBase, extra: &[Mode]) -> Result<StateSpace, PlantError> {
    of_moved_beam(model, extra, None)
}

fn of_moved_beam(
    model: &BeamOnBase,
    extra: &[Mode],
    drive: Option<&ServoDrive>,
) -> Result<StateSpace, PlantError> {
    let clamped = clamped_modes(model)?;
    let mut modes: Vec<Mode> = clamped.iter().map(|mode| mode.to_mode()).collect();
    modes.extend_from_slice(extra);
    let motion = BaseMotion::new(&modes, drive);
    let participations = || modes.iter().map(|mode| mode.participation.first().copied().unwrap_or(0.0));
    let (deflection, deflection_rate) = motion.sum(participations());
    let (base, base_rate) = (motion.base_position(), motion.base_velocity());
    let outputs = model
        .outputs
        .iter()
        .map(|&signal| Output::new(signal.column(), signal_row(signal, &base, &deflection)));
    let outputs: Vec<Output> = outputs.collect();
    let mut points = motion.points(&modes, Some(moved_mass_kg(model)?), "m");
    // A force at the tip in coordinates scaled to the base's motion; further modes have no known shape there.
    let tip_force = motion.modal_force(clamped.iter().map(|mode| {
        // A mode that the base cannot move is not in these coordinates.
        let per_coordinate = mode.tip / mode.coupling;
        if per_coordinate.is_finite() { per_coordinate } else { 0.0 }
    }));
    points.extend(tip_points([base, base_rate], [deflection, deflection_rate], [&tip_force, &tip_force]));
    Ok(motion.into_space(outputs, points))
}

fn of_forced_beam(model: &BeamOnBase, extra: &[Mode], gain: f64) -> Result<StateSpace, PlantError> {
    let coupled = coupled_modes(model)?;
    let count = coupled.omega_rad_s.len();
    let all = count + extra.len();
    let mut a = DMatrix::zeros(2 * all, 2 * all);
    let mut value = vec![0.0; 2 * all];
    for row in 0..count {
        a[(row, all + row)] = 1.0;
        a[(all + row, row)] = -coupled.omega_rad_s[row].powi(2);
        value[all + row] = gain * coupled.base[row];
    }
    a.view_mut((all, all), (count, count)).copy_from(&(-&coupled.damping_per_s));
    let mut deflections = coupled.tip_deflection.clone();
    let mut bases = coupled.base.clone();
    for (row, mode) in (count..).zip(extra) {
        a[(row, all + row)] = 1.0;
        a[(all + row, row)] = -mode.omega_rad_s().powi(2);
        a[(all + row, all + row)] = -2.0 * mode.decay_per_s();
        value[all + row] = gain;
        deflections.push(mode.participation.first().copied().unwrap_or(0.0));
        bases.push(0.0);
    }
    let place = |factors: &[f64], offset: usize| {
        let mut row = Row::zero(2 * all);
        row.state[offset..offset + factors.len()].copy_from_slice(factors);
        row
    };
    // Work-conjugate: a force reads the same shape that the displacement does.
    let force = |factors: &[f64]| place(factors, all).state;
    let (base, base_rate) = (place(&bases, 0), place(&bases, all));
    let (deflection, deflection_rate) = (place(&deflections, 0), place(&deflections, all));
    let outputs = model
        .outputs
        .iter()
        .map(|&signal| Output::new(signal.column(), signal_row(signal, &base, &deflection)));
    let outputs = outputs.collect();
    let mut points = vec![InjectionPoint {
        name: "base".to_owned(),
        displacement: base.clone(),
        velocity: base_rate.clone(),
        force: force(&bases),
        displacement_unit: "m".to_owned(),
        force_unit: "N".to_owned(),
        stiffness: 0.0,
        is_coordinate: true,
    }];
    for coordinate in 1..all {
        let mut unit = vec![0.0; all];
        unit[coordinate] = 1.0;
        let omega_rad_s = coupled.omega_rad_s.get(coordinate).copied();
        let omega_rad_s = omega_rad_s.or_else(|| Some(extra.get(coordinate - count)?.omega_rad_s()));
        points.push(InjectionPoint {
            name: format!("mode {coordinate}"),
            displacement: place(&unit, 0),
            velocity: place(&unit, all),
            force: force(&unit),
            displacement_unit: "m·√kg".to_owned(),
            force_unit: "m·√kg/s²".to_owned(),
            stiffness: omega_rad_s.unwrap_or(0.0).powi(2),
            is_coordinate: true,
        });
    }
    // A further mode has no known shape at the tip, so tip forces do not reach it.
    let relative = force(&coupled.tip_deflection);
    let absolute: Vec<f64> = coupled.tip_deflection.iter().zip(&coupled.base).map(|(w, y)| w + y).collect();
    let forces = [&relative, &force(&absolute)];
    points.extend(tip_points([base, base_rate], [deflection, deflection_rate], forces));
    let system = LinearSystem { a, slope: vec![0.0; value.len()], value };
    Ok(StateSpace::assemble(system, vec![0.0; 2 * all], outputs, points))
}

fn signal_row(signal: BeamSignal, base: &Row, deflection: &Row) -> Row {
    match signal {
        BeamSignal::TipDeflection => deflection.clone(),
        BeamSignal::BasePosition => base.clone(),
        BeamSignal::TipPosition => {
            let mut row = base.clone();
            row.add(1.0, deflection);
            row
        }
    }
}

/// `beam` and `tip`: the tip against its base, and against the ground.
fn tip_points(base: [Row; 2], deflection: [Row; 2], forces: [&Vec<f64>; 2]) -> [InjectionPoint; 2] {
    let absolute = [0, 1].map(|index| {
        let mut row = base[index].clone();
        row.add(1.0, &deflection[index]);
        row
    });
    let point = |name: &str, [displacement, velocity]: [Row; 2], force: &[f64]| InjectionPoint {
        name: name.to_owned(),
        displacement,
        velocity,
        force: force.to_vec(),
        displacement_unit: "m".to_owned(),
        force_unit: "N".to_owned(),
        stiffness: 0.0,
        is_coordinate: false,
    };
    [point("beam", deflection, forces[0]), point("tip", absolute, forces[1])]
}
