//! `dimsart bridge`: controllers over Zenoh.

use std::io::Write;

use clap::Args;
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::Ending;

/// Publish controllers over Zenoh and accept commands from Zenoh clients.
///
/// Runs until Ctrl-C. If several bridges use one router, give their controllers different names. `JointState` and
/// diagnostics are published in the format of `rmw_zenoh_cpp` (ROS 2); this format was not tested with ROS 2. Zenoh is an
/// optional feature, which adds 152 crates: build with `cargo build --release -p dimsart --features zenoh`. Start a router
/// with `zenohd`, or in ROS 2 with `ros2 run rmw_zenoh_cpp rmw_zenohd`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{REFERENCE}"))]
pub(super) struct Bridge {
    /// Ports of the controllers, each with an optional name (default: the device's name).
    ///
    /// A port is `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` for a controller of a running `dimsart serve`.
    #[arg(value_name = "[NAME=]PORT", required = true)]
    ports: Vec<String>,
    /// Address of the Zenoh router.
    #[arg(long, value_name = "tcp/HOST:PORT", default_value = "tcp/localhost:7447")]
    router: String,
    /// First part of every Zenoh key.
    ///
    /// The keys of a controller start with PREFIX/NAME, such as PREFIX/NAME/state.
    #[arg(long, value_name = "NAME", default_value = "dimsart")]
    prefix: String,
    /// ROS domain of `JointState` and diagnostics (`ROS_DOMAIN_ID`).
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    ros_domain: u32,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
}

const EXAMPLES: &str = "\
Examples:
  dimsart serve joint                                        in another terminal, and a router: zenohd
  dimsart bridge sim:joint                                   publishes dimsart/joint/state, /signals and others
  dimsart bridge left=/dev/ttyACM0 right=/dev/ttyACM1 --prefix robot7 --router tcp/10.0.0.1:7447";

const REFERENCE: &str = r#"Published under PREFIX/NAME/. A query (get) for a key returns its last value.
  state      every 0.1 s     JSON: `live` as in `connect PORT watch --json`; its `state` explains why the device is not
                             commanded, and the next step; `holder`: number of the bridge's client with the lease
  faults     every 2 s       JSON as `connect PORT faults --json`
  events     on change       JSON as `connect PORT events --json`
  overview   on change       JSON as `connect PORT show --json`
  gone       on change       why the device is unreachable, or null
  lost       on loss         JSON: `reason`: why motion ended without a command; not kept for queries
  layout     on change       JSON: `number`, `every_ticks`, `signals` with name, unit and `words`
  signals    every 20 ms     binary, see below: every tick of a simulated controller; of a board, as many
                             ticks as its line can carry
  missed     on overload     number of updates that this computer dropped

A message of `signals` is a sequence of little-endian blocks: layout number, number of rows, values per row (u32 each),
then for each row: tick (u32, wraps) and values (f64, NaN for a sample lost on the line). In numpy:
  frombuffer(bytes, [("tick", "<u4"), ("values", "<f8", width)], rows, 12)
If a tick is not `every_ticks` after the previous tick, rows between them were lost. The last 60 000 rows are kept: a query for
PREFIX/NAME/signals?layout=1;tick=5000 returns the rows after tick 5000, perhaps with some earlier rows, or all kept rows if
tick 5000 is too old. Rows are not resent after a router reconnects. For a complete recording also run `dimsart record`, which
needs no router.

Commands are queries for PREFIX/NAME/command with a JSON payload. The reply is {"done": ...}, or the error {"refused": "why"}.
  {"client": "planner", "do": "arm"}        take the lease; the bridge holds the lease while `planner` renews it
  {"client": "planner", "do": "renew"}      keep the lease: send every 0.1 s; refused once the lease has ended
  {"client": "planner", "do": "disarm"}     release the lease: outputs at their safe value
  {"do": "stop"}                            stop the scheme and release the lease; allowed for every client
  {"client": "planner", "do": "edit", "edit": "set", "module": "SIGGEN_MOD", "parameter": "OFFSET", "value": "0.4"}
                                            set a parameter, here the reference (offset of a generator); `on` and `off` plug modules
  {"client": "planner", "do": "scheme", "rows": "all PIDCTRL_MOD K_PARAM 25\n...", "replace": false}
                                            apply rows of a scheme as one transaction
  check, reset, events, rows, save, confirm, roll_back, recorder (with `name`): same effect as in `dimsart connect`

Motion ends 0.5 s after the last `renew`, at once when the bridge loses the router, and 200 ms after the bridge ends. To
resume motion, send `arm` again. While a client holds the lease, other clients can only read and stop. Without a lease
holder, every client may change the scheme. `client` is a name, not a proof of identity: restrict access with Zenoh's access
control. The bridge uses TCP without TLS.

ROS 2: /PREFIX/NAME/joint_states (sensor_msgs/msg/JointState, every 20 ms: POSITION, VELOCITY and FORCE if present, rad or
m; joint names: NAME for one axis, NAME_0, NAME_1 for several axes) and /diagnostics (diagnostic_msgs/msg/DiagnosticArray,
every 2 s; levels: error for a fault, warning for an earlier fault, stale for an unreachable controller), from node
PREFIX_bridge, in CDR. The Zenoh keys are DOMAIN/TOPIC/TYPE/HASH. A hyphen in a name becomes an underscore. Time stamps are
arrival times on this computer's clock. References come from a Zenoh client, not from a ROS 2 topic.

Example clients: docs/howto/fleet-over-zenoh.md (Python) and dimsart/tests/bridge.rs (Rust)."#;

#[cfg(not(feature = "zenoh"))]
impl Bridge {
    pub(super) fn execute(self, _kinds: ModuleKinds, _out: &mut impl Write) -> Ending {
        Err("this `dimsart` was built without Zenoh: rebuild the command with \
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

    use super::{Bridge, Ending, ModuleKinds, Write};
    use crate::bridge::{self, BridgeAddress};
    use crate::cli::run::stop_on_interrupt;
    use crate::cli::station::station;
    use crate::page::Station;

    /// Interval at which the router is checked.
    const A_MOMENT: Duration = Duration::from_millis(20);

    impl Bridge {
        pub(in crate::cli) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
            let stop = stop_on_interrupt()?;
            let stations = self.ports.iter().map(|port| self.station(port, kinds));
            let stations = stations.collect::<Result<Vec<_>, String>>()?;
            let Self { router, prefix, ros_domain, ports, .. } = self;
            let bridge = bridge::Bridge::open(
                &BridgeAddress { router: router.clone(), prefix, ros_domain },
                stations,
            )?;
            for (port, key) in ports.iter().zip(bridge.keys()) {
                writeln!(out, "{port} is published as {key} at {router} until Ctrl-C")?;
            }
            out.flush()?;
            let mut had_router = true;
            while !stop.load(Ordering::Relaxed) {
                let is_router_connected = bridge.is_router_connected();
                if had_router && !is_router_connected {
                    bridge.release_leases();
                    eprintln!(
                        "dimsart: router {router} disconnected: leases of its clients released, outputs at their safe value"
                    );
                } else if is_router_connected && !had_router {
                    eprintln!("dimsart: router {router} reconnected");
                }
                had_router = is_router_connected;
                thread::sleep(A_MOMENT);
            }
            bridge.release_leases();
            Ok(ExitCode::SUCCESS)
        }

        fn station(&self, text: &str, kinds: ModuleKinds) -> Result<Station, String> {
            let (name, port) = match text.split_once('=') {
                Some((name, port)) => (Some(name.to_owned()), port),
                None => (None, text),
            };
            station(0, name, port, self.baud, kinds)
        }
    }
}
