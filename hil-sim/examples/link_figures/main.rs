//! Table 1 over every carrier: round trip, what is felt, energy and errors, as a table.
//!
//! `cargo run --release -p hil-sim --example link_figures`. The figures are the same on every machine.

mod cases;

use std::error::Error;

use cases::{CASES, errors, off};

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "| Carrier | Policy | Round trip (ticks) | Predicted (N/m) | Perceived (N/m) | Off | Energy (J) | Load | Errors |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|");
    for case in CASES {
        let outcome = case.run()?;
        let first = |values: &[Option<f64>]| values.first().copied().flatten().unwrap_or(f64::NAN);
        let off = match off(&outcome) {
            // No stiffness is predicted where the hand creeps.
            None if !case.is_perceived => "creeps".to_owned(),
            None => return Err("no contact".into()),
            Some(off) if off.abs() < 1e-4 => "below 0.01 %".to_owned(),
            Some(off) => format!("{:.2} %", 100.0 * off),
        };
        if case.has_errors != (errors(&outcome) > 0) {
            return Err(format!("{}: {} errors", case.carrier, errors(&outcome)).into());
        }
        println!(
            "| {} | {} | {} | {:.2} | {:.2} | {off} | {} | {:.0} % | {} |",
            case.carrier,
            case.policy,
            outcome.round_trip_ticks.ok_or("nothing came back")?,
            first(&outcome.k_predicted_n_per_m),
            first(&outcome.k_perceived_n_per_m),
            outcome.energy_min_j.ok_or("no waves")?,
            100.0 * outcome.media.iter().map(|traffic| traffic.load).fold(0.0, f64::max),
            errors(&outcome),
        );
    }
    Ok(())
}
