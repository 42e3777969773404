//! `dimsart serve`: simulates controllers or opens a board's port, for a web page and several clients.

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::iter;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;

use clap::Args;
use dimsart_core::ModuleKinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::run::stop_on_interrupt;
use super::station::line_baud;
use super::{Ending, UsageError};
use crate::broker::{self, SIMULATED, SharedPort};
use crate::connect::ConnectError;
use crate::page::{Access, OpenLine, Page, ReferenceOverrideFn, Station};
use crate::report::{RunMetadata, SignalsFile, SignalsFormat};
use crate::rig_argument;
use hil_sim::clock;
use hil_sim::response::{LiveRig, ReferenceOverride};
use hil_sim::rig_file::{Geometry, RigFile};
use hil_sim::schemes::suggestion;

/// Default rig.
const DEFAULT_RIG: &str = "joint";

/// Simulate a rig in real time, or share a board's port, and serve a web page.
///
/// Each simulated controller is a port, sim:NAME, which `dimsart connect` uses like a board's port. The experiment of the
/// rig starts when all controllers of the rig are armed, and repeats without a jump. While a controller is disarmed, its
/// position reference follows the measured position; after arming, the reference approaches the experiment at up to 1 rad/s
/// or 0.1 m/s. Forces are limited to the motors' maximum. If the computer stalls, the rig skips the stalled time, so that
/// leases do not expire in a burst of ticks, and reports the skipped time. If an axis leaves its range, the rig moves
/// the axis back to its start and ends the lease.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{PAGE}"))]
pub(super) struct Serve {
    /// Shipped rig, rig file, or port: `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`.
    #[arg(value_name = "RIG|PORT", default_value = DEFAULT_RIG)]
    what: PathBuf,
    /// Baud rate of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
    /// TCP port of the page on this computer (default: 8060; 0: any free port).
    #[arg(long, value_name = "PORT")]
    page_port: Option<u16>,
    /// Record every tick of a rig, with all inputs, for `dimsart replay`.
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// Folder of recordings started from the page; each recording gets a sub-folder.
    #[arg(long, value_name = "FOLDER", default_value = "runs/page")]
    recordings: PathBuf,
    /// Simulated time per real time, 0.01 to 1, such as 0.1 for slow motion.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Do not serve a page.
    #[arg(long, conflicts_with = "page_port")]
    no_page: bool,
}

/// Parses the speed. Above 1, leases would expire: clients renew them in real time.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.01..=1.0).contains(speed));
    speed.ok_or_else(|| "invalid speed: give a number from 0.01 to 1".to_owned())
}

/// Default TCP port of the page.
const PAGE_PORT: u16 = 8060;

const EXAMPLES: &str = "\
Examples:
  dimsart serve                                       a joint with motor, gear and load, as sim:joint
  dimsart connect sim:joint arm                       enable motion, from another terminal
  dimsart connect sim:joint watch --arm               enable motion and show live values
  dimsart connect sim:joint stop                      stop motion, from any client, at any time
  dimsart serve three                                 three controllers: sim:master, sim:left, sim:right
  dimsart serve joint --record runs/tuning            record every tick to runs/tuning/signals.mcap
  dimsart serve /dev/ttyACM0                          share a board's port";

