//! Matrices as they stand in a file: rows of numbers in TOML, or variables of a MAT-file.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::DMatrix;
use stillbeam_recording::{MatValue, read_mat_variables};
use toml::Value;

use crate::model::{InvalidParameter, MatricesProblem, Problem};

/// The matrices of a system, by letter.
pub(super) type Letters = BTreeMap<&'static str, DMatrix<f64>>;

/// The names of the matrices.
pub(super) const LETTERS: [&str; 4] = ["A", "B", "C", "D"];

pub(super) fn refused(key: impl Into<String>, problem: MatricesProblem) -> InvalidParameter {
    InvalidParameter::new(key, Problem::Matrices(Box::new(problem)))
}

/// Rows of numbers, a matrix without rows as `[]`; a list of numbers is one row, a number alone one of one.
pub(super) fn rows_of(key: &str, value: &Value) -> Result<Vec<Vec<f64>>, InvalidParameter> {
    let not_matrix = |found: &str| refused(key, MatricesProblem::NotMatrix { found: found.to_owned() });
    if let Some(number) = number_of(value) {
        return Ok(vec![vec![number]]);
    }
    let Value::Array(items) = value else { return Err(not_matrix(&format!("a {}", value.type_str()))) };
    if items.iter().all(|item| number_of(item).is_some()) {
        let row: Vec<f64> = items.iter().filter_map(number_of).collect();
        return Ok(if row.is_empty() { Vec::new() } else { vec![row] });
    }
    let row_of = |item: &Value| match item {
        Value::Array(row) => row
            .iter()
            .map(|entry| {
                number_of(entry).ok_or_else(|| not_matrix("a list with something else than numbers"))
            })
            .collect(),
        _ => Err(not_matrix("a list with something else than rows of numbers")),
    };
    items.iter().map(row_of).collect()
}

fn number_of(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

/// A matrix of TOML.
pub(super) fn matrix_of(key: &str, value: &Value) -> Result<DMatrix<f64>, InvalidParameter> {
    let rows = rows_of(key, value)?;
    let columns = rows.first().map_or(0, Vec::len);
    if rows.iter().any(|row| row.len() != columns) {
        let found = "rows of different lengths".to_owned();
        return Err(refused(key, MatricesProblem::NotMatrix { found }));
    }
    Ok(DMatrix::from_row_iterator(rows.len(), columns, rows.into_iter().flatten()))
}

/// The matrices of a MAT-file: variables `A`, `B`, `C` and, where there is one, `D`, or those of the names
/// given.
pub(super) fn letters_of_file(
    path: &Path,
    names: &BTreeMap<String, String>,
) -> Result<Letters, InvalidParameter> {
    if let Some(found) = names.keys().find(|name| !LETTERS.contains(&name.as_str())) {
        return Err(refused("variables", MatricesProblem::Letter { found: found.clone() }));
    }
    let file = path.display().to_string();
    let variables = read_mat_variables(path)
        .map_err(|error| refused("file", MatricesProblem::File { message: error.to_string() }))?;
    let mut letters = Letters::new();
    for letter in LETTERS {
        let given = names.get(letter);
        let variable = given.map_or_else(|| letter.to_owned(), String::clone);
        let key = if given.is_some() { format!("variables.{letter}") } else { "file".to_owned() };
        let Some(found) = variables.iter().find(|found| found.name == variable) else {
            if letter == "D" && given.is_none() {
                continue;
            }
            let present = variables.iter().map(|variable| variable.name.clone()).collect();
            let (file, letter) = (file.clone(), letter.to_owned());
            return Err(refused(key, MatricesProblem::Variable { file, variable, letter, present }));
        };
        match &found.value {
            MatValue::Matrix { rows, columns, numbers } => {
                letters.insert(letter, DMatrix::from_column_slice(*rows, *columns, numbers));
            }
            MatValue::Other(what) => {
                let (file, found) = (file.clone(), what.clone());
                return Err(refused(key, MatricesProblem::VariableKind { file, variable, found }));
            }
        }
    }
    Ok(letters)
}
