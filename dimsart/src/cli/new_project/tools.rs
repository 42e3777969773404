//! The `dimsart` command with the control laws of this project.

use std::process::ExitCode;

use dimsart_core::join_kinds;

fn main() -> ExitCode {
    dimsart::cli::main(join_kinds![dimsart_modules::ALL, laws::modules::OWN])
}
