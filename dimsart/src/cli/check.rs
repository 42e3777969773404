//! `dimsart check`: whether a scheme matches, without running it.

mod target;

use std::error::Error;
use std::io::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::limits::{DEFAULT_WORDS, MAX_LINKS, Sizes};
use dimsart_core::{DeviceDescriptor, Dimsart, Kinds, Usage, memory};
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
use hil_sim::schemes::{self, Loaded, SIDES, SchemeText, device};

/// Check a scheme against a device, or those of a rig against its devices: exit status 0 when it matches, 1 when not.
///
/// Names every fault at once: a type that nobody provides or that two modules provide, a port bound to a type of
/// another unit, a word that does not exist, a module that does not fit any more. A type that is read before it is
/// written in the tick is named as a delay. A note says what depends on the line: whose packets are heard on it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Check {
    /// Scheme file, or one that is built in: `builtin:bilateral`, `builtin:position_position`,
    /// `builtin:table1`; or a rig: a TOML file, or a shipped one such as `arm_bus`.
    scheme: String,
    /// Side of a scheme whose rows are checked, or controller of a rig; all when left out.
    #[arg(long, value_parser = super::side::side())]
    side: Option<&'static str>,
    /// Degrees of freedom of the device, 1 to 8; those of the board, or 3, when left out.
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    dof: Option<usize>,
    /// Sample period of the device, s; 0.001, or the rig's, when left out.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    sample_period_s: Option<f64>,
    /// Board whose axes and memory it is checked for, such as `nucleo-g474re`, and whose limit of cycles per tick holds, by
    /// the stamp of its image; none when left out.
    #[arg(long, value_name = "BOARD")]
    board: Option<String>,
    /// That board's image (ELF); the one that was built last when left out.
    #[arg(long, value_name = "FILE", requires = "board")]
    image: Option<PathBuf>,
    /// Prints what was found as JSON, an entry for each controller.
    #[arg(long)]
    json: bool,
}

/// The parameter of a rig that says how many axes it has.
const DOF_PARAMETER: &str = "dof";

/// What was found of one controller.
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
    /// Words that there are; none where nobody said of which board.
    most_words: Option<usize>,
    /// How long a tick can be, or why that is not known; none without a board.
    time: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart check builtin:table1               the paper's Table 1: on the slave, a type has no provider
  dimsart check my.scheme --side slave       the rows for one side
  dimsart check my.scheme --dof 7            on a robot of seven joints
  dimsart check arm_bus                      all controllers of a rig
  dimsart check my.scheme --board nucleo-g474re
                                             whether that board takes it, and how long its ticks can be

A scheme is a text of `dest module command value` rows; the built-in ones are in the folder schemes/.";