const PAGE: &str = "\
The page (works without internet access):
  State     shows why the scheme does not command the device and the next step; also drive, lease, ticks and first fault. Arm
            takes the lease; other pages can then only read and stop. If the page is closed or hidden, or its computer sleeps,
            motion ends within 0.7 s. STOP (Esc) stops all devices of the page and releases their leases.
  Device    shows measured position (blue), reference and force of each axis. Drag the reference of a simulated axis to hold
            the reference until you release it.
  Robot     shows all simulated devices in 3D: links, reference (yellow), forces (green), walls and hands. Drag a link, a tip
            or a hand to move it; drag the background to turn the view.
  Scheme    shows the types of the Data Base as wires, from writer (filled dot) to readers (ring), and modules in plug-in
            order. The type of a dashed wire is read before it is written in the tick. Faults are red.
  Modules   shows parameters with unit, range and default; changed values are blue. The page collects edits, and the device
            checks them; Apply together applies all edits as one transaction. The transaction unplugs a module to set
            parameters that cannot be set while the module runs.
  Scope     shows signals over up to a minute, also of several controllers: drag a signal to a plot. Trigger (rising, falling
            or either edge, level, share before the edge; auto, normal or single), cursors, math channels, figures of the last
            step, spectrum (Hann), XY; CSV, MCAP and PNG files. Keep stores a trace, Load reads a recording to compare with.
            The address contains the layout of the plots. A simulated controller sends every tick
            of up to 64 signals. A board sends up to 4 signals (12 words) to one client at a time, at a rate that uses a fifth
            of the line (every 4th tick at 1 kHz and 921 600 baud). `remove` and `send` select the signals for all pages.
            Lost ticks are counted and shown as gaps.
  Record    records the signals of the scope to runs/page/NAME-1/signals.mcap (then NAME-2), with exact values and the scheme.
            The server continues to record after the page is closed. A recording ends if a page stops it, the signals change,
            the line fails or `serve` ends; the page then shows the reason. Rows lost on the line or the disk are counted.
  Access    requires the token in the address. The token belongs to this user and changes when the computer restarts; pages of
            other sites have no access. After `serve` has ended, an open page sends its token to any program that opens the
            TCP port: close the page on a shared computer.

Up to 64 clients can share a port, and a page accepts up to 64 connections; beyond this limit, a new client replaces the client
that has been silent longest. One client at a time holds the lease. Requests are served in turn, but `stop` is sent first.";

