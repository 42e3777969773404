//! `dimsart check`: whether a scheme matches, without running it.

use std::io::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use boards::BOARDS;
use boards::catalogue::Tooling;
use clap::Args;
use dimsart_core::limits::{BOARD_LINKS, MAX_LINKS};
use dimsart_core::modules::Standard;
use dimsart_core::{Costs, Dimsart, Usage, limits};
use serde::Serialize;

use super::Ending;
use crate::budget::{Budget, BudgetError};
use crate::cycles::Firmware;
use crate::stamp::StampedImage;
use hil_sim::bilateral::{Side, device};
use hil_sim::first_packet::first_packet;
use hil_sim::response::{Experiment, ResponseError};
use hil_sim::rig::{SimulatedDimsart, Station};
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::{self, SchemeText};

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
    /// Side whose rows are checked; both when left out.
    #[arg(long, value_parser = super::side::side())]
    side: Option<Side>,
    /// Degrees of freedom of the device, 1 to 8; those of the board, or 3, when left out.
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true)]
    dof: Option<usize>,
    /// Sample period of the device, s.
    #[arg(long, default_value_t = 1e-3, value_name = "SECONDS", allow_negative_numbers = true)]
    sample_period_s: f64,
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

/// What was found of one controller.
#[derive(Debug, Serialize)]
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

/// Axes where nothing says how many.
const DOF: usize = 3;

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
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let verdicts = match super::run::rig::read_rig(Path::new(&self.scheme))? {
            Some(file) => check_rig(file)?,
            None => {
                let scheme = SchemeText::read(&self.scheme)?;
                let sides = self.side.map_or(vec![Side::Master, Side::Slave], |side| vec![side]);
                sides.into_iter().map(|side| self.check(&scheme, side)).collect::<Result<_, _>>()?
            }
        };
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&verdicts)?)?;
        } else {
            verdicts.iter().try_for_each(|verdict| self.print(verdict, out))?;
        }
        let is_sound = verdicts.iter().all(|verdict| verdict.matches);
        Ok(if is_sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn print(&self, verdict: &Verdict, out: &mut impl Write) -> std::io::Result<()> {
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
                limits::MAX_MODULES,
                limits::MAX_SLOTS,
            )?;
            time.iter().try_for_each(|time| writeln!(out, "  {time}"))?;
            notes.iter().try_for_each(|note| writeln!(out, "  note: {note}"))?;
        }
        Ok(())
    }

    fn check(&self, scheme: &SchemeText, side: Side) -> Result<Verdict, Box<dyn std::error::Error>> {
        let board = self.board.as_deref().map(board).transpose()?;
        let dof = self.dof.or(board.map(|board| board.axes)).unwrap_or(DOF);
        let words = board.map_or(limits::DEFAULT_WORDS, |board| board.words);
        let device = device(side.name(), dof, self.sample_period_s)?;
        if board.is_none() {
            // As large as on a board of the usual size: what passes here fits there.
            let mut dimsart: Dimsart = Dimsart::new(device).map_err(dimsart_core::CommandError::from)?;
            return self.check_on(&mut dimsart, words, scheme, side);
        }
        // More than there is on any board, so that it is known how much too much a scheme takes.
        let dimsart = SimulatedDimsart::new(device).map_err(dimsart_core::CommandError::from)?;
        self.check_on(&mut Box::new(dimsart), words, scheme, side)
    }

    fn check_on<const WORDS: usize>(
        &self,
        dimsart: &mut Dimsart<Standard, WORDS>,
        most_words: usize,
        scheme: &SchemeText,
        side: Side,
    ) -> Result<Verdict, Box<dyn std::error::Error>> {
        let limit = self.board.as_deref().map(|board| self.limit(board)).transpose()?;
        if let Some(Ok(limit)) = &limit {
            dimsart.engine_mut().limit_cycles(NonZeroU32::new(limit.cycles));
            dimsart.engine_mut().set_costs(Some(limit.costs));
        }
        let loaded = schemes::load(scheme, side.name(), &[], dimsart);
        let Usage { modules, slots, words, .. } = dimsart.engine().usage();
        let mut faults: Vec<String> = loaded.problems().map(|problem| problem.to_string()).collect();
        if words > most_words {
            let place = self.board.as_deref().unwrap_or("a board of the usual size");
            faults.push(format!(
                "it takes {words} words of the Data Base, and {place} has {most_words}: shorten a delay, keep fewer rows, or \
                 leave a module out"
            ));
        }
        if let Some(board) = &self.board {
            let uses =
                |link: &usize| dimsart.listening_channel(*link) > 0 || first_packet(dimsart, *link).is_some();
            let mut uses = uses;
            faults.extend(
                (BOARD_LINKS..MAX_LINKS)
                    .filter(|link| uses(link))
                    .map(|link| format!("it uses link {link}, and {board} has {BOARD_LINKS}, from 0")),
            );
        }
        let matches = loaded.is_sound() && faults.is_empty();
        let time = match (limit, dimsart.engine().tick_cycles()) {
            (Some(Ok(limit)), Some(cycles)) => Some(limit.time_text(cycles)),
            (Some(Err(reason)), _) => Some(format!("how long a tick takes is not known: {reason}")),
            _ => None,
        };
        let notes = match matches {
            true => (0..MAX_LINKS).filter_map(|link| note(dimsart, link)).collect(),
            false => Vec::new(),
        };
        Ok(Verdict {
            controller: side.name().to_owned(),
            matches,
            faults,
            delays: loaded.delays,
            notes,
            modules,
            slots,
            words,
            most_words: Some(most_words),
            time,
        })
    }
}

