//! The `dimsart` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    dimsart::cli::main(dimsart_modules::ALL)
}
