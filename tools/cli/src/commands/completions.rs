//! `stillbeam completions` and `stillbeam man`: what a shell and `man` know of the command, made from its own
//! description.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::Cli;
use crate::error::CliError;
use crate::streams::Streams;

/// Print what a shell needs to complete commands and options with Tab.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam completions bash > ~/.local/share/bash-completion/completions/stillbeam
  stillbeam completions zsh > ~/.zfunc/_stillbeam
  stillbeam completions fish > ~/.config/fish/completions/stillbeam.fish")]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

impl CompletionsArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "stillbeam", &mut script);
        Ok(streams.out.write_all(&script)?)
    }
}

/// Write the manual pages, one for each command.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  stillbeam man ~/.local/share/man/man1
  man stillbeam-identify")]
pub struct ManArgs {
    /// Folder for them; made if need be
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

impl ManArgs {
    pub(super) fn run(&self, streams: &mut Streams<'_>) -> Result<(), CliError> {
        let failed = |error: &std::io::Error| CliError::file(self.folder.display().to_string(), error);
        std::fs::create_dir_all(&self.folder).map_err(|error| failed(&error))?;
        clap_mangen::generate_to(Cli::command(), &self.folder).map_err(|error| failed(&error))?;
        streams.say(&format!("wrote manual pages into {}", self.folder.display()));
        Ok(())
    }
}
