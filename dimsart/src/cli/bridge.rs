//! `dimsart bridge`: stations over Zenoh.

use std::io::Write;

use clap::Args;
use dimsart_core::Kinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::Ending;

/// Publish stations over Zenoh, and take commands for them from there under the lease, until Ctrl-C.
///
/// A fleet is any number of stations here, and any number of these commands at one router. `JointState` and diagnostics are
/// published as `rmw_zenoh_cpp` of ROS 2 does it, which was not tried with ROS 2. Keys, forms and commands:
/// docs/commands.md, "A fleet over Zenoh". Zenoh is a feature of the build:
/// `cargo build --release -p dimsart --features zenoh`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Bridge {
    /// Stations: ports such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` of a `dimsart serve`; each by its
    /// device's name, or by the one that stands before it.
    #[arg(value_name = "[NAME=]PORT", required = true)]
    ports: Vec<String>,
    /// The router.
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/localhost:7447")]
    router: String,
    /// First part of every key.
    #[arg(long, value_name = "NAME", default_value = "dimsart")]
    prefix: String,
    /// `ROS_DOMAIN_ID` of who reads `JointState` and diagnostics.
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    ros_domain: u32,
    /// Bits per second of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart serve joint                                        in one terminal; and a router: zenohd
  dimsart bridge sim:joint                                   as dimsart/joint/state, /signals, /command and others
  dimsart bridge left=/dev/ttyACM0 right=/dev/ttyACM1 --prefix robot7 --router tcp/10.0.0.1:7447";

#[cfg(not(feature = "zenoh"))]
impl Bridge {
    pub(super) fn execute(self, _kinds: Kinds, _out: &mut impl Write) -> Ending {
        Err("this `dimsart` was built without Zenoh, which takes minutes to build; build it with \
             `cargo build --release -p dimsart --features zenoh`"
            .into())
    }
}

#[cfg(feature = "zenoh")]
mod with_zenoh {
    use std::process::ExitCode;
    use std::sync::atomic::Ordering;
    use std::thread;
    use std::time::Duration;

    use super::{Bridge, Ending, Kinds, Write};
    use crate::bridge::{self, Place};
    use crate::cli::run::stop_on_interrupt;
    use crate::cli::station::station;
    use crate::page::Station;

    /// How soon a router that is gone is seen.
    const A_MOMENT: Duration = Duration::from_millis(20);

    impl Bridge {
        pub(in crate::cli) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
            let stop = stop_on_interrupt()?;
            let stations = self.ports.iter().map(|port| self.station(port, kinds));
            let stations = stations.collect::<Result<Vec<_>, String>>()?;
            let Self { router, prefix, ros_domain, ports, .. } = self;
            let bridge =
                bridge::Bridge::open(&Place { router: router.clone(), prefix, ros_domain }, stations)?;
            for (port, key) in ports.iter().zip(bridge.keys()) {
                writeln!(out, "{port} is {key} at {router} until Ctrl-C")?;
            }
            out.flush()?;
            let mut had_router = true;
            while !stop.load(Ordering::Relaxed) {
                let has_router = bridge.has_router();
                if had_router && !has_router {
                    bridge.let_go();
                    eprintln!(
                        "dimsart: the router at {router} is gone: what was moved from there is at rest"
                    );
                } else if has_router && !had_router {
                    eprintln!("dimsart: the router at {router} is there again");
                }
                had_router = has_router;
                thread::sleep(A_MOMENT);
            }
            bridge.let_go();
            Ok(ExitCode::SUCCESS)
        }

        fn station(&self, text: &str, kinds: Kinds) -> Result<Station, String> {
            let (name, port) = match text.split_once('=') {
                Some((name, port)) => (Some(name.to_owned()), port),
                None => (None, text),
            };
            station(0, name, port, self.baud, kinds)
        }
    }
}
