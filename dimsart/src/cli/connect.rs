//! `dimsart connect`: inspects and changes a controller over a serial port or a socket.

mod answer;
mod capture;
mod live;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use dimsart_core::ModuleKinds;

use answer::{Json, KeyState, Look, SchemeRows, SentFile, write_recorded};

use super::Ending;
use super::law;
use super::line::{self, Device, LineOptions};
use hil_sim::schemes::SchemeText;

/// Inspect, tune and change a controller while it runs.
///
/// Each command prints its result and whether the scheme commands the device now; if not, also the reason. A device moves
/// only while a client holds its lease (`arm`); meanwhile other clients can only read and `stop`. Up to 64 programs of one
/// user can share a port: the first program forwards the requests of the others; when it ends, another program takes over.
/// The programs may use different names of the port, such as a link in /dev/serial/by-id. Names, ranges, choices and units
/// come from the device.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Connect {
    /// Port, such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH` or `sim:NAME`.
    ///
    /// `sim:NAME` is a controller simulated by `dimsart serve`.
    port: String,
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    line: LineOptions,
    #[command(flatten)]
    json: Json,
}

const EXAMPLES: &str = "\
Examples:
  dimsart connect /dev/ttyACM0                                    show identity, state, modules and signals
  dimsart connect sim:joint                                       show a controller of `dimsart serve joint`
  dimsart connect /dev/ttyACM0 set PDCTRL_MOD K_PARAM[0] 500      set a gain of axis 0
  dimsart connect /dev/ttyACM0 scheme my.scheme --side slave      send a scheme, applied atomically
  dimsart connect /dev/ttyACM0 scheme > its.scheme                save the running scheme as rows
  dimsart connect /dev/ttyACM0 begin                              open a transaction: `off`, `on` and `set` apply at `commit`
  dimsart connect /dev/ttyACM0 law upload spring.law              upload a control law, without a restart
  dimsart connect /dev/ttyACM0 arm                                enable motion until Ctrl-C
  dimsart connect /dev/ttyACM0 save                               save on trial; then restart the device and `confirm`
  dimsart connect /dev/ttyACM0 key set robot.key                  lock a board: later calls need --key-file robot.key
  dimsart connect tcp:localhost:4000 watch POSITION FORCE         show live values of an emulated board
  dimsart connect tcp:localhost:4000 recorder --out rows.csv      read the rows of a recorder
  dimsart connect /dev/ttyACM0 capture FORCE --above 5            record every tick around an edge
  dimsart connect tcp:localhost:4000 faults --json                print faults for programs
  dimsart connect /dev/ttyACM0 events                             print the event log, also from before the last restart

Exit status: 0 success, 1 refused, faults found or no answer, 2 wrong usage.";

const TRANSACTION: &str = "\
Example: replace the controller of an actuator:
  dimsart connect PORT begin
  dimsart connect PORT off PDCTRL_MOD
  dimsart connect PORT set PIDCTRL_MOD K_PARAM 3000
  dimsart connect PORT on PIDCTRL_MOD --before TIMEDELAY_MOD
  dimsart connect PORT commit

Until `commit` the running scheme continues unchanged. `show`, `get` and `check` report the pending scheme; `stop` and
`reset` act on the running scheme. `save` is refused. The transaction belongs to the board: any client that may change the
scheme can commit or abort it.

`commit` checks the whole scheme: providers of all types, units, order, links, memory and time. If `commit` is refused, all
faults are listed, nothing changes, and the transaction stays open for corrections; `abort` drops the transaction. `commit`
needs memory for both schemes.

A module that is in both schemes keeps its state, also at a new position and with new parameters. It restarts if its ports,
memory or link change. A new module avoids a step of the command if possible: PIDCTRL_MOD starts with the integral, and
PDCTRL_MOD with the force, that continue the last command. A law without memory, such as a table or a sum, applies its
output at once. To ramp the output, plug in LIMIT_MOD with RATE after the law, in the same transaction. The safety stage
always limits the rate of the device's inputs.

The corresponding rows of a scheme file are `MOD_ENG BEGIN`, `COMMIT` and `ABORT`. If no scheme runs, `MATCHING_CHECK`
between these rows starts the scheme at the commit. Omit all these rows from a file for `scheme FILE`, which sends the file
as one transaction.";

const RECORDER: &str = "\
Column `row` counts from 0. Every other column is named by signal, index and unit: `POSITION[0] (m)` for axis 0,
`INERTIA[0][1]` for row 0 and column 1. A switch is 0 or 1. The number of rows is printed on standard error. Rows that are
overwritten while they are read are skipped and counted. The row counter wraps after 2^32 rows. `dimsart run` writes the
rows of every recorder of a simulated controller as recorder_CONTROLLER_RECORDER_MOD.csv, except on an emulated board.";

