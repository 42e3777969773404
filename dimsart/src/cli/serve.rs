//! `dimsart serve`: has a port, or simulates what is behind one, and lets everybody in.

use std::error::Error;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::sync::mpsc::Sender;

use clap::Args;
use dimsart_core::Kinds;
use dimsart_link::protocol::DEFAULT_BAUD;

use super::run::stop_on_interrupt;
use super::station::line_baud;
use super::{Ending, UsageError};
use crate::broker::{self, SIMULATED, SharedPort};
use crate::connect::ConnectError;
use crate::page::{Access, Hand, OpenLine, Page, Station};
use crate::report::{RunFacts, SignalsFile, SignalsFormat};
use crate::rig_argument;
use hil_sim::clock;
use hil_sim::response::{Hold, LiveRig};
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::suggestion;

/// What is simulated when nothing is named.
const DEFAULT_RIG: &str = "joint";

/// Simulate a rig in real time, or have a board's port, for a page in the browser and any number of `dimsart connect`.
///
/// The page shows schemes, modules and signals, tunes them, and lets devices move. A simulated controller is what a board is:
/// `dimsart connect sim:NAME` does the same from a terminal. The rig's experiment starts when all controllers are armed,
/// and repeats.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Serve {
    /// A rig, shipped or a file of your own, or a port: `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`.
    #[arg(value_name = "RIG|PORT", default_value = DEFAULT_RIG)]
    what: PathBuf,
    /// Bits per second of a serial port.
    #[arg(long, default_value_t = DEFAULT_BAUD)]
    baud: u32,
    /// Where on this computer the page is, 0 for any port that is free; 8060, or a free one, when left out.
    #[arg(long, value_name = "PORT")]
    page_port: Option<u16>,
    /// Records every tick of a rig's controllers into this folder, with all that goes into them, from the first one on: what
    /// `dimsart replay` takes.
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// Where what is recorded from the page goes, each into a folder of its own.
    #[arg(long, value_name = "FOLDER", default_value = "runs/page")]
    recordings: PathBuf,
    /// Speed of a rig's time, such as 0.1 for slow motion.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Serves no page.
    #[arg(long, conflicts_with = "page_port")]
    no_page: bool,
}

/// Clients renew their leases by the computer's time: a faster rig would end them.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse().ok().filter(|speed| (0.01..=1.0).contains(speed));
    speed.ok_or_else(|| "not a number from 0.01 to 1".to_owned())
}

/// Where the page is when nothing is said.
const PAGE_PORT: u16 = 8060;

const EXAMPLES: &str = "\
Examples:
  dimsart serve                                       a joint with motor, gear and load, as sim:joint
  dimsart connect sim:joint arm                       lets it move, from another terminal
  dimsart connect sim:joint watch --arm               the same, and shows how it goes
  dimsart connect sim:joint stop                      from anybody, always
  dimsart serve three                                 three controllers: sim:master, sim:left, sim:right
  dimsart serve joint --record runs/tuning            and every tick of it into runs/tuning/signals.mcap
  dimsart serve /dev/ttyACM0                          keeps a board's port, for many clients";

impl Serve {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let name = self.what.to_string_lossy();
        let is_file = self.what.extension().is_some_and(|extension| extension == "toml");
        let is_port = !is_file && (name.contains([':', '/', '\\']) || name.starts_with("COM"));
        if is_port {
            if self.record.is_some() {
                let reason = "--record is for a rig, whose controllers run here; `dimsart record PORT` records what a port says";
                return Err(UsageError(reason.to_owned()).into());
            }
            self.share(&name, kinds, out)?;
        } else {
            self.simulate(&rig_argument::read(Some(&self.what), &[], kinds)?, out)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn share(&self, port: &str, kinds: Kinds, out: &mut impl Write) -> Result<(), Box<dyn Error>> {
        let stop = stop_on_interrupt()?;
        let mut line = broker::open(port, self.baud).map_err(ConnectError::from)?;
        writeln!(out, "{port} is shared until Ctrl-C: dimsart connect {port}")?;
        let page = self.page(&[(port.to_owned(), port.to_owned())], None, kinds, out)?;
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
        let references = (0..ports.len()).map(|station| live.references(station)).collect();
        let page = self.page(&ports, Some((live.hand(), references)), file.kinds, out)?;
        live.run(&stop, |news| eprintln!("dimsart: {news}"));
        end(page.as_ref(), out)?;
        if let Some(recording) = recording {
            writeln!(out, "recorded: {}", recording.finish()?.display())?;
        }
        Ok(())
    }

    /// Serves the page of controllers, each with its name and port, and says where it is.
    fn page(
        &self,
        ports: &[(String, String)],
        hand: Option<(Sender<Hold>, Vec<Vec<String>>)>,
        kinds: Kinds,
        out: &mut impl Write,
    ) -> Result<Option<Page>, Box<dyn Error>> {
        if self.no_page {
            out.flush()?;
            return Ok(None);
        }
        let listener = match (self.page_port, Page::listen(self.page_port.unwrap_or(PAGE_PORT))) {
            (None, Err(error)) if error.kind() == ErrorKind::AddrInUse => Page::listen(0),
            (_, listener) => listener,
        };
        let listener =
            listener.map_err(|error| format!("no page: {error}; try another --page-port, or 0"))?;
        let stations = (0..).zip(ports).map(|(number, (name, port))| {
            let (at, bits) = (port.clone(), self.baud);
            let open: OpenLine = Box::new(move || Ok(broker::open(&at, bits)?));
            let hand = hand.clone().map(|(hand, references)| -> Hand {
                let station = usize::from(number);
                let known = references.get(station).cloned().unwrap_or_default();
                Box::new(move |signal, axis, value| {
                    let reference = format!("{signal}[{axis}]");
                    if !known.contains(&reference) {
                        return Err(format!(
                            "no reference {reference} to hold; {}",
                            suggestion(&reference, &known)
                        ));
                    }
                    // The rig ends with the page.
                    let _ = hand.send(Hold { station, signal, axis, value });
                    Ok(())
                })
            });
            let (port, baud) = (port.clone(), line_baud(port, bits));
            let recordings = Some(self.recordings.clone());
            Station::new(number, name, Access { port, open, kinds, baud, hand, recordings })
        });
        let page = Page::serve(stations.collect::<Result<_, _>>()?, listener)?;
        writeln!(out, "page: {}", page.url())?;
        out.flush()?;
        Ok(Some(page))
    }
}

/// Ends what is recorded from the page.
fn end(page: Option<&Page>, out: &mut impl Write) -> io::Result<()> {
    page.map(Page::end_recordings).unwrap_or_default().iter().try_for_each(|text| writeln!(out, "{text}"))
}

/// Has a rig recorded into a folder.
fn record(live: &mut LiveRig, file: &RigFile, folder: &Path) -> Result<SignalsFile, Box<dyn Error>> {
    let facts = RunFacts::new(file.to_toml(), live.rig_mut()).in_real_time();
    let (recording, listener) = SignalsFile::create(folder, &[], SignalsFormat::Mcap(facts))?;
    live.tell(listener)?;
    Ok(recording)
}