impl Check {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
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
            let sizes = target.map_or(Sizes::DEFAULT, |target| target.board.sizes);
            verdicts.iter().try_for_each(|verdict| self.print(verdict, sizes, out))?;
        }
        let is_sound = verdicts.iter().all(|verdict| verdict.matches);
        Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn print(&self, verdict: &Verdict, sizes: Sizes, out: &mut impl Write) -> std::io::Result<()> {
        let Verdict { controller, matches, faults, delays, notes, modules, slots, words, most_words, time } =
            verdict;
        let says = if *matches { "matches" } else { "does NOT match" };
        writeln!(out, "{} on the {controller}: {says}", self.scheme)?;
        for (kind, lines) in [("fault", faults), ("delay", delays)] {
            lines.iter().try_for_each(|line| writeln!(out, "  {kind}: {line}"))?;
        }
        if *matches {
            let of_words = most_words.map_or(String::new(), |most| format!(" of {most}"));
            writeln!(
                out,
                "  takes {modules} of {} modules, {slots} of {} slots, {words}{of_words} words",
                sizes.modules, sizes.slots,
            )?;
            time.iter().try_for_each(|time| writeln!(out, "  {time}"))?;
        }
        notes.iter().try_for_each(|note| writeln!(out, "  note: {note}"))
    }

    fn check_scheme(&self, kinds: Kinds, target: Option<&Target>) -> Result<Vec<Verdict>, Box<dyn Error>> {
        let scheme = SchemeText::read(&self.scheme)?;
        let dof = self.dof.or(target.map(|target| target.board.axes)).unwrap_or(DOF);
        let period_s = self.sample_period_s.unwrap_or(PERIOD_S);
        let rig = self.rig_of_scheme();
        let check = |side: &'static str| {
            let mut verdict = check(&scheme, side, device(side, dof, period_s)?, kinds, target)?;
            verdict.notes.extend(rig.filter(|_| !verdict.matches).map(|rig| {
                format!(
                    "the scheme is for the devices of the rig {rig}: `dimsart check {rig}` checks it on these"
                )
            }));
            Ok(verdict)
        };
        self.side.map_or(SIDES.to_vec(), |side| vec![side]).into_iter().map(check).collect()
    }

    /// The shipped rig that has this scheme.
    fn rig_of_scheme(&self) -> Option<&'static str> {
        let has_it = |text: &str, name: &str| {
            let file = RigFile::read(text, name, PathBuf::new(), &[]);
            file.is_ok_and(|file| file.controllers.iter().any(|controller| controller.scheme == self.scheme))
        };
        SHIPPED.iter().find(|(name, text)| has_it(text, name)).map(|(name, _)| *name)
    }

    /// The controllers of a rig. What is said of its axes and period goes over the file, where that has parameters for it.
    fn check_rig(
        &self,
        path: &Path,
        kinds: Kinds,
        target: Option<&Target>,
    ) -> Result<Vec<Verdict>, Box<dyn Error>> {
        let file = rig_argument::read(Some(path), &[], kinds)?;
        let has_dof = file.parameter(DOF_PARAMETER).is_some();
        if (self.side.is_some() || self.dof.is_some() || self.sample_period_s.is_some()) && !has_dof {
            let reason = "--side, --dof and --sample-period-s are for schemes; a rig says itself which controllers, axes and \
                          period it has";
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
            format!("for the {} {of_board} of {name}, not for the rig's {axes}", board.axes)
        });
        let judge = |mut controller: LoadedController| {
            let LoadedController { name, dimsart, loaded, .. } = &mut controller;
            // Without a board, as large as one of the usual size: what passes here fits there.
            let most_words = target.map_or(DEFAULT_WORDS, |target| target.board.sizes.words);
            if let Some(Ok(limit)) = target.map(|target| &target.limit) {
                dimsart.engine_mut().set_costs(Some(limit.costs));
            }
            let mut verdict = verdict(
                name,
                dimsart,
                loaded,
                Some(most_words).filter(|_| has_dof || target.is_some()),
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
            // What is between the controllers.
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
    kinds: Kinds,
    target: Option<&Target>,
) -> Result<Verdict, Box<dyn Error>> {
    let Some(found) = target else {
        // As many words as on a board of the usual size, and as many links as any peer.
        type UsualMemory = memory!(Sizes { words: DEFAULT_WORDS, ..SIZES });
        let dimsart = Dimsart::new(Box::leak(Box::new(UsualMemory::new())), device, kinds);
        let mut dimsart = dimsart.map_err(dimsart_core::CommandError::from)?;
        return Ok(check_on(&mut dimsart, scheme, side, DEFAULT_WORDS, target));
    };
    // More than there is on any board, so that it is known how much too much a scheme takes.
    let dimsart = SimulatedDimsart::new(device, kinds).map_err(dimsart_core::CommandError::from)?;
    Ok(check_on(&mut Box::new(dimsart), scheme, side, found.board.sizes.words, target))
}

fn check_on(
    dimsart: &mut Dimsart,
    scheme: &SchemeText,
    side: &'static str,
    most_words: usize,
    target: Option<&Target>,
) -> Verdict {
    if let Some(Ok(limit)) = target.map(|target| &target.limit) {
        dimsart.engine_mut().limit_cycles(NonZeroU32::new(limit.cycles));
        dimsart.engine_mut().set_costs(Some(limit.costs));
    }
    let loaded = schemes::load(scheme, side, &[], dimsart);
    let mut verdict = verdict(side, dimsart, &loaded, Some(most_words), target);
    if verdict.matches {
        verdict.notes = (0..MAX_LINKS).filter_map(|link| line_note(dimsart, link)).collect();
    }
    verdict
}

/// What is to be said of a controller that has its scheme.
fn verdict(
    name: &str,
    dimsart: &mut Dimsart,
    loaded: &Loaded,
    most_words: Option<usize>,
    target: Option<&Target>,
) -> Verdict {
    let Usage { modules, slots, words, .. } = dimsart.engine().usage();
    let mut faults: Vec<String> = loaded.problems().collect();
    if let Some(most) = most_words.filter(|most| words > *most) {
        let place = target.map_or("a board of the usual size", |target| &target.name);
        faults.push(format!(
            "it takes {words} words of the Data Base, and {place} has {most}: shorten a delay, keep fewer rows, or \
             leave a module out"
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
        most_words,
        time: target.and_then(|target| target.time(dimsart)),
    }
}

/// What the scheme hears over a link on some lines, and should not.
fn line_note(dimsart: &mut Dimsart, link: usize) -> Option<String> {
    let own = first_packet(dimsart, link)?;
    let _ = dimsart.receive(link, &own.to_bytes());
    let hears_itself = first_packet(dimsart, link).is_some_and(|next| next.echo == own.counter);
    let what = match (hears_itself, own.channel) {
        (true, 0) => {
            "takes its own packets for the other side's where a line gives them back, and on a CAN bus everybody's"
        }
        (true, _) => "takes its own packets for the other side's where a line gives them back",
        (false, 0) => "sends on channel 0, which on a CAN bus everybody hears who listens to channel 0",
        (false, _) => return None,
    };
    Some(format!(
        "over link {link} it {what}; give each direction a channel above 0 of its own (CTX_CHANNEL here is CRX_CHANNEL on \
         the other side)"
    ))
}

/// How far a device may go from zero until the steps of an `f32` show in its positions.
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
            "a position has steps of {step:.1e} {unit} at position_limit, {limit} {unit} (f32): usable to {fine_step} \
             {unit} within ±{fine_range} {unit}"
        )
    })
}
