//! The stillbeam command; what it does is in the library.

use std::ffi::OsString;
use std::process::ExitCode;

use stillbeam::commands::Cli;
use stillbeam::error::CliError;
use stillbeam::project::words::Misunderstood;
use stillbeam::streams::Streams;

fn main() -> ExitCode {
    let (mut out, mut messages) = (std::io::stdout(), std::io::stderr());
    let mut streams = Streams { out: &mut out, messages: &mut messages };
    let words: Vec<OsString> = std::env::args_os().collect();
    // Whoever is in no folder is in no project.
    let here = std::env::current_dir().unwrap_or_default();
    let done = match Cli::understand(&words, &here) {
        Ok((cli, told)) => {
            told.iter().for_each(|line| streams.say(line));
            cli.run(&mut streams)
        }
        Err(Misunderstood::Words(error, told)) => {
            // A terminal that is gone cannot be told so.
            let _best_effort = error.print();
            told.iter().for_each(|line| streams.say(line));
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
        Err(Misunderstood::Project(error)) => Err(CliError::from(error)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            if code != 0 {
                streams.say(&format!("stillbeam: {error}"));
            }
            ExitCode::from(code)
        }
    }
}
