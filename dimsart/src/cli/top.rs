//! `dimsart top`: the page for a terminal.

use std::io::{self, IsTerminal};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::Kinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::run::stop_on_interrupt;
use super::station::station;
use super::{Ending, UsageError};
use crate::broker;
use crate::top;

/// Show, tune and move controllers in the terminal, as the page does in a browser.
///
/// State, first fault, lease, modules and their parameters, signals and one of them as a chart, events. Motion needs `a`;
/// Space stops every controller that is shown, always. `?` lists the keys.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Top {
    /// Serial ports such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` of a `dimsart serve`; all that a
    /// running `dimsart serve` of yours shares, when left out.
    #[arg(value_name = "PORT")]
    ports: Vec<String>,
    /// Bits per second of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart top                                 all that `dimsart serve` shares
  dimsart top sim:joint                       the simulated joint of `dimsart serve`
  dimsart top /dev/ttyACM0 /dev/ttyACM1       two boards
  ssh -t robot dimsart top                    on another computer, which has the boards";

impl Top {
    pub(super) fn execute(self, kinds: Kinds) -> Ending {
        if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
            let port = self.ports.first().map_or("PORT", String::as_str);
            let reason = format!(
                "`dimsart top` is for a terminal (over SSH: `ssh -t`); `dimsart connect {port}` prints the same, \
                 `--json` for a program"
            );
            return Err(UsageError(reason).into());
        }
        let stop = stop_on_interrupt()?;
        let ports = match self.ports {
            named if !named.is_empty() => named,
            _ => broker::shared_ports()?,
        };
        if ports.is_empty() {
            return Err("no port is shared: start `dimsart serve [RIG or PORT]`, or name one, \
                        `dimsart top PORT`"
                .into());
        }
        let stations = (0..).zip(&ports).map(|(number, port)| station(number, None, port, self.baud, kinds));
        top::run(stations.collect::<Result<_, _>>()?, &stop)?;
        Ok(ExitCode::SUCCESS)
    }
}
