//! `dimsart top`: monitors and tunes controllers in the terminal.

use std::io::{self, IsTerminal};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::run::stop_on_interrupt;
use super::station::station;
use super::{Ending, UsageError};
use crate::broker;
use crate::top;

/// Monitor, tune and move controllers in the terminal.
///
/// Shows state, first fault and lease; modules with parameters; signals, with a chart of one signal over the last 10 s; events. A
/// parameter with `*` differs from its default. On terminals below 72 columns, or with fewer than 12 free lines, one panel
/// is shown at a time. `NO_COLOR` disables colours. Of a board, every 4th tick is shown.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{KEYS}"))]
pub(super) struct Top {
    /// Ports (default: all ports shared by programs of this user, such as `dimsart serve`).
    ///
    /// `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` of `dimsart serve`.
    #[arg(value_name = "PORT")]
    ports: Vec<String>,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart top                                 all shared ports, such as the ports of `dimsart serve`
  dimsart top sim:joint                       the simulated joint of `dimsart serve`
  dimsart top /dev/ttyACM0 /dev/ttyACM1       two boards
  ssh -t robot dimsart top                    run on a robot's computer";

const KEYS: &str = "\
Keys:
  Space          STOP all stations shown and release their leases, also while typing; `s` also does so, except while typing
  a, d           arm (asks for confirmation), disarm. Motion ends within 0.7 s if the terminal closes or does not keep up
  c, r           check (STARTS a stopped scheme if the scheme matches), reset; only while this terminal does not hold the lease
  1 … 9, Tab     select a station
  Left, Right    select the panel: modules, signals, chart or events
  Up, Down, PgUp, PgDn, Home, End   select a line
  Enter          edit the selected parameter; if the device refuses the value, the reason is shown
  /              filter by name; Esc ends the filter
  ?              list the keys
  q, Ctrl-C      release the lease and quit";

impl Top {
    pub(super) fn execute(self, kinds: ModuleKinds) -> Ending {
        if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
            let port = self.ports.first().map_or("PORT", String::as_str);
            let reason = format!(
                "`dimsart top` needs a terminal (over SSH: `ssh -t`); without a terminal, use `dimsart connect {port}`, \
                 with `--json` for programs"
            );
            return Err(UsageError(reason).into());
        }
        let stop = stop_on_interrupt()?;
        let ports = match self.ports {
            named if !named.is_empty() => named,
            _ => broker::shared_ports()?,
        };
        if ports.is_empty() {
            return Err("no shared port found: start `dimsart serve [RIG or PORT]`, or give a port: \
                        `dimsart top PORT`"
                .into());
        }
        let stations = (0..).zip(&ports).map(|(number, port)| station(number, None, port, self.baud, kinds));
        top::run(stations.collect::<Result<_, _>>()?, &stop)?;
        Ok(ExitCode::SUCCESS)
    }
}
