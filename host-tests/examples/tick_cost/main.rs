//! Counts the instructions of the tick interrupt on the image in the emulator, and prints them as TOML.
//!
//! `tick_cost IMAGE` measures everything; `tick_cost IMAGE --gate` only the cases that `cargo xtask test`
//! watches.

mod cases;
mod measuring;

use std::process::ExitCode;

use cases::Case;
use measuring::Bench;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let (image, gate) = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        [image] => ((*image).to_owned(), false),
        [image, "--gate"] => ((*image).to_owned(), true),
        _ => {
            eprintln!("usage: tick_cost IMAGE [--gate]");
            return ExitCode::from(2);
        }
    };
    match run(image.as_ref(), gate) {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("tick_cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(image: &std::path::Path, gate: bool) -> Result<String, Box<dyn std::error::Error>> {
    let mut bench = Bench::boot(image)?;
    let mut text = String::new();
    for case in if gate { Case::gate() } else { Case::all() } {
        text += &bench.measure(&case)?;
    }
    if !gate {
        text += &bench.masked_sections(image)?;
    }
    bench.say_everything()?;
    text += &bench.stack()?;
    Ok(text)
}
