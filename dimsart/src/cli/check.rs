//! `dimsart check`: checks a scheme without running it.

mod target;

use std::error::Error;
use std::io::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::limits::{Capacities, DEFAULT_WORDS, MAX_LINKS};
use dimsart_core::{DeviceDescriptor, Dimsart, ModuleKinds, Usage, memory};
use serde::Serialize;
use target::Target;

use super::controllers::{DOF, PERIOD_S};
use super::{Ending, UsageError};
use crate::rig_argument;
use hil_sim::experiment::Experiment;
use hil_sim::first_packet::first_packet;
use hil_sim::response::{LoadedController, loaded_controllers};
use hil_sim::rig::{SIZES, SimulatedDimsart};
use hil_sim::rig_file::{AxisUnit, DeviceSection, RigFile, SHIPPED};
use hil_sim::schemes::{self, LoadReport, SIDES, SchemeText, device};

/// Check a scheme against a device, or the schemes of a rig.
///
/// Reports every fault at once: a type without a provider or with two providers, a port bound to a type with a different
/// unit, an unknown word, a module that does not fit. A type that is read before it is written in the tick is reported as a
/// delay. A note warns of packets that the wrong controller would receive. With --board, also checks the axes, links and
/// memory of that board, and bounds the tick time from the stamp of the board's image. Exit status: 0 no fault, 1 faults.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Check {
    /// Scheme file, `builtin:NAME`, or rig (TOML file or shipped, such as `arm_bus`).
    ///
    /// Built-in schemes are `builtin:bilateral`, `builtin:position_position`, `builtin:table1` and others; see the folder
    /// schemes/.
    scheme: String,
    /// Check only the rows for this side of a scheme, or this controller of a rig.
    #[arg(long, value_parser = super::side::side())]
    side: Option<&'static str>,
    /// Degrees of freedom of the device, 1 to 8 (default: number of the board's axes, else 3).
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    dof: Option<usize>,
    /// Sample period of the device, s (default: 0.001, or the rig's).
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    sample_period_s: Option<f64>,
    /// Also check the axes, links, memory and tick time of a board, such as `nucleo-g474re`.
    #[arg(long, value_name = "BOARD")]
    board: Option<String>,
    /// Stamped image of the board given with --board (ELF; default: the image built last).
    #[arg(long, value_name = "FILE", requires = "board")]
    image: Option<PathBuf>,
    /// Print a JSON list with an entry for each controller.
    #[arg(long)]
    json: bool,
}

/// The parameter of a rig for its number of axes.
const DOF_PARAMETER: &str = "dof";

