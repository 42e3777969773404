//! `dimsart bus`: checks whether the joints of a robot fit on one CAN bus.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use dimsart_core::ModuleKinds;
use serde::Serialize;

use super::output::{say, text_table};
use super::{Ending, UsageError};
use crate::report::{self, BusTimeline};
use crate::rig_argument;
use hil_sim::bus::can::{CanParameters, Format};
use hil_sim::bus_plan::{BusFigures, BusPlan, MAX_JOINTS};
use hil_sim::response::{every_ticks, words_of_one_axis};
use hil_sim::rig_file::{BusSection, CanSection, RigFile};

/// Check whether a robot's joints fit on one CAN bus.
///
/// A central controller sends a packet to each joint every period, and each joint replies with a packet; the rig's scheme
/// defines the packet sizes for one axis. The command computes the worst-case response times (Davis and others, 2007) and
/// simulates one second bit by bit, with the bit rates, errors and queues of the rig's bus. If the joints do not fit, the
/// output lists what to change. Exit status: 0 the joints fit, 1 the joints do not fit.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Bus {
    /// Rig with `[experiment.press]`, or file of settings (TOML; default: bilateral).
    rig: Option<PathBuf>,
    /// Change a setting, such as `can.bits_per_s=500000`; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Number of joints on the bus.
    #[arg(long, value_name = "COUNT", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..=i64::from(MAX_JOINTS)))]
    joints: u16,
    /// Packets per second to and from each joint (default: rate of the rig's link).
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate_hz: Option<f64>,
    /// CAN frame format (default: format of the rig's bus, else `can_fd`).
    #[arg(long, value_name = "KIND")]
    carrier: Option<Frames>,
    /// Words per packet (default: packet size of the rig's scheme for one axis).
    #[arg(long, value_name = "COUNT")]
    words: Option<usize>,
    /// Folder of the picture.
    #[arg(long, value_name = "FOLDER", default_value = "runs/bus")]
    out: PathBuf,
    /// Do not draw the picture.
    #[arg(long)]
    no_picture: bool,
    /// Print the figures as one JSON object; the table goes to standard error.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart bus                                            six joints at 1 kHz, CAN FD at 1 and 4 Mbit/s
  dimsart bus --carrier can --rate-hz 200                classic CAN
  dimsart bus --joints 7 --set can.data_bits_per_s=8000000
  dimsart bus --set can.bit_error_rate=1e-5 --json       for programs";

/// Frame format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum Frames {
    Can,
    CanFd,
}

/// The plan and its figures, for programs.
#[derive(Serialize)]
struct Answer<'a> {
    joints: u16,
    rate_hz: f64,
    words_to_joint: usize,
    words_from_joint: usize,
    #[serde(flatten)]
    figures: &'a BusFigures,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate_hz: f64 =
        text.parse().map_err(|_| "not a number: give packets per second, such as 1000".to_owned())?;
    if (1.0..=100_000.0).contains(&rate_hz) {
        Ok(rate_hz)
    } else {
        Err("out of range: give 1 to 100000 packets per second".to_owned())
    }
}

impl Bus {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let file = rig_argument::read(self.rig.as_deref(), &self.sets, kinds)?;
        let plan = self.plan(&file)?;
        let (figures, medium) = plan.analyse()?;
        say(self.json, out, |text| print(text, &plan, &figures))?;
        if !self.no_picture
            && let Some(picture) = BusTimeline::of(&[medium], plan.period_ns())
        {
            let svg = report::write_bus(&self.out, &picture)?;
            say(self.json, out, |text| writeln!(text, "picture: {}", svg.display()))?;
        }
        if self.json {
            let BusPlan { joints, rate_hz, words_to_joint, words_from_joint, .. } = plan;
            let answer = Answer { joints, rate_hz, words_to_joint, words_from_joint, figures: &figures };
            writeln!(out, "{}", serde_json::to_string(&answer)?)?;
        }
        Ok(if figures.fits { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    fn plan(&self, file: &RigFile) -> Result<BusPlan, Box<dyn std::error::Error>> {
        let no_pair = || {
            let name = self.rig.as_deref().unwrap_or(Path::new("the rig")).display().to_string();
            UsageError(format!(
                "{name} has no [experiment.press], which `bus` needs to plan packets between two controllers. \
                 `dimsart run {name}` simulates the rig's own buses; `dimsart check {name}` checks its schemes"
            ))
        };
        let [hand, other] = file.press_pair().ok_or_else(no_pair)?;
        let [words_to_joint, words_from_joint] = match self.words {
            Some(words) => [words; 2],
            None => words_of_one_axis(file)?.ok_or_else(no_pair)?,
        };
        let link = file.links.iter().find(|link| link.from == hand.name() && link.to == other.name());
        let bus = file.buses.iter().find(|bus| link.is_some_and(|link| link.bus.as_ref() == Some(&bus.name)));
        let is_classic = |bus: &BusSection| bus.can.is_some();
        let frames = self.carrier.unwrap_or(match bus.is_some_and(is_classic) {
            true => Frames::Can,
            false => Frames::CanFd,
        });
        let can = file.buses.iter().find_map(|bus| match frames {
            Frames::Can => bus.can.clone(),
            Frames::CanFd => bus.can_fd.clone(),
        });
        let can: CanSection = can.unwrap_or_default();
        let every_ticks = f64::from(every_ticks(file)?.unwrap_or(1));
        Ok(BusPlan {
            joints: self.joints,
            rate_hz: self.rate_hz.unwrap_or(1.0 / (file.sample_period_s * every_ticks)),
            words_to_joint,
            words_from_joint,
            format: if frames == Frames::Can { Format::Classic } else { Format::Fd },
            parameters: CanParameters::from(&can),
            seed: file.seed,
        })
    }
}

fn print(out: &mut dyn Write, plan: &BusPlan, figures: &BusFigures) -> std::io::Result<()> {
    let CanParameters { bits_per_s, data_bits_per_s, .. } = plan.parameters;
    let bus = match plan.format {
        Format::Classic => format!("classic CAN at {} kbit/s", bits_per_s / 1000),
        Format::Fd => format!("CAN FD at {} and {} kbit/s", bits_per_s / 1000, data_bits_per_s / 1000),
    };
    let verdict = if figures.fits { "fits" } else { "does NOT fit" };
    let BusPlan { joints, rate_hz, words_to_joint, words_from_joint, .. } = plan;
    writeln!(
        out,
        "{joints} joints at {rate_hz} Hz on {bus}, packets of {words_to_joint} words to each joint and \
         {words_from_joint} words from each joint: {verdict}"
    )?;
    let milliseconds =
        |time_s: Option<f64>| time_s.map_or("never".to_owned(), |time_s| format!("{:.3}", 1e3 * time_s));
    let mut table = text_table();
    table.set_header(["packet", "identifier", "frames", "max bits", "worst case (ms)", "simulated (ms)"]);
    for packet in &figures.packets {
        table.add_row([
            packet.name.clone(),
            packet.identifier.clone(),
            packet.frames.to_string(),
            packet.max_bits.to_string(),
            milliseconds(packet.worst_response_s),
            milliseconds(packet.simulated_response_s),
        ]);
    }
    writeln!(out, "{table}")?;
    writeln!(
        out,
        "bus load: {:.1} % worst case, {:.1} % simulated; packet deadline: {:.3} ms; {} error frames, {} packets dropped",
        100.0 * figures.worst_load,
        100.0 * figures.simulated_load,
        1e3 * figures.period_s,
        figures.error_frames,
        figures.dropped
    )?;
    figures.advice.iter().try_for_each(|advice| writeln!(out, "  - {advice}"))
}
