//! The `dimsart` command with the modules of this project.

use std::process::ExitCode;

fn main() -> ExitCode {
    dimsart::cli::main()
}