/// Result for one controller.
#[derive(Debug, Default, Serialize)]
struct Verdict {
    /// Its side of the scheme, or its name in a rig.
    controller: String,
    matches: bool,
    faults: Vec<String>,
    /// Types that are read before they are written in a tick.
    delays: Vec<String>,
    notes: Vec<String>,
    modules: usize,
    slots: usize,
    words: usize,
    /// Words of the board's Data Base; none without a board.
    max_words: Option<usize>,
    /// Old name of `max_words`; the next release drops it.
    most_words: Option<usize>,
    /// Maximum time of a tick, or why it is unknown; none without a board.
    time: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart check builtin:table1               the paper's Table 1: the slave lacks a provider of a type
  dimsart check my.scheme --side slave       check the rows for one side
  dimsart check my.scheme --dof 7            check for a robot with seven joints
  dimsart check arm_bus                      check all controllers of a rig
  dimsart check my.scheme --board nucleo-g474re
                                             also check memory and tick time on a board

A scheme is a text with rows `dest module command value`; the built-in schemes are in the folder schemes/.";

impl Check {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let target =
            self.board.as_deref().map(|board| Target::find(board, self.image.as_deref())).transpose()?;
        let path = Path::new(&self.scheme);
        let verdicts = match rig_argument::is_rig(path) {
            true => self.check_rig(path, kinds, target.as_ref()),
            false => self.check_scheme(kinds, target.as_ref()),
        }?;
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&verdicts)?)?;
        } else {
            let sizes = target.map_or(Capacities::DEFAULT, |target| target.board.sizes);
            verdicts.iter().try_for_each(|verdict| self.print(verdict, sizes, out))?;
        }
        let is_sound = verdicts.iter().all(|verdict| verdict.matches);
        Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn print(&self, verdict: &Verdict, sizes: Capacities, out: &mut impl Write) -> std::io::Result<()> {
        let Verdict {
            controller,
            matches,
            faults,
            delays,
            notes,
            modules,
            slots,
            words,
            max_words,
            time,
            ..
        } = verdict;
        let result = if *matches { "matches" } else { "does NOT match" };
        writeln!(out, "{} on the {controller}: {result}", self.scheme)?;
        for (kind, lines) in [("fault", faults), ("delay", delays)] {
            lines.iter().try_for_each(|line| writeln!(out, "  {kind}: {line}"))?;
        }
        if *matches {
            let of_words = max_words.map_or(String::new(), |most| format!(" of {most}"));
            writeln!(
                out,
                "  uses {modules} of {} modules, {slots} of {} slots, {words}{of_words} words",
                sizes.modules, sizes.slots,
            )?;
            time.iter().try_for_each(|time| writeln!(out, "  {time}"))?;
        }
        notes.iter().try_for_each(|note| writeln!(out, "  note: {note}"))
    }

    fn check_scheme(
        &self,
        kinds: ModuleKinds,
        target: Option<&Target>,
    ) -> Result<Vec<Verdict>, Box<dyn Error>> {
        let scheme = SchemeText::read(&self.scheme)?;
        let dof = self.dof.or(target.map(|target| target.board.axes)).unwrap_or(DOF);
        let period_s = self.sample_period_s.unwrap_or(PERIOD_S);
        let rig = self.rig_of_scheme();
        let check = |side: &'static str| {
            let mut verdict = check(&scheme, side, device(side, dof, period_s)?, kinds, target)?;
            verdict.notes.extend(rig.filter(|_| !verdict.matches).map(|rig| {
                format!(
                    "the scheme belongs to the rig {rig}: run `dimsart check {rig}` to check the scheme on the rig's devices"
                )
            }));
            Ok(verdict)
        };
        self.side.map_or(SIDES.to_vec(), |side| vec![side]).into_iter().map(check).collect()
    }

    /// The shipped rig with this scheme.
    fn rig_of_scheme(&self) -> Option<&'static str> {
        let has_it = |text: &str, name: &str| {
            let file = RigFile::read(text, name, PathBuf::new(), &[]);
            file.is_ok_and(|file| file.controllers.iter().any(|controller| controller.scheme == self.scheme))
        };
        SHIPPED.iter().find(|(name, text)| has_it(text, name)).map(|(name, _)| *name)
    }

    /// Checks the controllers of a rig. `--dof` and `--sample-period-s` override parameters of the file.
    fn check_rig(
        &self,
        path: &Path,
        kinds: ModuleKinds,
        target: Option<&Target>,
    ) -> Result<Vec<Verdict>, Box<dyn Error>> {
        let file = rig_argument::read(Some(path), &[], kinds)?;
        let has_dof = file.parameter(DOF_PARAMETER).is_some();
        if (self.side.is_some() || self.dof.is_some() || self.sample_period_s.is_some()) && !has_dof {
            let reason = "--side, --dof and --sample-period-s apply to schemes only: omit them, because a rig defines its \
                          controllers, axes and period";
            return Err(UsageError(reason.to_owned()).into());
        }
        let axes = file.devices.iter().map(|device| device.axes.len()).max().unwrap_or_default();
        let board =
            target.filter(|target| has_dof && target.board.motor.is_some() && target.board.axes < axes);
        let board = board.filter(|_| self.dof.is_none());
        let mut sets = Vec::new();
        sets.extend(
            self.dof.or(board.map(|target| target.board.axes)).map(|dof| format!("{DOF_PARAMETER}={dof}")),
        );
        sets.extend(self.sample_period_s.map(|period_s| format!("sample_period_s={period_s:?}")));
        let mut file = rig_argument::read(Some(path), &sets, kinds)?;
        let note = board.map(|Target { name, board, .. }| {
            let of_board = if board.axes == 1 { "axis" } else { "axes" };
            format!("checked for the {} {of_board} of {name}; the rig has {axes} axes", board.axes)
        });
        let judge = |mut controller: LoadedController| {
            let LoadedController { name, dimsart, loaded, .. } = &mut controller;
            // Without a board, the usual size.
            let max_words = target.map_or(DEFAULT_WORDS, |target| target.board.sizes.words);
            if let Some(Ok(limit)) = target.map(|target| &target.limit) {
                dimsart.engine_mut().set_costs(Some(limit.costs));
            }
            let mut verdict = verdict(
                name,
                dimsart,
                loaded,
                Some(max_words).filter(|_| has_dof || target.is_some()),
                target,
            );
            if verdict.matches && has_dof {
                verdict.notes.extend((0..MAX_LINKS).filter_map(|link| line_note(dimsart, link)));
            }
            verdict.notes.extend(note.clone());
            verdict
        };
        let mut verdicts: Vec<Verdict> = loaded_controllers(&file)?.into_iter().map(judge).collect();
        verdicts.retain(|verdict| self.side.is_none_or(|side| verdict.controller == side));
        for verdict in &mut verdicts {
            let controller = file.controllers.iter().find(|found| found.name() == verdict.controller);
            let device = controller.and_then(|found| file.device(&found.device));
            verdict.notes.extend(device.and_then(range_note));
        }
        if self.side.is_none() && verdicts.iter().all(|verdict| verdict.matches) {
            // Links and buses between the controllers.
            file.experiment.margins = false;
            Experiment::new(&file)?;
        }
        Ok(verdicts)
    }
}