impl Serve {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let name = self.what.to_string_lossy();
        let is_file = self.what.extension().is_some_and(|extension| extension == "toml");
        let is_port = !is_file && (name.contains([':', '/', '\\']) || name.starts_with("COM"));
        if is_port {
            if self.record.is_some() {
                let reason =
                    "--record applies to simulated rigs only; record a port with `dimsart record PORT`";
                return Err(UsageError(reason.to_owned()).into());
            }
            self.share(&name, kinds, out)?;
        } else {
            self.simulate(&rig_argument::read(Some(&self.what), &[], kinds)?, out)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn share(&self, port: &str, kinds: ModuleKinds, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
        let stop = stop_on_interrupt()?;
        let mut line = broker::open(port, self.baud).map_err(ConnectError::from)?;
        writeln!(out, "{port} is shared until Ctrl-C: dimsart connect {port}")?;
        let page = self.page(&[(port.to_owned(), port.to_owned())], Vec::new(), kinds, out)?;
        let mut buffer = [0; 1024];
        let mut is_there = true;
        while is_there && !stop.load(Ordering::Relaxed) {
            is_there = !matches!(line.read(&mut buffer), Ok(0));
        }
        end(page.as_ref(), out)?;
        let closed = || format!("{port}: {}", crate::connect::LineError::Closed).into();
        is_there.then_some(()).ok_or_else(closed)
    }

    fn simulate(&self, file: &RigFile, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
        if self.speed < 1.0 {
            clock::set_speed(self.speed);
        }
        let stop = stop_on_interrupt()?;
        let (mut live, lines) = LiveRig::new(file)?;
        let recording = self.record.as_deref().map(|folder| record(&mut live, file, folder)).transpose()?;
        let (mut shared, mut ports) = (Vec::new(), Vec::new());
        for (name, line) in lines {
            let port = format!("{SIMULATED}{name}");
            shared.push(SharedPort::new(&port, Box::new(line))?);
            writeln!(out, "{port} runs until Ctrl-C: dimsart connect {port}")?;
            ports.push((name, port));
        }
        let stations = (0..ports.len()).zip(Geometry::all(file));
        let simulated = stations.map(|(station, geometry)| SimulatedStation {
            hand: live.reference_overrides(),
            references: live.references(station),
            geometry,
        });
        let page = self.page(&ports, simulated.collect(), file.kinds, out)?;
        live.run(&stop, |news| eprintln!("dimsart: {news}"));
        end(page.as_ref(), out)?;
        if let Some(recording) = recording {
            writeln!(out, "recorded: {}", recording.finish()?.display())?;
        }
        Ok(())
    }

    /// Serves the page of controllers, each with its name and port, and prints its address.
    fn page(
        &self,
        ports: &[(String, String)],
        simulated: Vec<SimulatedStation>,
        kinds: ModuleKinds,
        out: &mut impl Write,
    ) -> Result<Option<Page>, Box<dyn Error>> {
        if self.no_page {
            out.flush()?;
            return Ok(None);
        }
        let listener = page_listener(self.page_port)?;
        let simulated = simulated.into_iter().map(Some).chain(iter::repeat_with(|| None));
        let stations = (0..).zip(ports).zip(simulated).map(|((number, (name, port)), simulated)| {
            let (at, bits) = (port.clone(), self.baud);
            let open: OpenLine = Box::new(move || Ok(broker::open(&at, bits)?));
            let (hand, geometry) = match simulated {
                Some(simulated) => (
                    Some(holder(usize::from(number), simulated.hand, simulated.references)),
                    simulated.geometry,
                ),
                None => (None, None),
            };
            let (port, baud) = (port.clone(), line_baud(port, bits));
            let recordings = Some(self.recordings.clone());
            Station::new(number, name, Access { port, open, kinds, baud, hand, geometry, recordings })
        });
        let page = Page::serve(stations.collect::<Result<_, _>>()?, kinds, listener)?;
        writeln!(out, "page: {}", page.url())?;
        out.flush()?;
        Ok(Some(page))
    }
}

/// Opens the TCP port of the page: the given one, the default, or any free port.
pub(super) fn page_listener(port: Option<u16>) -> Result<TcpListener, String> {
    let listener = match (port, Page::listen(port.unwrap_or(PAGE_PORT))) {
        (None, Err(error)) if error.kind() == ErrorKind::AddrInUse => Page::listen(0),
        (_, listener) => listener,
    };
    listener.map_err(|error| {
        format!(
            "cannot open the TCP port of the page: {error}; give another --page-port, or 0 for any free port"
        )
    })
}

/// The simulated device of a station.
struct SimulatedStation {
    /// Holds its references and hands.
    hand: Sender<ReferenceOverride>,
    /// References and hands that can be held.
    references: Vec<String>,
    /// Geometry of the device.
    geometry: Option<Geometry>,
}

/// Holds references of a station.
fn holder(station: usize, hand: Sender<ReferenceOverride>, known: Vec<String>) -> ReferenceOverrideFn {
    Box::new(move |signal, axis, held| {
        let reference = format!("{signal}[{axis}]");
        if !known.contains(&reference) {
            return Err(format!("unknown reference {reference}; {}", suggestion(&reference, &known)));
        }
        // The rig ends with the page.
        let _ = hand.send(ReferenceOverride { station, signal, axis, held });
        Ok(())
    })
}

/// Ends recordings started from the page.
fn end(page: Option<&Page>, out: &mut impl Write) -> io::Result<()> {
    page.map(Page::end_recordings).unwrap_or_default().iter().try_for_each(|text| writeln!(out, "{text}"))
}

/// Starts recording a rig to a folder.
fn record(live: &mut LiveRig, file: &RigFile, folder: &Path) -> Result<SignalsFile, Box<dyn Error>> {
    let facts = RunMetadata::new(file.to_toml(), live.rig_mut()).in_real_time();
    let (recording, listener) = SignalsFile::create(folder, &[], SignalsFormat::Mcap(facts))?;
    live.add_listener(listener)?;
    Ok(recording)
}
