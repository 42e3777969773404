//! `dimsart connect`: talks to a controller over a serial port or a socket.

mod answer;
mod capture;
mod live;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, Subcommand};
use dimsart_core::Kinds;

use answer::{Json, KeyState, Look, SchemeRows, SentFile, write_recorded};

use super::Ending;
use super::law;
use super::line::{self, Device, LineOptions};
use hil_sim::schemes::SchemeText;

/// Talk to a controller: look at it, tune it, change its scheme while it runs.
///
/// Names, ranges, choices and which unit a number has are the device's own. Help texts, of the modules that it knows, and
/// the symbols of units are this program's.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Connect {
    /// Serial port such as `/dev/ttyACM0`, `tcp:HOST:PORT`, `unix:PATH`, or `sim:NAME` of a `dimsart serve`.
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
  dimsart connect /dev/ttyACM0                                    identity, state, modules, signals
  dimsart connect sim:joint                                       the same of a controller of `dimsart serve joint`
  dimsart connect /dev/ttyACM0 set PDCTRL_MOD K_PARAM[0] 500      one gain of axis 0; prints what holds now
  dimsart connect /dev/ttyACM0 scheme my.scheme --side slave      a whole scheme, in force at once or not at all
  dimsart connect /dev/ttyACM0 scheme > its.scheme                what it has now, as rows
  dimsart connect /dev/ttyACM0 begin                              then `off`, `on`, `set` and `commit`: one change
  dimsart connect /dev/ttyACM0 law upload spring.law              a control law as text, without a restart
  dimsart connect /dev/ttyACM0 arm                                lets the device be moved until Ctrl-C
  dimsart connect /dev/ttyACM0 save                               then restart the device and `confirm`
  dimsart connect /dev/ttyACM0 key set robot.key                  locks a board: then give --key-file robot.key
  dimsart connect tcp:localhost:4000 watch POSITION FORCE         live values of an emulated board
  dimsart connect tcp:localhost:4000 recorder --out rows.csv      what a recorder has kept
  dimsart connect /dev/ttyACM0 capture FORCE --above 5            the rows around an edge, each of them
  dimsart connect tcp:localhost:4000 faults --json                what is wrong, for a program; every command takes it
  dimsart connect /dev/ttyACM0 events                             what happened, also before the last restart

A command is answered by what it came to: whether the scheme commands the device now and, if not, why.
A board is moved only while a client holds its lease (`arm`); meanwhile others may look, and `stop`.
Exit status: 0 done, 1 refused, faults found or no answer, 2 wrong usage.";

