//! `dimsart completions`: scripts for shell completion.

use std::io::Write;
use std::process::ExitCode;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{Arguments, Ending};

/// Print a script that completes commands and options in a shell.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Completions {
    /// Name of the shell.
    shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  dimsart completions bash > ~/.local/share/bash-completion/completions/dimsart
  dimsart completions fish > ~/.config/fish/completions/dimsart.fish
  source <(dimsart completions zsh)";

impl Completions {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), "dimsart", &mut script);
        out.write_all(&script)?;
        Ok(ExitCode::SUCCESS)
    }
}
