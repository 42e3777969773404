//! `dimsart commission`: checks a board over its line and writes a report.

use std::error::Error;
use std::io::{self, IsTerminal as _, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use chips::{Bench, Board, SharedBoard};
use clap::Args;
use dimsart_core::ModuleKinds;
use serde::Deserialize;

use super::line::{Device, LineOptions};
use super::{Ending, UsageError};
use crate::budget;
use crate::commissioning::{
    BoardEnvironment, Check, HostComputer, LockedRotor, Report, Step, examine, observe_ticks,
    save_and_restart,
};
use crate::connect::{self, Timeouts};
use crate::cycles::Firmware;
use crate::report;

/// Check a board over its line and write a report in Markdown and JSON.
///
/// Runs the checks of `dimsart doctor --board` and watches ticks for 10 s. With --restart or --emulated, saves the board's
/// scheme on trial and confirms the scheme over two restarts. With --locked-rotor, applies a torque step. `cargo xtask
/// silicon BOARD` flashes the board first, then runs this command. Exit status: 0 all checks passed, 1 a check failed.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Commission {
    /// Expected board, such as nucleo-g474re.
    board: String,
    /// Port of the board: a serial port such as /dev/ttyACM0, or a socket.
    #[arg(long, required_unless_present = "emulated", conflicts_with = "emulated")]
    port: Option<String>,
    /// Check an emulated chip with this image (ELF) instead of a board.
    ///
    /// Default: the image built by `cargo board BOARD`.
    #[arg(long, value_name = "ELF", num_args = 0..=1)]
    emulated: Option<Option<PathBuf>>,
    /// Command that restarts the board; without this option, saving a scheme is not checked.
    ///
    /// For example `probe-rs reset --chip STM32G474RETx`.
    #[arg(long, value_name = "COMMAND", conflicts_with = "emulated")]
    restart: Option<String>,
    /// Duration of the check of ticks, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0)]
    seconds: f64,
    /// MOVES THE MOTOR: apply a torque step to a locked rotor, after confirmation.
    ///
    /// The step lasts less than a second. The command asks for confirmation on the terminal before the alignment and before
    /// the step.
    #[arg(long, conflicts_with = "emulated")]
    locked_rotor: bool,
    /// Torque of the step, N m (default: 20 % of the motor's maximum).
    #[arg(long, value_name = "NM", requires = "locked_rotor")]
    torque_nm: Option<f64>,
    /// Torque constant of the motor, N m/A (default: from the catalogue).
    #[arg(long, value_name = "NM_PER_A", requires = "locked_rotor")]
    torque_constant: Option<f64>,
    /// JSON file of `cargo xtask silicon`: facts and checks for the start of the report.
    #[arg(long, value_name = "FILE")]
    with: Option<PathBuf>,
    /// Folder of the report (default: runs/silicon/BOARD).
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    line: LineOptions,
}

const EXAMPLES: &str = "\
Examples:
  dimsart commission nucleo-g474re --port /dev/ttyACM0 --restart 'probe-rs reset --chip STM32G474RETx'
  dimsart commission b-g431b-esc1 --port /dev/ttyACM0 --locked-rotor --torque-nm 0.05
  dimsart commission nucleo-g474re --emulated target/images/nucleo-g474re";

/// Results of earlier steps.
#[derive(Default, Deserialize)]
struct Before {
    facts: Vec<(String, String)>,
    checks: Vec<Check>,
}