#[derive(Debug, Subcommand)]
enum Action {
    /// Who it is, its state, modules, parameters and signals; what is done when nothing is asked for.
    Show,
    /// Value, unit and range of a parameter.
    Get {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
        /// Parameter, such as `K_PARAM`, or `K_PARAM[0]` for one axis.
        parameter: String,
    },
    /// Set a parameter or bind a port, and print what holds then.
    Set {
        /// Module, such as `PDCTRL_MOD` or `PDCTRL_MOD.2`.
        module: String,
        /// Parameter, such as `K_PARAM` or `K_PARAM[0]`, or port, such as `PORT_FORCE`.
        parameter: String,
        /// Value, as a scheme would write it.
        #[arg(allow_negative_numbers = true)]
        value: String,
    },
    /// Plug a module in, behind the others.
    On {
        /// Module.
        module: String,
        /// Puts it before this module instead.
        #[arg(long, value_name = "MODULE")]
        before: Option<String>,
    },
    /// Unplug a module; it keeps its parameters.
    Off {
        /// Module.
        module: String,
    },
    /// Forget what a module, or every one, remembers from tick to tick; parameters stay.
    Reset {
        /// Module; all that are plugged in when none is named.
        module: Option<String>,
    },
    /// Bring the parameters of a module that is not plugged in back to their defaults.
    Init {
        /// Module.
        module: String,
    },
    /// Take a module away, or STOP THE SCHEME AND TAKE ALL OF THEM AWAY.
    Close {
        /// Module; all when none is named.
        module: Option<String>,
    },
    /// Open a transaction: changes wait for `commit`, and the scheme runs on meanwhile.
    Begin,
    /// Put all changes of the transaction in force at once, between two ticks; refused, with every reason, when the scheme
    /// does not match.
    Commit,
    /// Drop all changes of the transaction.
    Abort,
    /// Check the scheme and, when it matches, LET IT RUN; 1 when it does not match.
    Check,
    /// LET THE DEVICE BE MOVED by its scheme until Ctrl-C: take the lease that motion needs, and renew it.
    Arm,
    /// Stop the scheme and release the lease: outputs at their safe value. Allowed for every client, at any time.
    Stop,
    /// What is wrong with the scheme and what went wrong in its ticks; changes nothing, 1 when there is something.
    Faults,
    /// The last things that happened, with their ticks, also before the last restart; changes nothing.
    Events,
    /// Send a scheme, in one transaction: all of its rows are in force then, or none. What runs goes on meanwhile. Without a
    /// file, print the rows that build the scheme that is on the device.
    Scheme {
        /// Scheme file, or one that is built in: `builtin:bilateral`.
        #[arg(requires = "side")]
        file: Option<String>,
        /// Side whose rows are sent, or that the printed rows are for; `all` when left out.
        #[arg(long, value_parser = super::side::side())]
        side: Option<&'static str>,
        /// Put it in place of the scheme that is on the device, not upon it.
        #[arg(long, requires = "file")]
        replace: bool,
    },
    /// Keep the scheme as it is now, ON TRIAL: the device's next start runs it, once, unless it is confirmed.
    Save,
    /// Keep the scheme on trial, which the last start has run, for every start.
    Confirm,
    /// Forget the scheme on trial: the next start runs the one that was saved before, or the built-in one.
    Rollback,
    /// Laws that come while the controller runs: upload one, list them, remove one.
    #[command(subcommand)]
    Law(LawAction),
    /// Give the board a key, or take it away: a board that holds one is locked.
    #[command(subcommand)]
    Key(KeyAction),
    /// The rows that a recorder has kept, oldest first, as CSV. Stops nothing.
    Recorder {
        /// Recorder, such as `RECORDER_MOD.2`; the only one when none is named.
        recorder: Option<String>,
        /// Writes the rows to this file.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
    },
    /// Catch a fast event ON THE DEVICE and print the rows around it as CSV: a recorder waits for the edge in every tick,
    /// whatever the line carries. Start it before `arm`: while somebody holds the lease, nobody else changes the scheme.
    Capture(capture::CaptureArguments),
    /// Show signals live, until Ctrl-C.
    Watch {
        /// Signals, such as `POSITION`; all that are in the Data Base when none is named.
        signals: Vec<String>,
        /// Prints them once.
        #[arg(long)]
        once: bool,
        /// LETS THE DEVICE BE MOVED by its scheme meanwhile, as `arm` does.
        #[arg(long, conflicts_with = "once")]
        arm: bool,
        /// Time between two looks, s.
        #[arg(long, value_name = "SECONDS", default_value = "0.2", value_parser = line::seconds)]
        period_s: Duration,
    },
}

#[derive(Debug, Subcommand)]
enum LawAction {
    /// Compile a law and have the device take it. Nothing that runs is touched: plug it in with
    /// `set ONLINE_MOD PROGRAM NUMBER` and `on ONLINE_MOD`.
    Upload {
        /// Law file; `dimsart law check FILE` says what it needs.
        file: PathBuf,
        /// Number that it gets; the first free one when left out.
        #[arg(long)]
        number: Option<u8>,
    },
    /// The laws on the device, and what their parameters are called there.
    List,
    /// Have the device forget a law that no module has.
    Remove {
        /// Its number.
        number: u8,
    },
}

#[derive(Debug, Subcommand)]
enum KeyAction {
    /// Give it the key in FILE. FROM THEN ON it takes what changes or moves it with --key-file alone, and its links
    /// are authenticated. Losing the key means to erase the board's flash.
    Set {
        /// 32 hexadecimal digits, such as `(umask 077; openssl rand -hex 16 > FILE)` writes.
        file: PathBuf,
    },
    /// Have it forget its key: it is open then, and authenticates nothing.
    Clear,
}

impl Connect {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let mut device = self.line.open(&self.port, kinds)?;
        let is_well = self.action.unwrap_or(Action::Show).execute(&mut device, &self.json, out)?;
        Ok(if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

impl Action {
    /// False when what was asked for is there and is not well.
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
            Self::On { module, before } => json.print(out, &device.on(&module, before.as_deref())?)?,
            Self::Off { module } => json.print(out, &device.off(&module)?)?,
            Self::Stop => json.print(out, &device.stop()?)?,
            Self::Reset { module } => json.print(out, &device.reset(module.as_deref())?)?,
            Self::Init { module } => json.print(out, &device.init(&module)?)?,
            Self::Close { module } => json.print(out, &device.close(module.as_deref())?)?,
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
                return Ok(faults.is_sound());
            }
            Self::Scheme { file: None, side, .. } => {
                let rows = device.scheme_rows(side)?;
                json.print(out, &SchemeRows { rows })?;
            }
            Self::Scheme { file: Some(file), side, replace } => {
                let side = side.ok_or("--side says whose rows of the file are sent")?;
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
                write_recorded(&device.recorded(recorder.as_deref())?, file.as_deref(), json, out)?;
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
