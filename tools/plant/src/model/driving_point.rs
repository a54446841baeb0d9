//! The place where the force of a modal model's input acts, known by an output that reads its motion.

use super::invalid::{InvalidParameter, Problem};
use super::modal::ModalModel;
use super::{ModalOutput, Quantity, unit_of};

impl ModalModel {
    /// The output, counted from 0, that moves where the force of the input acts.
    pub(crate) fn driving_output(&self) -> Option<(usize, &ModalOutput)> {
        let column = self.driving_point.as_ref()?;
        self.outputs.iter().enumerate().find(|(_, output)| output.column == *column)
    }

    /// Whether an output is modes in phase and nothing else, so that its integrals are states.
    pub(crate) fn is_in_phase(&self, output: usize) -> bool {
        let is_zero = |list: &[f64]| list.get(output).is_none_or(|share| *share == 0.0);
        self.beside.quadrature.iter().all(|list| is_zero(list))
            && self.beside.lags.iter().all(|lag| is_zero(&lag.participation))
            && self.beside.rigid.as_ref().is_none_or(|rigid| is_zero(&rigid.displacement))
            && is_zero(&self.beside.feedthrough)
    }

    /// Checks that the motion at the driving point follows from its output.
    pub(super) fn check_driving_point(&self) -> Result<(), InvalidParameter> {
        let Some(column) = &self.driving_point else { return Ok(()) };
        let refused = |problem| Err(InvalidParameter::new("output.driving_point", problem));
        let Some((number, output)) = self.driving_output() else {
            let (found, allowed) =
                (column.clone(), self.outputs.iter().map(|output| output.column.clone()).collect());
            return refused(Problem::OutputColumn { found, allowed });
        };
        if self.input.as_ref().is_none_or(super::Input::is_motion) || self.real_pole.is_some() {
            return refused(Problem::DrivingPointInput);
        }
        let has_rigid = self.beside.rigid.is_some();
        let fits = match output.quantity {
            Quantity::Acceleration => self.is_in_phase(number) && !has_rigid,
            _ => self.beside.feedthrough_of(number) == 0.0,
        };
        if fits { Ok(()) } else { refused(Problem::DrivingPointOutput { column: column.clone() }) }
    }

    /// Units of displacement and force there: those of the output and of the input, without their rates.
    pub(crate) fn driving_units(&self) -> (String, String) {
        let output = self.driving_output().map(|(_, output)| unit_of(&output.column)).unwrap_or_default();
        let turns = output.starts_with("rad");
        let length = output.split('_').next().filter(|unit| !unit.is_empty()).unwrap_or("m");
        let input = self.input.as_ref().filter(|input| input.gain == 1.0);
        let force = input.map(|input| unit_of(&input.column)).filter(|unit| !unit.is_empty());
        let force = force.map_or_else(|| if turns { "N·m" } else { "N" }.to_owned(), |unit| spelt(&unit));
        (length.to_owned(), force)
    }
}

/// A unit at the end of a column's name as it is written elsewhere.
fn spelt(unit: &str) -> String {
    match unit {
        "N_m" | "Nm" => "N·m".to_owned(),
        "m_s2" => "m/s²".to_owned(),
        "rad_s2" => "rad/s²".to_owned(),
        other => other.to_owned(),
    }
}
