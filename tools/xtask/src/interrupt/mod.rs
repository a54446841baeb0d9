//! `cargo xtask check-interrupt`: what the interrupts of the two highest priorities can run, proved on the
//! linked image.
//!
//! All paths from the handlers of the tick, the emergency input and serial bytes are followed, through
//! branches, branch tables and calls. They must meet no panic, no trap, no floating-point emulation, no
//! division of floats, no library division and no lock, and every jump must be resolved. What is not proved:
//! how often loops run, and that the decoder is right; its tests are in `thumb_tests.rs`. The stack that they
//! can take is bounded on the same paths.

mod code;
mod masked;
mod reach;
mod stack;
mod thumb;
mod verdict;

use std::path::Path;

use crate::failure::Failure;
use crate::{firmware, setup};
use code::Code;
use verdict::Verdict;

/// The vector table's names for the interrupts of priorities 0 and 1, and what they are.
const HANDLERS: [(&str, &str); 3] =
    [("TIM2", "tick interrupt"), ("EXTI1", "emergency interrupt"), ("USART1", "serial interrupt")];

/// Builds the image, checks it and prints what was found.
pub fn check_interrupt() -> Result<(), Failure> {
    let image = firmware::build(setup::compiler()?)?;
    print!("{}", check(&image)?);
    Ok(())
}

/// Checks an image. The text says what the tick can reach.
pub fn check(image: &Path) -> Result<String, Failure> {
    let code = Code::read(image)?;
    let mut text = String::new();
    let mut well = true;
    for (handler, title) in HANDLERS {
        let entry = code.named(handler).ok_or_else(|| Failure::File {
            path: image.to_owned(),
            reason: format!("no function {handler}; the check needs the release image with its symbols"),
        })?;
        let verdict = Verdict::of(&code, entry, &reach::follow(&code, entry));
        text += &verdict.describe(title, &divisions(image, &verdict));
        well &= verdict.violations.is_empty();
    }
    text += &masked::describe(&masked::sections(&code));
    if well { Ok(text) } else { Err(Failure::Interrupt { report: text }) }
}

/// Where the source divides, with the functions that were inlined, innermost first.
fn divisions(image: &Path, verdict: &Verdict) -> Vec<String> {
    let loader = addr2line::Loader::new(image).ok();
    let describe = |address: &u32| {
        let place = loader.as_ref().and_then(|loader| source_place(loader, *address));
        format!("{address:#010x} {}", place.unwrap_or_else(|| "(no line known)".to_owned()))
    };
    verdict.integer_divisions.iter().map(describe).collect()
}

fn source_place(loader: &addr2line::Loader, address: u32) -> Option<String> {
    let mut frames = loader.find_frames(u64::from(address)).ok()?;
    let mut places = Vec::new();
    while let Ok(Some(frame)) = frames.next() {
        let name = frame
            .function
            .as_ref()
            .and_then(|function| function.demangle().ok().map(|name| name.into_owned()));
        let line = frame.location.as_ref().and_then(|location| {
            // The file alone: where it lies depends on the machine.
            let file = Path::new(location.file?).file_name()?.to_string_lossy().into_owned();
            Some(format!("{file}:{}", location.line?))
        });
        places.push(format!("{} ({})", name.unwrap_or_default(), line.unwrap_or_default()));
    }
    // The division itself, and the lines of this project that led to it.
    places.retain({
        let mut first = true;
        move |place| std::mem::take(&mut first) || place.starts_with("stillbeam")
    });
    (!places.is_empty()).then(|| places.join(" in "))
}