const CAPTURE: &str = "\
Example:
  dimsart connect /dev/ttyACM0 capture FORCE --above 5 --before 200 --after 50 --out hit.csv

A recorder on the device checks for the edge in every tick. `capture` then reads the rows and removes the recorder. A signal
that is already above the level does not trigger. Start `capture` before `arm`: while another client holds the lease, the
scheme cannot change. The recorder then stays plugged in, and a note reports this. To capture by hand, plug in RECORDER_MOD
with TRIGGER, LEVEL, WORD and AFTER; `reset RECORDER_MOD` rearms the trigger.";

#[derive(Debug, Subcommand)]
enum Action {
    /// Show identity, state, modules, parameters and signals (the default).
    Show,
    /// Print value, unit and range of a parameter.
    Get {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
        /// Parameter, such as `K_PARAM`, or `K_PARAM[0]` for one axis.
        parameter: String,
    },
    /// Set a parameter or bind a port, and print the value in force.
    Set {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
        /// Parameter, such as `K_PARAM` or `K_PARAM[0]`, or port, such as `PORT_FORCE`.
        parameter: String,
        /// Value, as in a scheme.
        #[arg(allow_negative_numbers = true)]
        value: String,
    },
    /// Plug in a module after all other modules.
    On {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
        /// Insert the module before this module instead.
        #[arg(long, value_name = "MODULE")]
        before: Option<String>,
    },
    /// Unplug a module; it keeps its parameters.
    Off {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
    },
    /// Reset the state of a module, or of all modules; parameters stay.
    Reset {
        /// Module (default: all plugged-in modules).
        module: Option<String>,
    },
    /// Reset the parameters of an unplugged module to their defaults.
    Init {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
    },
    /// Remove a module, or STOP THE SCHEME AND REMOVE ALL MODULES.
    Close {
        /// Module (default: all).
        module: Option<String>,
    },
    /// Open a transaction: later changes take effect together at `commit`.
    #[command(after_long_help = TRANSACTION)]
    Begin,
    /// Apply all changes of the transaction, between two ticks.
    ///
    /// If the scheme does not match, nothing changes and every fault is listed.
    #[command(after_long_help = TRANSACTION)]
    Commit,
    /// Drop all changes of the transaction.
    Abort,
    /// Check the scheme and START IT if it matches; exit status 1 if it does not match.
    Check,
    /// ENABLE MOTION until Ctrl-C: take and renew the lease.
    ///
    /// The lease lasts 200 ms and is renewed until Ctrl-C; then outputs go to their safe value.
    Arm,
    /// Stop the scheme and release the lease: outputs at their safe value.
    ///
    /// Every client may stop at any time; `stop` is sent before all other requests. Afterwards, motion needs `arm` again.
    Stop,
    /// List faults of the scheme and of its ticks; exit status 1 if there are faults.
    Faults,
    /// Print the event log with ticks, also from before the last restart.
    Events,
    /// Send a scheme file, or print the scheme of the device.
    ///
    /// A file is sent as one transaction: all rows take effect together, or none. The running scheme continues meanwhile.
    Scheme {
        /// Scheme file, or built-in scheme such as `builtin:bilateral`.
        #[arg(requires = "side")]
        file: Option<String>,
        /// Side of the rows to send or to print (default for printing: `all`).
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Replace the device's scheme instead of adding to it.
        #[arg(long, requires = "file")]
        replace: bool,
    },
    /// Save the scheme ON TRIAL: it runs at the next start only.
    ///
    /// `confirm` after that start makes the saved scheme permanent.
    Save,
    /// Make the scheme on trial permanent, after it has run at a start.
    Confirm,
    /// Drop the scheme on trial: the next start runs the previous scheme.
    Rollback,
    /// Upload, list or remove control laws written as text.
    #[command(subcommand)]
    Law(LawAction),
    /// Lock the board with a key, or unlock it.
    #[command(subcommand)]
    Key(KeyAction),
    /// Print the rows of a recorder as CSV, oldest first, without stopping the recorder.
    #[command(after_long_help = RECORDER)]
    Recorder {
        /// Recorder, such as `RECORDER_MOD.2` (default: the only recorder).
        recorder: Option<String>,
        /// Write the rows to this file.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Record every tick around an edge ON THE DEVICE, and print it as CSV.
    #[command(after_long_help = CAPTURE)]
    Capture(capture::CaptureArguments),
    /// Show signals live, until Ctrl-C.
    Watch {
        /// Signals, such as `POSITION` (default: all signals of the Data Base).
        signals: Vec<String>,
        /// Print the values once and exit.
        #[arg(long)]
        once: bool,
        /// ENABLE MOTION while watching, as `arm` does.
        #[arg(long, conflicts_with = "once")]
        arm: bool,
        /// Interval between updates, s.
        #[arg(long, value_name = "SECONDS", default_value = "0.2", value_parser = line::seconds)]
        period_s: Duration,
    },
}

#[derive(Debug, Subcommand)]
enum LawAction {
    /// Compile a law and upload it to the device.
    ///
    /// The running scheme does not change: plug the law in with `set ONLINE_MOD PROGRAM NUMBER` and `on ONLINE_MOD`.
    Upload {
        /// Law file, as for `dimsart law check FILE`.
        file: PathBuf,
        /// Number of the law on the device (default: the first free number).
        #[arg(long)]
        number: Option<u8>,
    },
    /// List the laws on the device, with their parameter names on the device.
    List,
    /// Remove a law that no module uses.
    Remove {
        /// Number of the law.
        number: u8,
    },
}

#[derive(Debug, Subcommand)]
enum KeyAction {
    /// Lock the board: from now on, changes and motion need --key-file FILE.
    ///
    /// The key also authenticates the board's links. If the key is lost, erase the board's flash.
    Set {
        /// Key file with 32 hexadecimal digits: `(umask 077; openssl rand -hex 16 > FILE)`.
        file: PathBuf,
    },
    /// Remove the key: every client may change the board, and links are not authenticated.
    Clear,
}

impl Connect {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let mut device = self.line.open(&self.port, kinds)?;
        let is_well = self.action.unwrap_or(Action::Show).execute(&mut device, &self.json, out)?;
        Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

impl Action {
    /// Runs the action. Returns false if it found faults.
    fn execute(
        self,
        device: &mut Device,
        json: &Json,
        out: &mut impl Write,
    ) -> Result<bool, Box<dyn std::error::Error>> {
        match self {
            Self::Show => json.print(out, &device.overview()?)?,
            Self::Get { module, parameter } => json.print(out, &device.get(&module, &parameter)?)?,
            Self::Set { module, parameter, value } => {
                json.print(out, &device.set(&module, &parameter, &value)?)?;
            }
            Self::On { module, before } => json.print(out, &device.plug_in(&module, before.as_deref())?)?,
            Self::Off { module } => json.print(out, &device.unplug(&module)?)?,
            Self::Stop => json.print(out, &device.stop()?)?,
            Self::Reset { module } => json.print(out, &device.reset(module.as_deref())?)?,
            Self::Init { module } => json.print(out, &device.reset_parameters(&module)?)?,
            Self::Close { module } => json.print(out, &device.delete_module(module.as_deref())?)?,
            Self::Begin => json.print(out, &device.begin()?)?,
            Self::Commit => json.print(out, &device.commit()?)?,
            Self::Abort => json.print(out, &device.abort()?)?,
            Self::Arm => live::arm(device, json, out)?,
            Self::Check => {
                let check = device.check()?;
                json.print(out, &check)?;
                return Ok(check.faults == 0);
            }
            Self::Events => json.print(out, &device.events()?)?,
            Self::Faults => {
                let faults = device.faults()?;
                json.print(out, &faults)?;
                return Ok(faults.is_valid());
            }
            Self::Scheme { file: None, side, .. } => {
                let rows = device.scheme_rows(side)?;
                json.print(out, &SchemeRows { rows })?;
            }
            Self::Scheme { file: Some(file), side, replace } => {
                let side = side
                    .ok_or("--side is missing: add --side to select the rows of the scheme file to send")?;
                let scheme = SchemeText::read(&file)?;
                let sent = match replace {
                    true => device.replace_scheme(&scheme, side)?,
                    false => device.send_scheme(&scheme, side)?,
                };
                json.print(out, &SentFile { file, side, sent })?;
            }
            Self::Save => json.print(out, &device.save()?)?,
            Self::Confirm => json.print(out, &device.confirm()?)?,
            Self::Rollback => json.print(out, &device.roll_back()?)?,
            Self::Law(LawAction::Upload { file, number }) => {
                json.print(out, &device.upload_law(&law::read(&file)?, number)?)?;
            }
            Self::Law(LawAction::List) => json.print(out, &device.laws()?)?,
            Self::Law(LawAction::Remove { number }) => json.print(out, &device.remove_law(number)?)?,
            Self::Key(KeyAction::Set { file }) => {
                json.print(out, &KeyState { key: device.set_key(&line::read_key(&file)?)? })?;
            }
            Self::Key(KeyAction::Clear) => json.print(out, &KeyState { key: device.clear_key()? })?,
            Self::Recorder { recorder, out: file } => {
                write_recorded(&device.read_recorder(recorder.as_deref())?, file.as_deref(), json, out)?;
            }
            Self::Capture(arguments) => return capture::capture(arguments, device, json, out),
            Self::Watch { signals, once: true, .. } => {
                json.print(out, &Look { live: None, signals: device.signals(&signals)? })?;
            }
            Self::Watch { signals, period_s, arm, .. } => {
                live::watch(device, &signals, period_s, arm, json, out)?;
            }
        }
        Ok(true)
    }
}
