//! `kind = "state_space"` as it stands in a file: matrices or a transfer function, which become modes when
//! they are read.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{DMatrix, DVector};
use serde::Deserialize;
use toml::Value;

use super::matrix_values::{LETTERS, Letters, letters_of_file, matrix_of, refused, rows_of};
use super::setup::{ControllerTable, InitialTable, PhysicsTable, SensorTable, SetupTables};
use super::signals::{DriveTable, InputTable, QuantityName};
use crate::matrices::{
    IN_PHASE, IN_PHASE_OF_POLYNOMIALS, MOST_STATES, Matrices, Polynomials, continuous, modal_form,
    of_polynomials,
};
use crate::model::{
    Input, InvalidParameter, MatricesProblem, ModalModel, ModalOutput, Problem, Quantity, positive,
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    #[serde(rename = "schema")]
    _schema: i64,
    #[serde(rename = "kind")]
    _kind: String,
    #[serde(rename = "A")]
    a: Option<Value>,
    #[serde(rename = "B")]
    b: Option<Value>,
    #[serde(rename = "C")]
    c: Option<Value>,
    #[serde(rename = "D")]
    d: Option<Value>,
    file: Option<String>,
    #[serde(default)]
    variables: BTreeMap<String, String>,
    numerator: Option<Value>,
    denominator: Option<Value>,
    sample_s: Option<f64>,
    input_number: Option<i64>,
    drive: Option<DriveTable>,
    input: Option<InputTable>,
    #[serde(default)]
    output: Vec<OutputTable>,
    #[serde(default)]
    fixed: BTreeMap<String, bool>,
    controller: Option<ControllerTable>,
    #[serde(default)]
    initial: BTreeMap<String, InitialTable>,
    #[serde(default)]
    sensor: Vec<SensorTable>,
    #[serde(default)]
    physics: Vec<PhysicsTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    column: String,
    #[serde(default)]
    quantity: QuantityName,
    number: Option<i64>,
    #[serde(default)]
    driving_point: bool,
}

impl File {
    /// The modes of the system; `folder` is where the model file lies.
    pub(super) fn into_model(self, folder: &Path) -> Result<ModalModel, InvalidParameter> {
        let mut system = self.system(folder)?;
        if let Some(sample_s) = self.sample_s {
            positive("sample_s", sample_s)?;
            system = continuous(&system, sample_s).map_err(|problem| refused("A", problem))?;
        }
        let quantities: Vec<Quantity> = self.output.iter().map(|output| output.quantity.into()).collect();
        let (key, in_phase) = match self.denominator {
            Some(_) => ("denominator", IN_PHASE_OF_POLYNOMIALS),
            None => ("A", IN_PHASE),
        };
        let form = modal_form(&system, &quantities, in_phase).map_err(|problem| refused(key, problem))?;
        let mut input: Option<Input> = self.input.map(Into::into);
        if let Some(input) = &mut input {
            if input.is_motion() {
                let column = input.column.clone();
                return Err(refused("input.column", MatricesProblem::MotionInput { column }));
            }
            // Sampled matrices say what the input does between its samples.
            if self.sample_s.is_some() {
                input.hold.get_or_insert(crate::simulate::Hold::ZeroOrder);
            }
        }
        let driving = self.output.iter().find(|output| output.driving_point);
        let setup = SetupTables {
            controller: self.controller,
            initial: self.initial,
            sensor: self.sensor,
            physics: self.physics,
        };
        Ok(ModalModel {
            modes: form.modes,
            real_pole: None,
            beside: form.beside,
            driving_point: driving.map(|output| output.column.clone()),
            drive: self.drive.as_ref().and_then(DriveTable::servo),
            input,
            outputs: self
                .output
                .iter()
                .map(|output| ModalOutput { column: output.column.clone(), quantity: output.quantity.into() })
                .collect(),
            fixed: self.fixed,
            setup: setup.into_setup(self.drive.as_ref()),
        })
    }

    /// The one input and the outputs of the file, of whatever the system is given as.
    fn system(&self, folder: &Path) -> Result<Matrices, InvalidParameter> {
        let values = [&self.a, &self.b, &self.c, &self.d];
        let is_inline = values.iter().any(|value| value.is_some());
        let is_function = self.numerator.is_some() || self.denominator.is_some();
        let ways = [is_inline, self.file.is_some(), is_function].into_iter().filter(|way| *way).count();
        if ways != 1 {
            let key = if is_inline {
                "A"
            } else if is_function {
                "numerator"
            } else {
                "kind"
            };
            return Err(refused(key, MatricesProblem::Choice));
        }
        if let Some(file) = &self.file {
            return self.chosen(letters_of_file(&folder.join(file), &self.variables)?);
        }
        if is_inline {
            let mut letters = Letters::new();
            for (letter, value) in LETTERS.into_iter().zip(values) {
                if let Some(value) = value {
                    letters.insert(letter, matrix_of(letter, value)?);
                }
            }
            return self.chosen(letters);
        }
        let lists = |key: &str, value: &Option<Value>| match value {
            Some(value) => rows_of(key, value),
            None => Err(InvalidParameter::new(key, Problem::Missing)),
        };
        let numerators = lists("numerator", &self.numerator)?;
        let denominators = lists("denominator", &self.denominator)?;
        for (key, lists) in [("numerator", &numerators), ("denominator", &denominators)] {
            check_finite(key, lists.iter().flatten())?;
        }
        let all = of_polynomials(&Polynomials { numerators, denominators })?;
        self.of_outputs(all)
    }

