//! The code of a linked image, with the names of its functions and the places of its tables.

use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

use crate::failure::Failure;

/// One function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// First address, even.
    pub start: u32,
    /// The address behind.
    pub end: u32,
    /// All names it has, readable; folding identical code gives several.
    pub names: Vec<String>,
}

/// What the linker made.
#[derive(Debug, Clone, Default)]
pub struct Code {
    /// First address and content of every section with code.
    pub(super) sections: Vec<(u32, Vec<u8>)>,
    /// Ascending, starts different.
    pub(super) functions: Vec<Function>,
    /// First and next address of the data between code, ascending.
    pub(super) tables: Vec<(u32, u32)>,
}

impl Code {
    /// Reads an ELF file.
    pub fn read(image: &Path) -> Result<Self, Failure> {
        let fail = |reason: String| Failure::File { path: image.to_owned(), reason };
        let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
        let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
        let mut code = Self::default();
        for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
            let content = section.data().map_err(|error| fail(error.to_string()))?;
            code.sections.push((section.address() as u32, content.to_owned()));
        }
        // Marks of the ARM ELF specification: "$d" starts data, "$t" starts Thumb code.
        let mut marks = Vec::new();
        let mut functions = Vec::new();
        for symbol in file.symbols() {
            let (Ok(name), address) = (symbol.name(), symbol.address() as u32) else { continue };
            match name.get(..2) {
                Some("$d") => marks.push((address, true)),
                Some("$t") => marks.push((address, false)),
                _ if symbol.kind() == SymbolKind::Text && symbol.is_definition() => {
                    let readable = format!("{:#}", rustc_demangle::demangle(name));
                    // Bit 0 of a function's address says "Thumb".
                    functions.push((address & !1, symbol.size() as u32, readable));
                }
                _ => {}
            }
        }
        code.set_functions(functions);
        code.set_marks(marks);
        Ok(code)
    }

    /// From starts, sizes and names. A size of zero, as hand-written assembly has it, lasts to the next
    /// function.
    pub(super) fn set_functions(&mut self, mut functions: Vec<(u32, u32, String)>) {
        functions.sort();
        for (start, size, name) in functions {
            match self.functions.last_mut() {
                Some(last) if last.start == start => {
                    last.end = last.end.max(start + size);
                    last.names.push(name);
                }
                _ => self.functions.push(Function { start, end: start + size, names: vec![name] }),
            }
        }
        let starts: Vec<_> = self.functions.iter().map(|function| function.start).collect();
        for (index, function) in self.functions.iter_mut().enumerate() {
            if function.end == function.start {
                function.end = starts.get(index + 1).copied().unwrap_or(u32::MAX);
            }
        }
    }

    /// From addresses, and whether data starts there.
    pub(super) fn set_marks(&mut self, mut marks: Vec<(u32, bool)>) {
        marks.sort_unstable();
        for (index, &(start, is_data)) in marks.iter().enumerate() {
            if is_data {
                let end = marks.get(index + 1).map_or(u32::MAX, |(next, _)| *next);
                self.tables.push((start, end));
            }
        }
    }

    /// The function of this name.
    pub fn named(&self, name: &str) -> Option<&Function> {
        self.functions.iter().find(|function| function.names.iter().any(|own| own == name))
    }

    /// The function around an address.
    pub fn around(&self, address: u32) -> Option<&Function> {
        let after = self.functions.partition_point(|function| function.start <= address);
        self.functions.get(after.checked_sub(1)?).filter(|function| address < function.end)
    }

    /// The halfword of code at an address; `None` in data and outside of the image.
    pub fn halfword(&self, address: u32) -> Option<u16> {
        if self.table_at(address).is_some() { None } else { self.bytes(address).map(u16::from_le_bytes) }
    }

    /// The entries of a branch table that starts at `start`.
    pub fn table_entries(&self, start: u32, entry_bytes: u32) -> Option<Vec<u32>> {
        let (_, end) = self.table_at(start).filter(|(first, _)| *first == start)?;
        (start..end)
            .step_by(entry_bytes as usize)
            .map(|at| {
                let [low, high] = self.bytes(at)?;
                Some(if entry_bytes == 1 {
                    u32::from(low)
                } else {
                    u32::from(u16::from_le_bytes([low, high]))
                })
            })
            .collect()
    }

    fn table_at(&self, address: u32) -> Option<(u32, u32)> {
        let after = self.tables.partition_point(|(start, _)| *start <= address);
        self.tables.get(after.checked_sub(1)?).copied().filter(|(_, end)| address < *end)
    }

    fn bytes(&self, address: u32) -> Option<[u8; 2]> {
        self.sections.iter().find_map(|(start, content)| {
            let at = address.checked_sub(*start)? as usize;
            content.get(at..at + 2)?.try_into().ok()
        })
    }
}
