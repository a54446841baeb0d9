//! MATLAB's MAT-files of level 5, plain (`-v6`) and compressed (`-v7`), and of level 4: numeric vectors and
//! matrices, also in structures.
//!
//! Conventions: the time is a variable `time_s`, or a scalar `interval_s` or `rate_hz`; a variable whose name
//! ends in a unit is a column of that name, and a matrix is one column per signal (`accel_m_s2` with three
//! columns gives `accel_1_m_s2` and so on). Everything else is chosen by the options.

mod columns;
mod element;
mod error;
mod level_4;
mod matrices;
mod variable;

pub use error::MatProblem;
pub use matrices::read_mat_variables;

pub(crate) use level_4::is_level_4;
pub use variable::{Value, Variable};

use std::io::Read;

use flate2::read::ZlibDecoder;

use crate::csv_reader::Parsed;
use crate::error::Problem;
use crate::options::ReadOptions;
use element::{COMPRESSED, Elements, MATRIX};
use variable::Reader;

/// Length of the header.
const HEADER: usize = 128;
/// Uncompressed bytes that are taken into memory, over all variables.
const MAX_INFLATED: usize = 512 << 20;
const FILE: &str = "the file";
const VARIABLE: &str = "the compressed variable";

/// Reads the signals of a MAT-file.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Parsed, Problem> {
    if is_level_4(bytes) {
        return columns::parsed(&level_4::variables(bytes)?, options);
    }
    columns::parsed(&variables(bytes, MAX_INFLATED)?, options)
}

/// Time and columns of variables that another reader found.
pub(crate) fn of_variables(variables: &[Variable], options: &ReadOptions) -> Result<Parsed, Problem> {
    columns::parsed(variables, options)
}

fn variables(bytes: &[u8], max_inflated: usize) -> Result<Vec<Variable>, MatProblem> {
    let little_endian = match bytes.get(126..HEADER) {
        Some(b"IM") => true,
        Some(b"MI") => false,
        Some(other) => {
            let found = format!("{other:02x?}, not `IM` or `MI`");
            return Err(MatProblem::Element { offset: 126, what: "byte order", found });
        }
        None => return Err(MatProblem::Ends { offset: 0, what: "the header", container: FILE }),
    };
    let mut elements = Elements::new(bytes.get(HEADER..).unwrap_or(&[]), HEADER, little_endian, FILE);
    let mut reader = Reader::new();
    let mut budget = max_inflated;
    while let Some(element) = elements.next()? {
        match element.kind {
            MATRIX => reader.matrix(&elements, element, None, 0)?,
            COMPRESSED => {
                let inflated = inflate(element.data, element.offset, budget, max_inflated)?;
                budget -= inflated.len();
                let mut within = Elements::new(&inflated, 0, little_endian, VARIABLE);
                let inner = within.expect(MATRIX, "compressed variable")?;
                reader.matrix(&within, inner, None, 0)?;
            }
            // MATLAB's own bookkeeping.
            _ => {}
        }
    }
    Ok(reader.variables)
}

/// Uncompresses at most `budget` bytes.
fn inflate(data: &[u8], offset: usize, budget: usize, limit: usize) -> Result<Vec<u8>, MatProblem> {
    let mut inflated = Vec::new();
    let mut source = ZlibDecoder::new(data).take(budget as u64 + 1);
    source
        .read_to_end(&mut inflated)
        .map_err(|error| MatProblem::Compressed { offset, reason: error.to_string() })?;
    if inflated.len() > budget {
        return Err(MatProblem::TooLarge { limit_mib: limit >> 20 });
    }
    Ok(inflated)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_bomb_is_refused_at_the_limit_and_not_beyond_it() {
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(&vec![0; 4 << 20]).unwrap();
        let bomb = encoder.finish().unwrap();
        assert!(bomb.len() < 10_000);
        assert!(matches!(inflate(&bomb, 0, 1 << 20, 1 << 20), Err(MatProblem::TooLarge { limit_mib: 1 })));
        assert_eq!(inflate(&bomb, 0, 4 << 20, 4 << 20).unwrap().len(), 4 << 20);
    }
}