    /// One input and the outputs of the file out of matrices.
    fn chosen(&self, mut letters: Letters) -> Result<Matrices, InvalidParameter> {
        let mut take = |letter: &str| {
            let matrix = letters.remove(letter);
            matrix.ok_or_else(|| InvalidParameter::new(letter, Problem::Missing))
        };
        let (a, mut b, c) = (take("A")?, take("B")?, take("C")?);
        let size = a.nrows();
        // A list of numbers, the states' shares of the one input.
        if b.nrows() == 1 && b.ncols() == size {
            b = b.transpose();
        }
        let d = take("D").ok().filter(|d| !d.is_empty());
        let d = d.unwrap_or_else(|| DMatrix::zeros(c.nrows(), b.ncols()));
        check_shape("A", &a, (size, size), "square".to_owned())?;
        if size > MOST_STATES {
            return Err(refused("A", MatricesProblem::StateCount { found: size, most: MOST_STATES }));
        }
        check_shape("B", &b, (size, b.ncols().max(1)), format!("{size} x inputs, a row per row of A"))?;
        check_shape(
            "C",
            &c,
            (c.nrows().max(1), size),
            format!("outputs x {size}, a column per column of A"),
        )?;
        let wanted =
            format!("{} x {}, a row per row of C and a column per column of B", c.nrows(), b.ncols());
        check_shape("D", &d, (c.nrows(), b.ncols()), wanted)?;
        for (letter, matrix) in LETTERS.into_iter().zip([&a, &b, &c, &d]) {
            check_finite(letter, matrix.iter())?;
        }
        let inputs = b.ncols();
        let input = match self.input_number {
            None if inputs == 1 => 0,
            None => return Err(refused("B", MatricesProblem::InputChoice { inputs })),
            Some(number) => index_of("input_number", number, inputs)?,
        };
        let (b, d): (DVector<f64>, DVector<f64>) = (b.column(input).into(), d.column(input).into());
        self.of_outputs(Matrices { a, b, c, d })
    }

    /// The rows that the file's outputs are.
    fn of_outputs(&self, all: Matrices) -> Result<Matrices, InvalidParameter> {
        let rows = all.c.nrows();
        let outputs = self.output.len();
        if outputs == 0 {
            return Err(InvalidParameter::new("output", Problem::Missing));
        }
        let numbered = self.output.iter().all(|output| output.number.is_some());
        if outputs != rows && !numbered {
            return Err(refused("output", MatricesProblem::OutputChoice { outputs, rows }));
        }
        let number_of = |(index, output): (usize, &OutputTable)| match output.number {
            Some(number) => index_of(&format!("output.{}.number", index + 1), number, rows),
            None => Ok(index),
        };
        let numbers: Vec<usize> =
            self.output.iter().enumerate().map(number_of).collect::<Result<_, InvalidParameter>>()?;
        Ok(Matrices { c: all.c.select_rows(&numbers), d: all.d.select_rows(&numbers), ..all })
    }
}

/// A number that counts from 1 as an index.
fn index_of(key: &str, number: i64, most: usize) -> Result<usize, InvalidParameter> {
    let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
    let index = index.filter(|index| *index < most);
    index.ok_or_else(|| refused(key, MatricesProblem::Number { found: number, most }))
}

fn check_shape(
    key: &str,
    matrix: &DMatrix<f64>,
    shape: (usize, usize),
    wanted: String,
) -> Result<(), InvalidParameter> {
    let (rows, columns) = matrix.shape();
    if (rows, columns) == shape {
        return Ok(());
    }
    Err(refused(key, MatricesProblem::Shape { rows, columns, wanted }))
}

fn check_finite<'n>(key: &str, numbers: impl IntoIterator<Item = &'n f64>) -> Result<(), InvalidParameter> {
    match numbers.into_iter().find(|number| !number.is_finite()) {
        Some(&value) => Err(InvalidParameter::new(key, Problem::NotFinite { value })),
        None => Ok(()),
    }
}
