//! `dimsart top`: the page for a terminal.

use std::io::{self, IsTerminal};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::protocol::DEFAULT_BAUD;

use super::run::stop_on_interrupt;
use super::serve::PORT_TICKS;
use super::{Ending, UsageError};
use crate::broker::{self, SIMULATED};
use crate::connect::{ConnectError, Device, Patience};
use crate::page::{Access, OpenLine, Station};
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
    pub(super) fn execute(self) -> Ending {
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
        let stations = (0..).zip(&ports).map(|(number, port)| station(number, port, self.baud));
        top::run(stations.collect::<Result<_, _>>()?, &stop)?;
        Ok(ExitCode::SUCCESS)
    }
}

/// A station that is there now: one that goes later is waited for.
fn station(number: u8, port: &str, baud: u32) -> Result<Station, String> {
    let is_wrong = |error: ConnectError| format!("{port}: {error}");
    let line = broker::open(port, baud).map_err(|error| is_wrong(error.into()))?;
    let name = Device::greet(line, Patience::default()).map_err(is_wrong)?.identity().device.clone();
    let every_ticks = if port.starts_with(SIMULATED) { 1 } else { PORT_TICKS };
    let open: OpenLine = Box::new({
        let port = port.to_owned();
        move || Ok(broker::open(&port, baud)?)
    });
    let access = Access { open, every_ticks, hand: None, is_exclusive: false };
    Station::new(number, &name, access).map_err(|error| format!("{port}: {error}"))
}
