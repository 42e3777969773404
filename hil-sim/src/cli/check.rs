//! `dimsart check`: whether a scheme matches, without running it.

use std::process::ExitCode;

use clap::Args;
use dimsart_core::Dimsart;

use super::Ending;
use crate::experiment::{Side, device};
use crate::schemes::{self, SchemeText};

/// Check a scheme against a device: exit status 0 when it matches, 1 when not.
#[derive(Debug, Args)]
pub(super) struct Check {
    /// Scheme file, or `builtin:bilateral`, `builtin:table1`.
    scheme: String,
    /// Side whose rows are checked; both when left out.
    #[arg(long)]
    side: Option<Side>,
    /// Degrees of freedom of the device.
    #[arg(long, default_value_t = 3)]
    dof: usize,
    /// Sample period of the device, s.
    #[arg(long, default_value_t = 1e-3)]
    sample_period_s: f64,
}

impl Check {
    pub(super) fn execute(self) -> Ending {
        let scheme = SchemeText::read(&self.scheme)?;
        let sides = self.side.map_or(vec![Side::Master, Side::Slave], |side| vec![side]);
        let mut is_sound = true;
        for side in sides {
            // As large as on the smallest board: what passes here fits there.
            let mut dimsart: Dimsart = Dimsart::new(device(side.name(), self.dof, self.sample_period_s)?)
                .map_err(|error| format!("the device's types do not fit: {error:?}"))?;
            let loaded = schemes::load(&scheme, side.name(), &[], &mut dimsart);
            let verdict = if loaded.is_sound() { "matches" } else { "does NOT match" };
            println!("{} on the {}: {verdict}", self.scheme, side.name());
            for line in loaded.errors.iter().chain(&loaded.faults) {
                println!("  fault: {line}");
            }
            for line in &loaded.delays {
                println!("  delay: {line}");
            }
            if loaded.is_sound() {
                let usage = dimsart.engine().usage();
                println!(
                    "  takes {} modules, {} slots, {} of {} words",
                    usage.modules, usage.slots, usage.words, usage.words_in_all
                );
            }
            is_sound &= loaded.is_sound();
        }
        Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}
