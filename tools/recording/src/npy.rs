//! NumPy arrays (`.npy`) in.

use thiserror::Error;

use crate::content::Content;
use crate::error::Problem;
use crate::options::ReadOptions;
use crate::recording::shorten;
use crate::table::{Heading, Table, assemble};

/// What the file begins with.
pub(crate) const SIGNATURE: &[u8] = b"\x93NUMPY";

/// Why a NumPy file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpyProblem {
    /// The header is not as the format has it.
    #[error("the header has no {what}; save the array again with numpy.save")]
    Header {
        /// What is missing.
        what: &'static str,
    },
    /// Numbers of another kind.
    #[error("the array's type is `{found}`; save real numbers, with numpy.save(name, array.astype(float))")]
    Type {
        /// The type by the header.
        found: String,
    },
    /// An array of no, or of three and more, dimensions.
    #[error("the array has {dimensions} dimensions; save one column per signal, as an array of two")]
    Shape {
        /// How many there are.
        dimensions: usize,
    },
}

/// Reads an array of one or two dimensions: one column per signal, the longer side being the time.
pub(crate) fn parse(bytes: &[u8], options: &ReadOptions) -> Result<Content, Problem> {
    assemble(read(bytes)?, options)
}

fn read(bytes: &[u8]) -> Result<Table, Problem> {
    let missing = |what| NpyProblem::Header { what };
    let long = bytes.get(6).is_some_and(|version| *version >= 2);
    let length = match (long, bytes.get(8..12)) {
        (false, Some([a, b, ..])) => usize::from(u16::from_le_bytes([*a, *b])),
        (true, Some([a, b, c, d])) => u32::from_le_bytes([*a, *b, *c, *d]) as usize,
        _ => return Err(missing("length").into()),
    };
    let start = if long { 12 } else { 10 };
    let header = bytes.get(start..start + length).ok_or_else(|| missing("end"))?;
    let header = String::from_utf8_lossy(header);
    let after =
        |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start_matches([':', ' ', '\'', '"']));
    let descr = after("'descr'").ok_or_else(|| missing("type"))?;
    let by_columns = after("'fortran_order'").ok_or_else(|| missing("order"))?.starts_with("True");
    let shape = after("'shape'").and_then(|rest| rest.strip_prefix('(')?.split(')').next());
    let shape: Vec<usize> = shape
        .ok_or_else(|| missing("shape"))?
        .split(',')
        .filter_map(|side| side.trim().parse().ok())
        .collect();
    let (rows, columns) = match shape.as_slice() {
        [rows] => (*rows, 1),
        [rows, columns] => (*rows, *columns),
        other => return Err(NpyProblem::Shape { dimensions: other.len() }.into()),
    };
    let data = bytes.get(start + length..).unwrap_or(&[]);
    if descr.starts_with('[') {
        return structured(data, descr, rows.saturating_mul(columns));
    }
    let descr = descr.split(['\'', '"', ',']).next().unwrap_or_default().to_owned();
    let numbers = numbers(data, &descr).ok_or_else(|| NpyProblem::Type { found: shorten(&descr) })?;
    Ok(table(numbers, rows, columns, by_columns))
}

/// An array of records: every field of one number is a column, and so is every place of a field of several.
fn structured(data: &[u8], descr: &str, rows: usize) -> Result<Table, Problem> {
    let unreadable = || NpyProblem::Type { found: shorten(descr) };
    let fields = fields(descr).ok_or_else(unreadable)?;
    let width: usize = fields.iter().map(|field| field.width * field.count).sum();
    let kept = data.len().checked_div(width).unwrap_or(0).min(rows);
    let mut table = Table { has_header: true, ..Table::default() };
    let mut start = 0;
    for field in &fields {
        for place in 0..field.count {
            let at = start + place * field.width;
            let cells =
                data.chunks_exact(width).take(kept).filter_map(|record| record.get(at..at + field.width));
            let bytes: Vec<u8> = cells.flatten().copied().collect();
            // Text and dates are no signals; what is left says so where nothing is left.
            let Some(values) = numbers(&bytes, &field.descr) else { continue };
            let number = if field.count > 1 { format!("_{}", place + 1) } else { String::new() };
            let position = table.headings.len() + 1;
            table.headings.push(Heading::parse(&format!("{}{number}", field.name), position, None));
            table.columns.push(values);
            table.clocks.push(false);
        }
        start += field.width * field.count;
    }
    if table.columns.is_empty() {
        return Err(unreadable().into());
    }
    if kept < rows {
        table.remarks.push(format!("the file is cut: {kept} of {rows} records were read"));
    }
    Ok(table)
}

