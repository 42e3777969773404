//! How soon faults are noticed in the shipped scheme, as a table.
//!
//! `cargo run --release -p dimsart --example fault_figures`

use hil_sim::fault_table::{FaultTableError, markdown, rows};

fn main() -> Result<(), FaultTableError> {
    print!("{}", markdown(&rows()?));
    Ok(())
}
