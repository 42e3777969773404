//! A station for a port on the command line.

use dimsart_core::ModuleKinds;

use crate::broker::{self, SIMULATED};
use crate::connect::{ConnectError, Device, Timeouts};
use crate::page::{Access, OpenLine, Station};

/// Connects to a station, named `name` or as its device. If it disconnects later, it is reconnected.
pub(super) fn station(
    number: u8,
    name: Option<String>,
    port: &str,
    baud: u32,
    kinds: ModuleKinds,
) -> Result<Station, String> {
    let is_wrong = |error: ConnectError| format!("{port}: {error}");
    let line = broker::open(port, baud).map_err(|error| is_wrong(error.into()))?;
    let device = Device::identify(line, Timeouts::default(), kinds).map_err(is_wrong)?;
    let name = name.unwrap_or_else(|| device.identity().device.clone());
    let open: OpenLine = Box::new({
        let port = port.to_owned();
        move || Ok(broker::open(&port, baud)?)
    });
    let baud = line_baud(port, baud);
    let access =
        Access { port: port.to_owned(), open, kinds, baud, hand: None, geometry: None, recordings: None };
    Station::new(number, &name, access).map_err(|error| format!("{port}: {error}"))
}

/// Baud rate of a port; none for a simulated controller.
pub(super) fn line_baud(port: &str, baud: u32) -> Option<u32> {
    (!port.starts_with(SIMULATED)).then_some(baud)
}
