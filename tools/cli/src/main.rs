//! The stillbeam command; what it does is in the library.

use std::process::ExitCode;

use clap::Parser;
use stillbeam::commands::Cli;
use stillbeam::streams::Streams;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let (mut out, mut messages) = (std::io::stdout(), std::io::stderr());
    let mut streams = Streams { out: &mut out, messages: &mut messages };
    match cli.run(&mut streams) {
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
