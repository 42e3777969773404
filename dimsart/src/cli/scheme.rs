//! `dimsart scheme`: prints a scheme in normal form.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use clap::Args;

use super::Ending;
use super::controllers::{no_rig, one_controller, rig_says_itself, side_of_scheme};
use dimsart_core::{Dimsart, ModuleKinds};
use hil_sim::schemes::{self, SchemeText};

/// Print the scheme of one side or of a rig's controller in its shortest form.
///
/// Lists modules in plug-in order, bindings, and parameters that differ from the defaults. The rows are equivalent to the rows of
/// the original scheme.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Scheme {
    /// Scheme file, `builtin:NAME`, or rig (TOML file or shipped, such as `joint`).
    scheme: String,
    /// Side of a scheme (default: master).
    #[arg(long, value_parser = super::side::side())]
    side: Option<&'static str>,
    /// Degrees of freedom of a scheme's device, 1 to 8 (default: 3).
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    dof: Option<usize>,
    /// Controller of a rig; required if the rig has several controllers.
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart scheme builtin:bilateral                   rows of the master
  dimsart scheme my.scheme --side slave > slave.scheme
  dimsart scheme joint                               rows of a rig's controller
  dimsart scheme arm_bus --controller coordinator";

impl Scheme {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        if let Some(file) = crate::rig_argument::read_rig(Path::new(&self.scheme), kinds)? {
            if self.side.is_some() || self.dof.is_some() {
                return Err(rig_says_itself("--side and --dof").into());
            }
            let (mut found, side) = one_controller(&file, &self.scheme, self.controller.as_deref())?;
            return print(&mut found.dimsart, &side, out);
        }
        if self.controller.is_some() {
            return Err(no_rig(&self.scheme).into());
        }
        let (scheme, side) = (SchemeText::read(&self.scheme)?, self.side.unwrap_or("master"));
        print(&mut *side_of_scheme(&scheme, side, self.dof, kinds)?, side, out)
    }
}

fn print(dimsart: &mut Dimsart, side: &str, out: &mut impl Write) -> Ending {
    let commands: Vec<_> = dimsart.engine_mut().rebuild_commands().collect();
    write!(out, "{}", schemes::rows(&commands, side, dimsart.engine()))?;
    Ok(ExitCode::SUCCESS)
}
