//! The `dimsart` command.
fn main() {}
