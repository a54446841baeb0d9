//! MAT-files of level 4, as old programs and `save -v4` write them: one header and the numbers per matrix.

use super::element::integer;
use super::error::MatProblem;
use super::variable::{Value, Variable};

/// Bytes of a matrix's header.
const HEADER: usize = 20;
/// A name is shorter than this, its end included.
const LONGEST_NAME: usize = 64;

/// The header of a matrix.
struct Header {
    little_endian: bool,
    /// Bytes of a number, and how it is stored.
    precision: u64,
    text: bool,
    rows: usize,
    columns: usize,
    complex: bool,
    name_length: usize,
}

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        [true, false].into_iter().find_map(|little_endian| {
            let word = |at| integer(bytes, at, 4, little_endian);
            let kind = word(0)?;
            // The type's digits: machine, zero, precision, matrix or text.
            let (machine, zero, precision, form) = (kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10);
            let name_length = usize::try_from(word(16)?).ok()?;
            let (rows, columns) = (usize::try_from(word(4)?).ok()?, usize::try_from(word(8)?).ok()?);
            let fits = machine == u64::from(!little_endian)
                && zero == 0
                && precision <= 5
                && form <= 2
                && word(12)? <= 1
                && (2..=LONGEST_NAME).contains(&name_length)
                && rows < 1 << 31
                && columns < 1 << 31;
            let complex = word(12)? == 1;
            fits.then_some(Self {
                little_endian,
                precision,
                text: form != 0,
                rows,
                columns,
                complex,
                name_length,
            })
        })
    }

    fn width(&self) -> usize {
        match self.precision {
            0 => 8,
            1 | 2 => 4,
            3 | 4 => 2,
            _ => 1,
        }
    }

    fn number(&self, bytes: &[u8]) -> f64 {
        let bits = integer(bytes, 0, bytes.len(), self.little_endian).unwrap_or(0);
        match self.precision {
            0 => f64::from_bits(bits),
            1 => f64::from(f32::from_bits(bits as u32)),
            2 => f64::from(bits as u32 as i32),
            3 => f64::from(bits as u16 as i16),
            _ => bits as f64,
        }
    }
}

/// Whether bytes begin as such a file: a plausible header and a name.
pub(crate) fn is_level_4(bytes: &[u8]) -> bool {
    let Some(header) = Header::read(bytes) else { return false };
    let name = bytes.get(HEADER..HEADER + header.name_length).unwrap_or(&[]);
    let Some((end, letters)) = name.split_last() else { return false };
    *end == 0
        && letters.first().is_some_and(u8::is_ascii_alphabetic)
        && letters.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
}

/// The variables of the file.
pub(super) fn variables(bytes: &[u8]) -> Result<Vec<Variable>, MatProblem> {
    let mut variables = Vec::new();
    let mut at = 0;
    let ends = |offset, what| MatProblem::Ends { offset, what, container: super::FILE };
    while at < bytes.len() {
        let rest = bytes.get(at..).unwrap_or(&[]);
        let header = Header::read(rest).ok_or_else(|| ends(at, "a matrix's header"))?;
        let name = rest.get(HEADER..HEADER + header.name_length).ok_or_else(|| ends(at, "a name"))?;
        let name: String = name.iter().take_while(|byte| **byte != 0).map(|byte| char::from(*byte)).collect();
        let count = header.rows.checked_mul(header.columns);
        let parts = if header.complex { 2 } else { 1 };
        let size = count.and_then(|count| count.checked_mul(header.width() * parts));
        let start = HEADER + header.name_length;
        let data = size
            .and_then(|size| rest.get(start..start.checked_add(size)?))
            .ok_or_else(|| ends(at, "a matrix"))?;
        let Header { rows, columns, .. } = header;
        let value = if header.text || header.complex {
            Value::Other(format!("{rows} x {columns} {}", if header.text { "text" } else { "complex" }))
        } else {
            let numbers = data.chunks_exact(header.width()).map(|bytes| header.number(bytes));
            Value::Matrix { rows, columns, numbers: numbers.collect() }
        };
        variables.push(Variable { name, value });
        at += start + data.len();
    }
    Ok(variables)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(name: &str, kind: u32, rows: u32, columns: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for word in [kind, rows, columns, 0, name.len() as u32 + 1] {
            bytes.extend(if kind >= 1000 { word.to_be_bytes() } else { word.to_le_bytes() });
        }
        bytes.extend(name.as_bytes());
        bytes.push(0);
        bytes.extend(data);
        bytes
    }

    #[test]
    fn matrices_of_every_precision_and_byte_order_are_read() {
        let values = [1.0_f64, -2.0, 3.0, 4.0];
        let f8: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let f8_big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
        let f4: Vec<u8> = values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        let i2: Vec<u8> = values.iter().flat_map(|v| (*v as i16).to_le_bytes()).collect();
        let file = [
            matrix("a_m", 0, 4, 1, &f8),
            matrix("b_m", 10, 1, 4, &f4),
            matrix("c_m", 30, 2, 2, &i2),
            matrix("note", 51, 1, 2, b"hi"),
        ]
        .concat();
        assert!(is_level_4(&file) && is_level_4(&matrix("x", 1000, 4, 1, &f8_big)));
        let found = variables(&file).unwrap();
        assert_eq!(found.len(), 4);
        for variable in &found[..3] {
            assert!(
                matches!(&variable.value, Value::Matrix { numbers, .. } if *numbers == values),
                "{variable:?}"
            );
        }
        let big = variables(&matrix("x", 1000, 4, 1, &f8_big)).unwrap();
        assert!(matches!(&big[0].value, Value::Matrix { numbers, .. } if *numbers == values));
        assert!(variables(&file[..file.len() - 1]).is_err());
        for text in [b"time_s,a_m\n0,1\n1,2\n3,4\n".as_slice(), b"\x00\x00\x00\x00", &[0; 64]] {
            assert!(!is_level_4(text));
        }
    }
}
