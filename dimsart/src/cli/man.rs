//! `dimsart man`: the manual.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory};

use super::{Arguments, Ending};

/// Write the manual's pages, one for each sub-command.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Man {
    /// Folder for the pages; it is made where there is none.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  dimsart man --out ~/.local/share/man/man1     then `man dimsart-run`, and `man dimsart-connect-arm`";

impl Man {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let failed = |error| format!("{}: {error}", self.out.display());
        fs::create_dir_all(&self.out).map_err(failed)?;
        clap_mangen::generate_to(Arguments::command(), &self.out).map_err(failed)?;
        writeln!(out, "the pages are in {}", self.out.display())?;
        Ok(ExitCode::SUCCESS)
    }
}
