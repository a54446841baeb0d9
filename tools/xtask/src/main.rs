//! The project's chores, one file each: `cargo xtask CHORE`.

mod bench_firmware;
mod cargo;
mod emulate;
mod failure;
mod firmware;
mod fuzz;
mod interrupt;
mod libtest;
mod prove;
mod python;
mod run;
mod setup;
mod size;
mod test;

use std::process::ExitCode;

use failure::Failure;

const USAGE: &str = "usage: cargo xtask CHORE

  test                 everything: set-up, format, lints, firmware image, host and emulator tests
  test --quick         format, lints and the tests that take seconds
  firmware             build the release image and print its path
  size [--symbols N]   build the image and print how much flash and RAM it takes
  check-interrupt      build the image and prove that the tick and the emergency input never panic, lock or emulate floats
  bench-firmware       count the tick's instructions in the emulator and record them in docs/results
  fuzz [--runs N [--only TARGET,...]]
                       let libFuzzer look for inputs that the console, files and frames do not survive
  prove [OPTION ...]   diagnose sealed cases of concealed physics and score the answers; --cases N, --seed S,
                       --resume, --page FILE.md and more (prove --help)
  nulls [OPTION ...]   diagnose machines of which nothing is left out, by an independent simulator; --cases N, --seed S,
                       --wrong SHARE,..., --page FILE.md and more (nulls --help)
  python               install the Python package in target/python and run its tests and notebooks
  emulate [--shift N]  run the image on an emulated board and print its serial port
  setup                install what the other chores need (they also do it themselves)

environment
  CI=true                    whatever was not run counts as a failure
  STILLBEAM_CROSS=distribution   build the image with the distribution's compiler even where
                             rustup has the target";

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let words: Vec<_> = arguments.iter().map(String::as_str).collect();
    match dispatch(&words) {
        Ok(code) => code,
        Err(failure) => {
            eprintln!("xtask: {failure}");
            match failure {
                Failure::Usage(_) => {
                    eprintln!("{USAGE}");
                    ExitCode::from(2)
                }
                _ => ExitCode::FAILURE,
            }
        }
    }
}

fn dispatch(words: &[&str]) -> Result<ExitCode, Failure> {
    match words {
        ["test"] => return test::test(),
        ["test", "--quick"] => return test::quick(),
        ["firmware"] => println!("{}", firmware::build(setup::compiler()?)?.display()),
        ["size"] => size::size(0)?,
        ["size", "--symbols", count] => size::size(number(count)?)?,
        ["bench-firmware"] => bench_firmware::record()?,
        ["check-interrupt"] => interrupt::check_interrupt()?,
        ["fuzz"] => fuzz::fuzz(fuzz::DEFAULT_RUNS, None)?,
        ["fuzz", "--runs", runs] => fuzz::fuzz(number(runs)?, None)?,
        ["fuzz", "--runs", runs, "--only", targets] => fuzz::fuzz(number(runs)?, Some(targets))?,
        ["prove", options @ ..] => prove::prove(options)?,
        ["nulls", options @ ..] => prove::nulls(options)?,
        ["python"] => python::python()?,
        ["emulate"] => emulate::emulate(None)?,
        ["emulate", "--shift", shift] => emulate::emulate(Some(number(shift)?))?,
        ["setup"] => setup::everything()?,
        ["help" | "--help" | "-h"] => println!("{USAGE}"),
        [] => return Err(Failure::Usage("which chore?".to_owned())),
        unknown => return Err(Failure::Usage(format!("unknown chore: {}", unknown.join(" ")))),
    }
    Ok(ExitCode::SUCCESS)
}

fn number(text: &str) -> Result<usize, Failure> {
    text.parse().map_err(|_| Failure::Usage(format!("{text}: not a whole number")))
}
