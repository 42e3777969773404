//! `dimsart dbc`: writes a DBC file of a scheme's CAN messages.

use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use dimsart_core::ModuleKinds;

use super::Ending;
use super::controllers::{controllers, no_rig, rig_says_itself, side_of_scheme};
use crate::dbc::{self, DbcError, FrameFormat, Message};
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::{SIDES, SchemeText};

/// Write a DBC file of the CAN messages of a scheme or rig.
///
/// Each `COMM_TXMOD` is one message; the message identifier is the module's `CTX_CHANNEL`, which must not be 0. With the
/// file, CAN tools decode every signal of every axis, with its unit.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Dbc {
    /// Scheme file, or rig: TOML file or shipped name, such as `arm_bus`.
    scheme: String,
    /// Side of a scheme (default: both).
    #[arg(long, value_parser = super::side::side())]
    side: Option<&'static str>,
    /// Degrees of freedom of a scheme's devices, 1 to 8 (default: 3).
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    dof: Option<usize>,
    /// Controller of a rig (default: all controllers that send).
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
    /// Format of the CAN frames.
    #[arg(long, value_enum, default_value_t = FrameFormat::CanFd)]
    frames: FrameFormat,
    /// Print the messages as one JSON object instead.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart dbc my.scheme > my.dbc                 both sides, CAN FD
  dimsart dbc my.scheme --frames can --dof 1     classic CAN
  dimsart dbc arm_bus > arm.dbc                  all controllers of a rig

Set the channels of a scheme with these rows, before the MOD_ON rows of the modules:
  master   COMM_TXMOD   CTX_CHANNEL   16
  slave    COMM_RXMOD   CRX_CHANNEL   16";

impl Dbc {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let messages = match crate::rig_argument::read_rig(Path::new(&self.scheme), kinds)? {
            Some(file) => self.of_rig(&file)?,
            None => self.of_scheme(kinds)?,
        };
        let dbc = dbc::Dbc::new(messages)?;
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&dbc)?)?;
        } else {
            write!(out, "{dbc}")?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn of_scheme(&self, kinds: ModuleKinds) -> Result<Vec<Message>, Box<dyn Error>> {
        if self.controller.is_some() {
            return Err(no_rig(&self.scheme).into());
        }
        let scheme = SchemeText::read(&self.scheme)?;
        let sides = self.side.map_or(SIDES.to_vec(), |side| vec![side]);
        let mut messages = Vec::new();
        for side in sides {
            let mut dimsart = side_of_scheme(&scheme, side, self.dof, kinds)?;
            messages.extend(dbc::messages(&mut dimsart, side, self.frames)?);
        }
        Ok(messages)
    }

    fn of_rig(&self, file: &RigFile) -> Result<Vec<Message>, Box<dyn Error>> {
        if self.side.is_some() || self.dof.is_some() {
            return Err(rig_says_itself("--side and --dof").into());
        }
        let (mut messages, mut silent) = (Vec::new(), None);
        for mut controller in controllers(file, &self.scheme, self.controller.as_deref())? {
            match dbc::messages(&mut controller.dimsart, &controller.name, self.frames) {
                Ok(found) => messages.extend(found),
                // Another controller may send.
                Err(error @ DbcError::NoMessages { .. }) => silent = Some(error),
                Err(error) => return Err(error.into()),
            }
        }
        match silent.filter(|_| messages.is_empty()) {
            Some(error) => Err(error.into()),
            None => Ok(messages),
        }
    }
}
