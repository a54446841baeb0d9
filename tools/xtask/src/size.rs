//! How much of the board the image takes.

use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf};

use crate::failure::Failure;
use crate::{firmware, setup};

/// Memories of the STM32F405RG: name, first address, length in bytes. RAM is without what `memory.x` keeps
/// for the stack and for the record of a crash.
const MEMORIES: [(&str, u64, u64); 3] = [
    ("flash", 0x0800_0000, 1024 * 1024),
    ("RAM", 0x2000_7000, 100 * 1024 - 256),
    ("CCM", 0x1000_0000, 64 * 1024),
];

/// Builds the image and prints its sizes and its `symbols` largest symbols.
pub fn size(symbols: usize) -> Result<(), Failure> {
    let image = firmware::build(setup::compiler()?)?;
    print!("{}", report(&image, symbols)?);
    Ok(())
}

/// What an image takes in total, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Totals {
    /// Code and constants.
    pub text: u64,
    /// What RAM starts with.
    pub data: u64,
    /// RAM that starts as zero or with anything.
    pub bss: u64,
}

/// The totals of an image.
pub fn totals(image: &Path) -> Result<Totals, Failure> {
    let fail = |reason: String| Failure::File { path: image.to_owned(), reason };
    let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
    let sections: Vec<_> = file.sections().filter_map(|section| occupied(&section)).collect();
    Ok(Totals::of(&sections))
}

impl Totals {
    fn of(sections: &[Section]) -> Self {
        let total = |wanted: &dyn Fn(&Section) -> bool| -> u64 {
            sections.iter().filter(|section| wanted(section)).map(|section| section.bytes).sum()
        };
        Self {
            text: total(&|section| section.loaded && !section.writable),
            data: total(&|section| section.loaded && section.writable),
            bss: total(&|section| !section.loaded),
        }
    }
}

/// One section that takes memory on the board.
#[derive(Debug, Clone, Copy)]
struct Section {
    address: u64,
    bytes: u64,
    writable: bool,
    /// Comes with content, which also takes flash.
    loaded: bool,
}

/// The sizes of an image, as text.
pub fn report(image: &Path, symbols: usize) -> Result<String, Failure> {
    let fail = |reason: String| Failure::File { path: image.to_owned(), reason };
    let bytes = std::fs::read(image).map_err(|error| fail(error.to_string()))?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| fail(error.to_string()))?;
    let sections: Vec<_> = file.sections().filter_map(|section| occupied(&section)).collect();
    let mut text = summary(&sections);
    let mut largest: Vec<_> = file
        .symbols()
        .filter(|symbol| symbol.size() > 0 && symbol.is_definition())
        .filter_map(|symbol| Some((symbol.size(), symbol.address(), symbol.name().ok()?)))
        .collect();
    largest.sort_unstable();
    for (size, address, name) in largest.iter().rev().take(symbols) {
        text += &format!("{size:8}  {address:#010x}  {name}\n");
    }
    Ok(text)
}

fn occupied<'data>(section: &impl ObjectSection<'data>) -> Option<Section> {
    let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
        return None;
    };
    let has = |flag: elf::SectionFlags| sh_flags.0 & flag.0 != 0;
    has(elf::SHF_ALLOC).then(|| Section {
        address: section.address(),
        bytes: section.size(),
        writable: has(elf::SHF_WRITE),
        loaded: section.file_range().is_some(),
    })
}

fn summary(sections: &[Section]) -> String {
    let total = |wanted: &dyn Fn(&Section) -> bool| -> u64 {
        sections.iter().filter(|section| wanted(section)).map(|section| section.bytes).sum()
    };
    let Totals { text, data, bss } = Totals::of(sections);
    let mut lines = format!("text {text}  data {data}  bss {bss}  (bytes)\n");
    for (name, first, length) in MEMORIES {
        let used = total(&|section| {
            let here = section.address.wrapping_sub(first) < length;
            // What RAM starts with is copied there from flash.
            let copied = name == "flash" && section.loaded;
            here || copied
        });
        let share = 100.0 * used as f64 / length as f64;
        lines += &format!("{name:5} {used:7} of {length:7}  {share:5.1} %\n");
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn initialised_data_takes_flash_and_ram_and_zeroed_data_only_ram() {
        let section = |address, bytes, writable, loaded| Section { address, bytes, writable, loaded };
        let text = summary(&[
            section(0x0800_0000, 0x188, false, true),
            section(0x0800_0188, 1000, false, true),
            section(0x2000_7000, 100, true, true),
            section(0x2000_7064, 5000, true, false),
            section(0x1000_0000, 300, true, false),
        ]);
        assert!(text.contains("text 1392  data 100  bss 5300"), "{text}");
        assert!(text.contains("flash    1492 of 1048576"), "{text}");
        assert!(text.contains("RAM      5100 of  102144    5.0 %"), "{text}");
        assert!(text.contains("CCM       300 of   65536"), "{text}");
    }

    #[test]
    fn a_file_that_is_no_image_is_an_error_with_its_name() {
        let error = report(Path::new("no/such/image"), 0).expect_err("absent");
        assert!(error.to_string().contains("no/such/image"), "{error}");
    }
}