/// The controllers of a rig, all of whose schemes run on their devices; else why not is the error.
fn check_rig(mut file: RigFile) -> Result<Vec<Verdict>, ResponseError> {
    file.experiment.margins = false;
    let mut experiment = Experiment::new(&file)?;
    let verdict = |station: &Station| {
        let Usage { modules, slots, words, .. } = station.dimsart.engine().usage();
        Verdict {
            controller: station.name.clone(),
            matches: true,
            faults: Vec::new(),
            delays: Vec::new(),
            notes: Vec::new(),
            modules,
            slots,
            words,
            most_words: None,
            time: None,
        }
    };
    Ok(experiment.rig_mut().stations().iter().map(verdict).collect())
}

/// A board by its name.
fn board(name: &str) -> Result<&'static Tooling, BudgetError> {
    let found = BOARDS.iter().find(|board| board.name == name).map(|board| &board.tooling);
    found.ok_or_else(|| BudgetError::Unknown { name: name.to_owned() })
}

/// What the scheme hears over a link on some lines, and should not.
fn note<const WORDS: usize>(dimsart: &mut Dimsart<Standard, WORDS>, link: usize) -> Option<String> {
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

/// What a tick may take on a board, by the stamp of an image.
struct Limit {
    cycles: u32,
    period_cycles: u32,
    costs: Costs,
}

impl Check {
    /// Of the board's image; without a stamped one, the reason.
    fn limit(&self, board: &str) -> Result<Result<Limit, String>, Box<dyn std::error::Error>> {
        let period_cycles = Budget::of(board)?.period_cycles();
        let firmware = match Firmware::find(self.image.as_deref(), Some(board)) {
            Ok(firmware) => firmware,
            Err(error) if self.image.is_some() => return Err(error.into()),
            Err(error) => return Ok(Err(error.to_string())),
        };
        let image = StampedImage::read(&firmware.path)?;
        let Some(costs) = image.costs() else {
            let path = firmware.path.display();
            return Ok(Err(format!("{path} is not stamped; `dimsart stamp {path}` does that")));
        };
        // Once for each side of a scheme.
        let costs = Costs::new(costs.leak());
        Ok(Ok(Limit { cycles: image.limit_cycles(), period_cycles, costs }))
    }
}

impl Limit {
    /// How long a tick can be, and how much of what it may take and of all its time that is.
    fn time_text(&self, cycles: u32) -> String {
        let share = |whole: u32| 100.0 * f64::from(cycles) / f64::from(whole);
        format!(
            "a tick takes up to {cycles} of {} cycles ({:.1} %), {:.1} % of the time to the next one",
            self.cycles,
            share(self.cycles),
            share(self.period_cycles)
        )
    }
}
