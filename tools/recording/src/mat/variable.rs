//! Variables: matrices, structures, and what is only named.

use super::element::{Element, Elements, INT8, INT32, MATRIX, UINT32, numbers};
use super::error::MatProblem;
use crate::recording::shorten;

/// Structures may lie this deep in each other.
const MAX_DEPTH: usize = 16;
/// Numbers that are taken into memory, over all variables: 512 MiB.
const MAX_NUMBERS: usize = 1 << 26;
/// Complex flag of the array flags.
const COMPLEX: u64 = 0x0800;

/// A variable of a MAT-file, or a field of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, with the structure's in front: `run1.y`.
    pub name: String,
    /// What it holds.
    pub value: Value,
}

/// What a variable of a MAT-file holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A real matrix.
    Matrix {
        /// Number of rows.
        rows: usize,
        /// Number of columns.
        columns: usize,
        /// `rows` times `columns` numbers, column after column.
        numbers: Vec<f64>,
    },
    /// Anything else, and what it is: a text, an object, complex numbers.
    Other(String),
}

impl Variable {
    /// What it is, for messages.
    pub(super) fn description(&self) -> String {
        match &self.value {
            Value::Matrix { rows, columns, .. } => format!("{rows} x {columns}"),
            Value::Other(what) => what.clone(),
        }
    }
}

/// Collects variables out of matrix elements.
pub(super) struct Reader {
    pub(super) variables: Vec<Variable>,
    budget: usize,
}

impl Reader {
    pub(super) fn new() -> Self {
        Self { variables: Vec::new(), budget: MAX_NUMBERS }
    }

    /// Reads one matrix element; `prefix` is the structure it is a field of, with the field's name.
    pub(super) fn matrix(
        &mut self,
        elements: &Elements<'_>,
        element: Element<'_>,
        field: Option<String>,
        depth: usize,
    ) -> Result<(), MatProblem> {
        if depth > MAX_DEPTH {
            return Err(MatProblem::TooDeep { offset: element.offset, limit: MAX_DEPTH });
        }
        if element.data.is_empty() {
            // An empty matrix may be a tag and nothing else.
            return Ok(());
        }
        let mut parts = elements.within(element);
        let little_endian = parts.little_endian;
        let flags = parts.expect(UINT32, "array's flags")?;
        let flags = super::element::integer(flags.data, 0, 4, little_endian).unwrap_or(0);
        let class = flags & 0xff;
        // Objects have their own layout.
        if class == 17 {
            self.other(field.unwrap_or_else(|| "an object".to_owned()), "an object, saved as itself");
            return Ok(());
        }
        let dimensions = parts.expect(INT32, "array's dimensions")?;
        let dimensions: Vec<usize> = numbers(dimensions, little_endian)
            .unwrap_or_default()
            .into_iter()
            .map(|size| size.max(0.0) as usize)
            .collect();
        let own_name = parts.expect(INT8, "array's name")?;
        let own_name = shorten(&String::from_utf8_lossy(own_name.data));
        let name = field.unwrap_or(own_name);
        let size = dimensions.iter().try_fold(1_usize, |size, d| size.checked_mul(*d));
        let shape = dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
        match (class, dimensions.as_slice()) {
            (2, _) if size == Some(1) => self.structure(parts, &name, depth)?,
            (6..=15, [rows, columns]) if flags & COMPLEX == 0 => {
                self.numeric(parts, name, *rows, *columns, size)?;
            }
            (1, _) => self.other(name, &format!("{shape} cell array")),
            (2, _) => self.other(name, &format!("{shape} structure array")),
            (4, _) => self.other(name, &format!("{shape} text")),
            (5, _) => self.other(name, &format!("{shape} sparse")),
            (6..=15, [_, _]) => self.other(name, &format!("{shape} complex")),
            (6..=15, _) => self.other(name, &format!("{shape} array")),
            (other, _) => self.other(name, &format!("of class {other}")),
        }
        Ok(())
    }

    fn other(&mut self, name: String, what: &str) {
        self.variables.push(Variable { name, value: Value::Other(what.to_owned()) });
    }

    fn numeric(
        &mut self,
        mut parts: Elements<'_>,
        name: String,
        rows: usize,
        columns: usize,
        size: Option<usize>,
    ) -> Result<(), MatProblem> {
        let offset = parts.offset();
        let element = match parts.next()? {
            Some(element) => element,
            None if size == Some(0) => return Ok(()),
            None => parts.expect(UINT32, "matrix's numbers")?,
        };
        let too_large = MatProblem::TooLarge { limit_mib: (MAX_NUMBERS * 8) >> 20 };
        // Every number takes a byte at least.
        self.budget =
            self.budget.checked_sub(element.data.len().min(size.unwrap_or(usize::MAX))).ok_or(too_large)?;
        let what = "matrix's numbers";
        let numbers = numbers(element, parts.little_endian).ok_or_else(|| MatProblem::Element {
            offset,
            what,
            found: format!("an element of type {}", element.kind),
        })?;
        if size != Some(numbers.len()) {
            let found = format!("{} for a {rows} x {columns} matrix", numbers.len());
            return Err(MatProblem::Element { offset, what, found });
        }
        self.variables.push(Variable { name, value: Value::Matrix { rows, columns, numbers } });
        Ok(())
    }

    fn structure(&mut self, mut parts: Elements<'_>, name: &str, depth: usize) -> Result<(), MatProblem> {
        let length = parts.expect(INT32, "length of the structure's field names")?;
        let length = super::element::integer(length.data, 0, length.data.len().min(4), parts.little_endian);
        let offset = parts.offset();
        let names = parts.expect(INT8, "structure's field names")?;
        let length = length.and_then(|length| usize::try_from(length).ok()).filter(|length| *length > 0);
        let Some(length) = length else {
            let found = "empty or of length 0".to_owned();
            return Err(MatProblem::Element { offset, what: "structure's field names", found });
        };
        for field in names.data.chunks(length) {
            let field = field.split(|byte| *byte == 0).next().unwrap_or_default();
            let field = shorten(&String::from_utf8_lossy(field));
            let element = parts.expect(MATRIX, "structure's field")?;
            self.matrix(&parts, element, Some(format!("{name}.{field}")), depth + 1)?;
        }
        Ok(())
    }
}
