//! `dimsart dbc`: what a scheme says on a CAN bus, for CAN tools.

use std::io::Write;
use std::process::ExitCode;

use clap::Args;
use dimsart_core::Dimsart;

use super::Ending;
use crate::dbc::{self, Frames};
use hil_sim::bilateral::{Side, device};
use hil_sim::schemes::{self, SchemeText};

/// Write the DBC file of what a scheme sends over CAN.
///
/// One message per `COMM_TXMOD`; its identifier is the module's `CTX_CHANNEL`, which must not be 0. A CAN tool shows every
/// signal on every axis by it, in its unit.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Dbc {
    /// Scheme file.
    scheme: String,
    /// Side whose messages are written; both when left out.
    #[arg(long, value_parser = super::side::side())]
    side: Option<Side>,
    /// Degrees of freedom of the devices, 1 to 8.
    #[arg(long, default_value_t = 3, value_name = "COUNT", allow_negative_numbers = true)]
    dof: usize,
    /// Frames that carry the packets.
    #[arg(long, value_enum, default_value_t = Frames::CanFd)]
    frames: Frames,
    /// Prints the messages as one JSON object instead.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart dbc my.scheme > my.dbc                 both sides, CAN FD
  dimsart dbc my.scheme --frames can --dof 1     classic CAN

Rows that give a scheme its channels, above the MOD_ON rows of these modules:
  master   COMM_TXMOD   CTX_CHANNEL   16
  slave    COMM_RXMOD   CRX_CHANNEL   16";

impl Dbc {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let scheme = SchemeText::read(&self.scheme)?;
        let sides = self.side.map_or(vec![Side::Master, Side::Slave], |side| vec![side]);
        let mut messages = Vec::new();
        for side in sides {
            let device = device(side.name(), self.dof, 1e-3)?;
            let mut dimsart: Dimsart = Dimsart::new(device).map_err(dimsart_core::CommandError::from)?;
            let loaded = schemes::load(&scheme, side.name(), &[], &mut dimsart);
            if let Some(problem) = loaded.problems().next() {
                return Err(format!("{problem}; `dimsart check {}` names all faults", self.scheme).into());
            }
            messages.extend(dbc::messages(&mut dimsart, side.name(), self.frames)?);
        }
        let dbc = dbc::Dbc::new(messages)?;
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&dbc)?)?;
        } else {
            write!(out, "{dbc}")?;
        }
        Ok(ExitCode::SUCCESS)
    }
}
