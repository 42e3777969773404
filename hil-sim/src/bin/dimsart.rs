//! The `dimsart` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    hil_sim::cli::main()
}
