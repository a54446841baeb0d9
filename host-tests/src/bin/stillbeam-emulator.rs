//! Boots a firmware image in the emulator and prints where its serial port is.
//!
//! `stillbeam-emulator IMAGE [--shift N]` prints exactly one line, `serial PATH`, on standard
//! output and runs the board until standard input closes or the process is told to end.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use stillbeam_host_tests::emulator::{Emulator, EmulatorOptions};

const USAGE: &str = "usage: stillbeam-emulator IMAGE [--shift N]

Boots IMAGE (an ELF file, see `cargo xtask firmware`) on an emulated STM32F405, prints
`serial PATH` and runs until standard input closes.

  --shift N   an instruction takes 2^N ns of virtual time (0 to 10)";

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    let (image, options) = match parse(&arguments) {
        Ok(parsed) => parsed,
        Err(complaint) => {
            eprintln!("stillbeam-emulator: {complaint}\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match run(&image, &options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("stillbeam-emulator: {error}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Result<(PathBuf, EmulatorOptions), String> {
    let mut image = None;
    let mut options = EmulatorOptions::default();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        if argument == "--shift" {
            let value = rest.next().ok_or("--shift needs a number")?;
            options.shift = match value.parse() {
                Ok(shift @ 0..=10) => shift,
                _ => return Err(format!("--shift {value}: not a whole number from 0 to 10")),
            };
        } else if argument.starts_with('-') {
            return Err(format!("unknown option {argument}"));
        } else if image.replace(PathBuf::from(argument)).is_some() {
            return Err(format!("one image only, not also {argument}"));
        }
    }
    Ok((image.ok_or("which image?")?, options))
}

fn run(image: &std::path::Path, options: &EmulatorOptions) -> Result<(), Box<dyn std::error::Error>> {
    // Signals first: one that comes during the start-up must not leave an emulator behind.
    let mut signals = Signals::new([SIGHUP, SIGINT, SIGTERM])?;
    let (end, ended) = mpsc::channel();
    let end_by_signal = end.clone();
    std::thread::spawn(move || {
        if signals.forever().next().is_some() {
            let _ = end_by_signal.send(());
        }
    });
    std::thread::spawn(move || {
        let mut ignored = [0; 256];
        let mut input = std::io::stdin().lock();
        while matches!(input.read(&mut ignored), Ok(count) if count > 0) {}
        let _ = end.send(());
    });
    let emulator = Emulator::boot(image, options)?;
    let report = emulator.boot_report();
    eprintln!(
        "stillbeam-emulator: QEMU {}, start-up in {} ms with {} covered accesses",
        emulator.version(),
        report.duration.as_millis(),
        report.served_accesses
    );
    println!("serial {}", emulator.serial_port().display());
    std::io::stdout().flush()?;
    // Either thread's word ends it; an error means both are gone.
    let _ = ended.recv();
    Ok(())
}
