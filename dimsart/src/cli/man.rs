//! `dimsart man`: writes the manual pages.

use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory};

use super::{Arguments, Ending};

/// Write the manual pages, one per command.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Man {
    /// Folder of the pages; created if missing.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  dimsart man --out ~/.local/share/man/man1     then `man dimsart-run`, `man dimsart-connect-arm`";

impl Man {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let failed = |error| format!("cannot write manual pages to {}: {error}", self.out.display());
        fs::create_dir_all(&self.out).map_err(failed)?;
        clap_mangen::generate_to(Arguments::command(), &self.out).map_err(failed)?;
        writeln!(out, "manual pages written to {}", self.out.display())?;
        Ok(ExitCode::SUCCESS)
    }
}