/// A field of a record.
struct Field {
    name: String,
    descr: String,
    /// Bytes of one number, and how many there are.
    width: usize,
    count: usize,
}

/// The fields of `[('t', '<f8'), ('a', '<f4', (3,))]`, from the header's text on; `None` where it is written
/// in another way.
fn fields(descr: &str) -> Option<Vec<Field>> {
    let end = descr.find(")]").or_else(|| descr.find("), ]"))?;
    let mut fields = Vec::new();
    for tuple in descr.get(2..end)?.split("), (") {
        let mut parts = tuple.split(['\'', '"']);
        let (_, name, _, descr) = (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
        let count = parts.collect::<String>().split(|c: char| !c.is_ascii_digit()).try_fold(
            1_usize,
            |all, side| {
                if side.is_empty() { Some(all) } else { all.checked_mul(side.parse().ok()?) }
            },
        )?;
        let width: usize = descr.trim_start_matches(['<', '>', '|', '=']).get(1..)?.parse().ok()?;
        // A character of text has four bytes.
        let width = if descr.contains('U') { 4 * width } else { width };
        let is_sane = count > 0 && count < 1024 && width > 0 && width < 65_536;
        fields.push(Field { name: name.to_owned(), descr: descr.to_owned(), width, count });
        if !is_sane {
            return None;
        }
    }
    (!fields.is_empty()).then_some(fields)
}

/// The numbers of an array; `None` for a type that is none of real numbers.
fn numbers(data: &[u8], descr: &str) -> Option<Vec<f64>> {
    let big_endian = descr.starts_with('>');
    let kind = descr.trim_start_matches(['<', '>', '|', '=']);
    let (width, convert): (usize, fn([u8; 8]) -> f64) = match kind {
        "f8" => (8, f64::from_le_bytes),
        "f4" => (4, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
        "i8" => (8, |b| i64::from_le_bytes(b) as f64),
        "u8" => (8, |b| u64::from_le_bytes(b) as f64),
        "i4" => (4, |b| f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
        "u4" => (4, |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
        "i2" => (2, |b| f64::from(i16::from_le_bytes([b[0], b[1]]))),
        "u2" => (2, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
        "i1" => (1, |b| f64::from(b[0] as i8)),
        "u1" | "b1" => (1, |b| f64::from(b[0])),
        _ => return None,
    };
    let number = |chunk: &[u8]| {
        let mut ordered = [0_u8; 8];
        for (place, at) in ordered.iter_mut().zip(0..chunk.len()) {
            let from = if big_endian { chunk.len() - 1 - at } else { at };
            *place = chunk.get(from).copied().unwrap_or(0);
        }
        let number = convert(ordered);
        if number.is_finite() { number } else { f64::NAN }
    };
    Some(data.chunks_exact(width).map(number).collect())
}

fn table(numbers: Vec<f64>, rows: usize, columns: usize, by_columns: bool) -> Table {
    let whole = rows.checked_mul(columns) == Some(numbers.len());
    // Of a file that was cut the rows that are whole.
    let kept = if whole || by_columns {
        rows.min(numbers.len())
    } else {
        numbers.len().checked_div(columns).unwrap_or(0)
    };
    let (signals, count) = if columns > rows { (rows, columns) } else { (columns, kept.min(rows)) };
    let at = |signal: usize, k: usize| {
        let (row, column) = if columns > rows { (signal, k) } else { (k, signal) };
        let place = if by_columns {
            column.checked_mul(rows)?.checked_add(row)?
        } else {
            row.checked_mul(columns)?.checked_add(column)?
        };
        numbers.get(place).copied()
    };
    let mut table = Table { clocks: vec![false; signals.min(numbers.len())], ..Table::default() };
    // No more signals than there are numbers, whatever the header announces.
    for signal in 0..signals.min(numbers.len()) {
        let values: Vec<f64> =
            (0..count.min(numbers.len())).map(|k| at(signal, k).unwrap_or(f64::NAN)).collect();
        table.headings.push(Heading::parse("", signal + 1, None));
        table.columns.push(values);
    }
    if !whole {
        table
            .remarks
            .push(format!("the file is cut: {} of {rows} x {columns} numbers were read", numbers.len()));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn npy(descr: &str, by_columns: bool, shape: &str, data: &[u8]) -> Vec<u8> {
        let order = if by_columns { "True" } else { "False" };
        let header = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut bytes = SIGNATURE.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn arrays_of_every_type_and_order_give_the_same_columns() {
        let values = [[1.0, -2.0], [3.0, -4.0], [5.0, -6.0], [7.0, -8.0]];
        let by_rows: Vec<f64> = values.iter().flatten().copied().collect();
        let by_columns: Vec<f64> = (0..2).flat_map(|c| values.iter().map(move |row| row[c])).collect();
        let f8: Vec<u8> = by_rows.iter().flat_map(|v| v.to_le_bytes()).collect();
        let f8_columns: Vec<u8> = by_columns.iter().flat_map(|v| v.to_le_bytes()).collect();
        let f4_big: Vec<u8> = by_rows.iter().flat_map(|v| (*v as f32).to_be_bytes()).collect();
        let i2: Vec<u8> = by_rows.iter().flat_map(|v| (*v as i16).to_le_bytes()).collect();
        for bytes in [
            npy("<f8", false, "(4, 2)", &f8),
            npy("<f8", true, "(4, 2)", &f8_columns),
            npy(">f4", false, "(4, 2)", &f4_big),
            npy("<i2", false, "(4, 2)", &i2),
        ] {
            let table = read(&bytes).unwrap();
            assert_eq!(table.columns, [[1.0, 3.0, 5.0, 7.0], [-2.0, -4.0, -6.0, -8.0]]);
        }
        let lying = read(&npy("<f8", false, "(99999999999, 99999999)", &f8)).unwrap();
        assert!(lying.columns.iter().map(Vec::len).sum::<usize>() <= 16);
        assert!(read(&npy("<c16", false, "(4,)", &f8)).is_err());
        assert!(read(&npy("<f8", false, "(2, 2, 2)", &f8)).is_err());
    }

    #[test]
    fn records_give_a_column_for_every_number_of_every_field() {
        let mut data = Vec::new();
        for k in 0..20_u8 {
            data.extend(f64::from(k).to_le_bytes());
            data.extend([k, 7, 7]);
            for axis in 0..3_u8 {
                data.extend(f32::from(k * 3 + axis).to_be_bytes());
            }
        }
        let descr = "[('t', '<f8'), ('id', 'S2'), ('n', '|u1'), ('acc', '>f4', (3,))]";
        let bytes = |cut: usize| {
            let mut bytes = npy("X", false, "(20,)", &data[..data.len() - cut]);
            let header = String::from_utf8_lossy(&bytes[10..80]).into_owned();
            let end = header.find('\n').unwrap();
            let new = header[..=end].replace("'X'", descr);
            bytes.splice(8..10 + end + 1, (new.len() as u16).to_le_bytes().into_iter().chain(new.bytes()));
            bytes
        };
        let table = read(&bytes(0)).unwrap();
        let names: Vec<&str> = table.headings.iter().map(|heading| heading.source.as_str()).collect();
        assert_eq!(names, ["t", "n", "acc_1", "acc_2", "acc_3"]);
        assert_eq!((table.columns[0][19], table.columns[4][19]), (19.0, 59.0));
        assert!(table.columns[1].iter().all(|n| *n == 7.0));
        let cut = read(&bytes(5)).unwrap();
        assert_eq!((cut.columns[0].len(), cut.remarks.len()), (19, 1));
        assert!(read(&npy("[('t', '<M8[ns]')]", false, "(4,)", &[0; 32])).is_err());
    }
}