impl Commission {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let info = BOARDS.iter().find(|board| board.name == self.board).ok_or_else(|| {
            UsageError(format!("unknown board {}; known boards: {}", self.board, budget::names()))
        })?;
        let before: Before = match &self.with {
            Some(file) => serde_json::from_str(&std::fs::read_to_string(file)?)?,
            None => Before::default(),
        };
        let folder = self.out.clone().unwrap_or_else(|| Path::new("runs/silicon").join(info.name));
        let mut report = Report::new(info.name, self.emulated.is_some(), before.facts, before.checks);
        let all: Result<(), Box<dyn Error>> = match &self.emulated {
            Some(image) => self.check_emulated(image.as_deref(), kinds, &mut report),
            None => self.check_board(info, &folder, kinds, &mut report, out),
        };
        if let Err(error) = all {
            report.add([Check::new(
                "all checks",
                false,
                error.to_string(),
                "all checks complete",
                "correct this error; `dimsart doctor --board PORT` repeats the first checks",
            )]);
        }
        for check in &report.checks {
            writeln!(out, "{check}")?;
        }
        let [markdown, json] = report.write(&folder)?;
        writeln!(out, "report: {}, {}", markdown.display(), json.display())?;
        Ok(if report.is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn check_emulated(
        &self,
        image: Option<&Path>,
        kinds: ModuleKinds,
        report: &mut Report,
    ) -> Result<(), Box<dyn Error>> {
        let board = Board::find(&self.board)
            .ok_or_else(|| format!("board {} has no emulated chip: use --port", self.board))?;
        let firmware = Firmware::find(image, Some(board.name))?;
        report.facts.push(("image file".to_owned(), firmware.path.display().to_string()));
        let mut emulated = SharedBoard::new(Bench::new(board, firmware.image)?);
        let mut device = connect::Device::identify(emulated.line(), Timeouts::default(), kinds)?;
        let checked = self.check(&mut device, &mut emulated, report);
        report.add([rules(&emulated), Check::not_run(LOCKED, "the emulated chip has no motor")]);
        checked
    }

    fn check_board(
        &self,
        info: &BoardInfo,
        folder: &Path,
        kinds: ModuleKinds,
        report: &mut Report,
        out: &mut impl Write,
    ) -> Result<(), Box<dyn Error>> {
        let port = self.port.as_deref().unwrap_or_default();
        report.facts.push(("port".to_owned(), port.to_owned()));
        let mut device = self.line.open(port, kinds)?;
        let mut around = HostComputer::new(port, self.restart.clone());
        self.check(&mut device, &mut around, report)?;
        match self.step(info)? {
            Some(step) if self.locked_rotor => turn(&step, &mut device, &around, folder, report, out)?,
            Some(_) => report.add([Check::not_run(LOCKED, "not requested (--locked-rotor)")]),
            None => report.add([Check::not_run(LOCKED, "the board has no three-phase motor drive")]),
        }
        Ok(())
    }

    /// Runs the checks that do not move the motor.
    fn check<S: io::Read + Write>(
        &self,
        device: &mut connect::Device<S>,
        around: &mut impl BoardEnvironment,
        report: &mut Report,
    ) -> Result<(), Box<dyn Error>> {
        report.facts.push(("image".to_owned(), device.identity().image.clone()));
        report.add(examine(device, around, Some(&self.board))?);
        let (checks, histogram) = observe_ticks(device, around, self.seconds)?;
        report.add(checks);
        report.histograms.extend(histogram);
        report.add(save_and_restart(device, around)?);
        Ok(())
    }

    fn step(&self, info: &BoardInfo) -> Result<Option<LockedRotor>, UsageError> {
        let Some(drive) = info.tooling.drive else { return Ok(None) };
        let motor = drive.configuration.motor;
        let constant = self.torque_constant.unwrap_or_else(|| motor.torque_constant_nm_per_a().into());
        let largest_nm = constant * f64::from(drive.configuration.limits.current_a);
        let torque_nm = self.torque_nm.unwrap_or(0.2 * largest_nm);
        if !(torque_nm > 0.0 && torque_nm <= largest_nm) {
            return Err(UsageError(format!("--torque-nm must be above 0 and at most {largest_nm} N m")));
        }
        Ok(Some(LockedRotor { torque_nm, torque_constant_nm_per_a: constant }))
    }
}

const LOCKED: &str = "torque on a locked rotor";

/// Checks the rules of the emulated chip.
fn rules(emulated: &SharedBoard) -> Check {
    let bench = emulated.bench();
    let faults =
        bench.processor.faults().iter().map(|fault| format!("fault at {}: {}", fault.place, fault.cause));
    let found: Vec<String> = bench.violations().into_iter().chain(faults).collect();
    let next = "look up the violated rule in docs/emulated-chip.md and the fault's address in the image";
    let is_well = found.is_empty();
    let found = if is_well { "no violation".to_owned() } else { found.join("; ") };
    Check::new("rules of the chip", is_well, found, "no violation, no fault", next)
}

/// Moves the motor after each of two confirmations, then restores the scheme, also after an error.
fn turn(
    step: &LockedRotor,
    device: &mut Device,
    around: &impl BoardEnvironment,
    folder: &Path,
    report: &mut Report,
    out: &mut impl Write,
) -> Result<(), Box<dyn Error>> {
    let rows = LockedRotor::load_zero_torque_scheme(device)?;
    let done = turn_if_allowed(step, device, around, out);
    LockedRotor::restore_scheme(device, &rows)?;
    let Some((check, drawn)) = done? else {
        report.add([Check::not_run(LOCKED, "not confirmed on the terminal")]);
        return Ok(());
    };
    let (figure, recording) = drawn.picture();
    let svg = report::write_figure(folder, figure, recording)?;
    report.pictures.extend(svg.file_name().map(|name| name.to_string_lossy().into_owned()));
    report.add([check]);
    Ok(())
}

fn turn_if_allowed(
    step: &LockedRotor,
    device: &mut Device,
    around: &impl BoardEnvironment,
    out: &mut impl Write,
) -> Result<Option<(Check, Step)>, Box<dyn Error>> {
    let free = "The rotor turns up to 1.25 electrical turns and back within 9 s. The rotor must be FREE and unloaded. Keep a hand \
                at the supply switch.";
    if !is_allowed(free, out)? {
        return Ok(None);
    }
    LockedRotor::align_encoder(device, around)?;
    let hold = format!(
        "CLAMP the rotor now, do not hold the rotor by hand: the motor applies {} N m for less than 1 s.",
        step.torque_nm
    );
    if !is_allowed(&hold, out)? {
        return Ok(None);
    }
    Ok(Some(step.step(device, around)?))
}

/// Asks for confirmation on the terminal; false without a terminal.
fn is_allowed(question: &str, out: &mut impl Write) -> io::Result<bool> {
    if !io::stdin().is_terminal() {
        return Ok(false);
    }
    write!(out, "{question}\nType yes to continue: ")?;
    out.flush()?;
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    Ok(answer.trim() == "yes")
}
