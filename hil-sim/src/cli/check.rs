//! `dimsart check`: whether a scheme matches, without running it.

use std::io::Write;
use std::process::ExitCode;

use clap::Args;
use dimsart_core::{Dimsart, limits};

use super::Ending;
use crate::experiment::{Side, device};
use crate::schemes::{self, SchemeText};

/// Check a scheme against a device: exit status 0 when it matches, 1 when not.
///
/// Names every fault at once: a type that nobody provides or that two modules provide, a port bound to a type of
/// another unit, a word that does not exist, a module that does not fit any more. A type that is read before it is
/// written in the tick is named as a delay.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Check {
    /// Scheme file, or one that is built in: `builtin:bilateral`, `builtin:position_position`,
    /// `builtin:table1`.
    scheme: String,
    /// Side whose rows are checked; both when left out.
    #[arg(long)]
    side: Option<Side>,
    /// Degrees of freedom of the device, 1 to 8.
    #[arg(long, default_value_t = 3, value_name = "COUNT", allow_negative_numbers = true)]
    dof: usize,
    /// Sample period of the device, s.
    #[arg(long, default_value_t = 1e-3, value_name = "SECONDS", allow_negative_numbers = true)]
    sample_period_s: f64,
}

const EXAMPLES: &str = "\
Examples:
  dimsart check builtin:table1               the paper's Table 1: on the slave, a type has no provider
  dimsart check my.scheme --side slave       the rows for one side
  dimsart check my.scheme --dof 7            on a robot of seven joints

A scheme is a text of `dest module command value` rows; the built-in ones are in the folder schemes/.";

impl Check {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let scheme = SchemeText::read(&self.scheme)?;
        let sides = self.side.map_or(vec![Side::Master, Side::Slave], |side| vec![side]);
        let mut is_sound = true;
        for side in sides {
            is_sound &= self.check(&scheme, side, out)?;
        }
        Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn check(
        &self,
        scheme: &SchemeText,
        side: Side,
        out: &mut impl Write,
    ) -> Result<bool, Box<dyn std::error::Error>> {
        // As large as on the smallest board: what passes here fits there.
        let mut dimsart: Dimsart = Dimsart::new(device(side.name(), self.dof, self.sample_period_s)?)
            .map_err(dimsart_core::CommandError::from)?;
        let loaded = schemes::load(scheme, side.name(), &[], &mut dimsart);
        let is_sound = loaded.is_sound();
        let verdict = if is_sound { "matches" } else { "does NOT match" };
        writeln!(out, "{} on the {}: {verdict}", self.scheme, side.name())?;
        for line in loaded.problems() {
            writeln!(out, "  fault: {line}")?;
        }
        for line in &loaded.delays {
            writeln!(out, "  delay: {line}")?;
        }
        if is_sound {
            let usage = dimsart.engine().usage();
            writeln!(
                out,
                "  takes {} of {} modules, {} of {} slots, {} of {} words",
                usage.modules,
                limits::MAX_MODULES,
                usage.slots,
                limits::MAX_SLOTS,
                usage.words,
                usage.words_in_all
            )?;
        }
        Ok(is_sound)
    }
}