fn check(
    scheme: &SchemeText,
    side: &'static str,
    device: DeviceDescriptor,
    kinds: ModuleKinds,
    target: Option<&Target>,
) -> Result<Verdict, Box<dyn Error>> {
    let Some(found) = target else {
        // The words of a board of the usual size, and the links of a simulated controller.
        type UsualMemory = memory!(Capacities { words: DEFAULT_WORDS, ..SIZES });
        let dimsart = Dimsart::new(Box::leak(Box::new(UsualMemory::new())), device, kinds);
        let mut dimsart = dimsart.map_err(dimsart_core::CommandError::from)?;
        return Ok(check_on(&mut dimsart, scheme, side, DEFAULT_WORDS, target));
    };
    // Larger than any board, to report by how much a scheme exceeds its limits.
    let dimsart = SimulatedDimsart::new(device, kinds).map_err(dimsart_core::CommandError::from)?;
    Ok(check_on(&mut Box::new(dimsart), scheme, side, found.board.sizes.words, target))
}

fn check_on(
    dimsart: &mut Dimsart,
    scheme: &SchemeText,
    side: &'static str,
    max_words: usize,
    target: Option<&Target>,
) -> Verdict {
    if let Some(Ok(limit)) = target.map(|target| &target.limit) {
        dimsart.engine_mut().set_cycle_limit(NonZeroU32::new(limit.cycles));
        dimsart.engine_mut().set_costs(Some(limit.costs));
    }
    let loaded = schemes::load(scheme, side, &[], dimsart);
    let mut verdict = verdict(side, dimsart, &loaded, Some(max_words), target);
    if verdict.matches {
        verdict.notes = (0..MAX_LINKS).filter_map(|link| line_note(dimsart, link)).collect();
    }
    verdict
}

/// Collects the result for a controller with its scheme loaded.
fn verdict(
    name: &str,
    dimsart: &mut Dimsart,
    loaded: &LoadReport,
    max_words: Option<usize>,
    target: Option<&Target>,
) -> Verdict {
    let Usage { modules, slots, words, .. } = dimsart.engine().usage();
    let mut faults: Vec<String> = loaded.problems().collect();
    if let Some(most) = max_words.filter(|most| words > *most) {
        let place = target.map_or("a board of the default size", |target| &target.name);
        faults.push(format!(
            "the scheme needs {words} words of the Data Base, {place} has {most}: shorten a delay, record fewer rows or \
             remove a module"
        ));
    }
    faults.extend(target.into_iter().flat_map(|target| target.faults(dimsart)));
    Verdict {
        controller: name.to_owned(),
        matches: faults.is_empty(),
        faults,
        delays: loaded.delays.clone(),
        notes: Vec::new(),
        modules,
        slots,
        words,
        max_words,
        most_words: max_words,
        time: target.and_then(|target| target.time(dimsart)),
    }
}

/// A warning if a controller would receive packets of the wrong sender on some lines.
fn line_note(dimsart: &mut Dimsart, link: usize) -> Option<String> {
    let own = first_packet(dimsart, link)?;
    let _ = dimsart.receive(link, &own.to_bytes());
    let hears_itself = first_packet(dimsart, link).is_some_and(|next| next.echo == own.counter);
    let what = match (hears_itself, own.channel) {
        (true, 0) => {
            "accepts its own packets as the peer's on a line with echo, and packets of every controller on a CAN bus"
        }
        (true, _) => "accepts its own packets as the peer's on a line with echo",
        (false, 0) => {
            "sends on channel 0, and on a CAN bus every controller that listens to channel 0 receives the packets"
        }
        (false, _) => return None,
    };
    Some(format!(
        "link {link} {what}: give each direction its own channel above 0 (CTX_CHANNEL here = CRX_CHANNEL of the peer)"
    ))
}

/// A note if the resolution of an `f32` is coarse at the end of a device's range.
fn range_note(device: &DeviceSection) -> Option<String> {
    const FINE: (f32, f32) = (1024.0, 1e-4);
    let (fine_range, fine_step) = FINE;
    #[expect(clippy::cast_possible_truncation, reason = "as a controller has it")]
    let limit = device.position_limit as f32;
    let unit = match device.axes.first()?.unit {
        AxisUnit::Radian => "rad",
        AxisUnit::Metre => "m",
    };
    let step = limit.next_up() - limit;
    (limit > fine_range).then(|| {
        format!(
            "position resolution (f32) is only {step:.1e} {unit} at position_limit {limit} {unit}, but {fine_step} {unit} or \
             finer within ±{fine_range} {unit}"
        )
    })
}
