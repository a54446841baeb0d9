//! Data elements: tag, length, bytes.

use super::error::MatProblem;

/// Codes of the data types that matter here.
pub(super) const INT8: u32 = 1;
pub(super) const INT32: u32 = 5;
pub(super) const UINT32: u32 = 6;
pub(super) const MATRIX: u32 = 14;
pub(super) const COMPRESSED: u32 = 15;

/// One data element.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'b> {
    pub(super) kind: u32,
    pub(super) data: &'b [u8],
    /// Where its tag begins.
    pub(super) offset: usize,
    /// Where `data` begins: behind the tag, or in it for a small element.
    data_offset: usize,
}

/// Reads elements one after the other.
#[derive(Debug, Clone)]
pub(super) struct Elements<'b> {
    bytes: &'b [u8],
    at: usize,
    /// Offset of `bytes` in the file or in the uncompressed variable.
    base: usize,
    pub(super) little_endian: bool,
    container: &'static str,
}

impl<'b> Elements<'b> {
    pub(super) fn new(bytes: &'b [u8], base: usize, little_endian: bool, container: &'static str) -> Self {
        Self { bytes, at: 0, base, little_endian, container }
    }

    /// The elements within an element.
    pub(super) fn within(&self, element: Element<'b>) -> Self {
        Self { bytes: element.data, at: 0, base: element.data_offset, ..*self }
    }

    /// Where the next element begins.
    pub(super) fn offset(&self) -> usize {
        self.base + self.at
    }

    fn ends(&self, what: &'static str) -> MatProblem {
        MatProblem::Ends { offset: self.offset(), what, container: self.container }
    }

    /// The next element; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Element<'b>>, MatProblem> {
        let rest = self.bytes.get(self.at..).unwrap_or(&[]);
        if rest.is_empty() {
            return Ok(None);
        }
        let offset = self.offset();
        let word = |at| integer(rest, at, 4, self.little_endian).map(|word| word as u32);
        let tag = word(0).ok_or_else(|| self.ends("a tag"))?;
        // Up to four bytes of data fit into the tag itself; its upper half is their number then.
        if tag >> 16 != 0 {
            let length = (tag >> 16) as usize;
            let data = rest.get(4..4 + length).filter(|_| length <= 4);
            let data = data.ok_or_else(|| self.ends("a small element"))?;
            self.at += 8;
            return Ok(Some(Element { kind: tag & 0xffff, data, offset, data_offset: offset + 4 }));
        }
        let length = word(4).ok_or_else(|| self.ends("a tag"))? as usize;
        let end = length.checked_add(8);
        let data = end.and_then(|end| rest.get(8..end)).ok_or_else(|| self.ends("an element"))?;
        // Everything but a compressed element is padded to eight bytes.
        let padding = if tag == COMPRESSED { 0 } else { length.wrapping_neg() % 8 };
        self.at = self.at.saturating_add(8 + length + padding);
        Ok(Some(Element { kind: tag, data, offset, data_offset: offset + 8 }))
    }

    /// The next element, which has to be there and of a kind.
    pub(super) fn expect(&mut self, kind: u32, what: &'static str) -> Result<Element<'b>, MatProblem> {
        let element = self.next()?.ok_or_else(|| self.ends(what))?;
        if element.kind == kind {
            return Ok(element);
        }
        let found = format!("an element of type {}", element.kind);
        Err(MatProblem::Element { offset: element.offset, what, found })
    }
}

/// An unsigned integer of `width` bytes at `at`.
pub(super) fn integer(bytes: &[u8], at: usize, width: usize, little_endian: bool) -> Option<u64> {
    let bytes = bytes.get(at..at.checked_add(width)?)?;
    let fold = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    Some(if little_endian { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) })
}

/// The numbers of a data element, by its type; `None` for a type that holds none.
pub(super) fn numbers(element: Element<'_>, little_endian: bool) -> Option<Vec<f64>> {
    let (width, convert): (usize, fn(u64) -> f64) = match element.kind {
        1 => (1, |bits| f64::from(bits as u8 as i8)),
        2 => (1, |bits| bits as f64),
        3 => (2, |bits| f64::from(bits as u16 as i16)),
        4 => (2, |bits| bits as f64),
        5 => (4, |bits| f64::from(bits as u32 as i32)),
        6 => (4, |bits| bits as f64),
        7 => (4, |bits| f64::from(f32::from_bits(bits as u32))),
        9 => (8, f64::from_bits),
        12 => (8, |bits| bits as i64 as f64),
        13 => (8, |bits| bits as f64),
        _ => return None,
    };
    let bytes = element.data.chunks_exact(width);
    Some(bytes.filter_map(|bytes| integer(bytes, 0, width, little_endian)).map(convert).collect())
}
