//! `dimsart scheme`: a scheme as a controller has it, as text.

use std::io::Write;
use std::process::ExitCode;

use clap::Args;

use super::Ending;
use hil_sim::bilateral::{Side, device};
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::{self, SchemeText};

/// Print a scheme of one side in the shortest form: modules in their order, what differs from the defaults, bindings.
///
/// Given to a controller, the rows build what the scheme's own rows build.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Scheme {
    /// Scheme file, or one that is built in: `builtin:bilateral`.
    scheme: String,
    /// Side whose rows are taken.
    #[arg(long, default_value = "master", value_parser = super::side::side())]
    side: Side,
    /// Degrees of freedom of the device, 1 to 8.
    #[arg(long, default_value_t = 3, value_name = "COUNT", allow_negative_numbers = true)]
    dof: usize,
}

const EXAMPLES: &str = "\
Examples:
  dimsart scheme builtin:bilateral                   what the master has of it
  dimsart scheme my.scheme --side slave > slave.scheme";

impl Scheme {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let (scheme, side) = (SchemeText::read(&self.scheme)?, self.side.name());
        let device = device(side, self.dof, 1e-3)?;
        let mut dimsart = Box::new(SimulatedDimsart::new(device).map_err(dimsart_core::CommandError::from)?);
        let loaded = schemes::load(&scheme, side, &[], &mut dimsart);
        if let Some(problem) = loaded.problems().next() {
            return Err(format!("{problem}; `dimsart check {}` names all faults", self.scheme).into());
        }
        let commands: Vec<_> = dimsart.engine_mut().commands().collect();
        write!(out, "{}", schemes::rows(&commands, side, dimsart.engine()))?;
        Ok(ExitCode::SUCCESS)
    }
}
