//! `dimsart identify`: identifies the parameters of a joint from a recording.

mod file;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use clap::Args;
use dimsart_core::ModuleKinds;
use serde::Serialize;

use super::output::{say, text_table};
use super::{Ending, UsageError};
use crate::report::{self, Bode};
use crate::rig_argument;
use hil_sim::experiment;
use hil_sim::identify::{
    Estimate, Experiment, ForceTiming, FrequencyPoint, IdentifiedJoint, Quantity, frequency_response,
    identify, true_arm_joint_parameters, true_parameters,
};
use hil_sim::plant::{ArmParameters, ParameterError};
use hil_sim::rig_file::{AxisUnit, DeviceSection, RigFile};

/// Identify inertia, friction and weight of a joint, with a Bode plot.
///
/// Runs a rig, or reads signals.csv of a run or of a recording. The experiment must excite slow and fast motion: a chirp or
/// a PRBS on the reference or force of the joint. The force is the measured `FORCE` if present, else the commanded
/// `DES_FORCE`. A parameter that the motion does not determine gets no estimate. In the experiment on an arm, each joint
/// moves in turn while the other joints are held.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Identify {
    /// Rig file (TOML), shipped rig, or recording (CSV).
    #[arg(default_value = "identify")]
    source: PathBuf,
    /// Change a setting of a rig, such as `duration_s=60`; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Controller of the joint (default: the first controller).
    #[arg(long, value_name = "NAME")]
    controller: Option<String>,
    /// Axis, from 0 (default: all axes of an arm, else axis 0).
    #[arg(long, value_name = "AXIS")]
    axis: Option<usize>,
    /// Treat the axes of the recording as coupled, as in an arm. Only for recordings.
    #[arg(long)]
    coupled: bool,
    /// Delay from command to force in the recording, ticks. Only for recordings.
    #[arg(long, value_name = "TICKS", default_value_t = 0.0, value_parser = delay)]
    delay_ticks: f64,
    /// Length of a segment of the frequency response, ticks.
    #[arg(long, value_name = "TICKS", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(64..=1_048_576))]
    segment_ticks: u32,
    /// Folder of the picture.
    #[arg(long, value_name = "FOLDER", default_value = "runs/identify")]
    out: PathBuf,
    /// Do not draw the picture.
    #[arg(long)]
    no_picture: bool,
    /// Print one JSON object per axis, each on its own line; tables go to standard error.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  dimsart identify                                       identify a joint with a pendulum, compare with its true values
  dimsart identify --set device.joint.axis.0.plant.load.inertia=0.08
  dimsart run identify && dimsart identify runs/latest/signals.csv
  dimsart identify my.toml --axis 1 --json               for programs
  dimsart identify identify_arm                          identify every joint of an arm, compare with its true values

Exit status: 0 identified, 1 not identifiable or an error, 2 wrong usage.";

/// True values below this are rounding errors: no relative error is printed.
const NOTHING: f64 = 1e-6;
/// Frequencies of the response.
const POINTS: usize = 60;

fn delay(text: &str) -> Result<f64, String> {
    let ticks: f64 = text.parse().map_err(|_| "not a number: give 0 to 10 ticks".to_owned())?;
    if (0.0..=10.0).contains(&ticks) { Ok(ticks) } else { Err("out of range: give 0 to 10 ticks".to_owned()) }
}

/// Recording of a joint, and its true values if known.
struct Joint {
    name: String,
    period_s: f64,
    position: Vec<f64>,
    force: Vec<f64>,
    force_timing: ForceTiming,
    turns: bool,
    /// Index of the joint and positions of all coupled axes; none of a single joint.
    coupled: Option<(usize, Vec<Vec<f64>>)>,
    truth: Truth,
}

/// True values of a joint.
enum Truth {
    Unknown,
    Of([(Quantity, f64); 6]),
    /// Inertia and gravity of an arm's joint depend on the positions of the other joints.
    OfArm(ArmParameters),
}

#[derive(Serialize)]
struct Answer<'a> {
    joint: &'a str,
    #[serde(flatten)]
    identified: &'a IdentifiedJoint,
    truth: Option<&'a [(Quantity, f64); 6]>,
    response: &'a [FrequencyPoint],
}

impl Identify {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let joints = if rig_argument::is_rig(&self.source)
            || self.source.extension().is_none() && !self.source.exists()
        {
            self.run(&rig_argument::read(Some(&self.source), &self.sets, kinds)?)?
        } else {
            self.read(&self.source)?
        };
        for (place, joint) in joints.iter().enumerate() {
            let of_axis = (joints.len() > 1).then(|| self.out.join(format!("axis_{place}")));
            self.show(joint, of_axis.as_ref().unwrap_or(&self.out), out)
                .map_err(|error| format!("{}: {error}", joint.name))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Identifies one joint and prints the result.
    fn show(
        &self,
        joint: &Joint,
        folder: &Path,
        out: &mut impl Write,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let Joint { period_s, position, force, force_timing, turns, .. } = joint;
        let others: Vec<&[f64]> = joint.others().collect();
        let (period_s, force_timing, turns) = (*period_s, *force_timing, *turns);
        let identified =
            identify(&Experiment { period_s, position, force, force_timing, turns, others: &others })?;
        let truth = joint.truth(&identified.others_at)?;
        let segment = usize::try_from(self.segment_ticks)?;
        let points = frequency_response(period_s, force, position, segment, POINTS);
        say(self.json, out, |text| print(text, joint, &identified, truth.as_ref()))?;
        if let Err(error) = &points {
            say(self.json, out, |text| {
                writeln!(text, "no frequency response ({error}): record longer, or reduce --segment-ticks")
            })?;
        }
        let points = points.unwrap_or_default();
        if !self.no_picture && !points.is_empty() {
            let unit = response_unit(turns);
            let title = format!("{}: position over force, as recorded", joint.name);
            let bode = Bode { title, unit: unit.to_owned(), points: points.clone() };
            let svg = report::write_bode(folder, &bode)?;
            say(self.json, out, |text| writeln!(text, "picture: {}", svg.display()))?;
        }
        if self.json {
            let (name, truth) = (&joint.name, truth.as_ref());
            let answer = Answer { joint: name, identified: &identified, truth, response: &points };
            writeln!(out, "{}", serde_json::to_string(&answer)?)?;
        }
        Ok(())
    }

    /// Runs a rig and returns the recorded joints.
    fn run(&self, file: &RigFile) -> Result<Vec<Joint>, Box<dyn std::error::Error>> {
        let controllers = &file.controllers;
        let wanted = self.controller.as_ref();
        let found = controllers.iter().find(|found| wanted.is_none_or(|name| name == found.name()));
        let found = found.ok_or_else(|| {
            UsageError(format!(
                "the rig has no controller {}: correct --controller",
                wanted.map_or("", String::as_str)
            ))
        })?;
        let device = file.devices.iter().find(|device| device.name == found.device);
        let device = device.ok_or_else(|| {
            UsageError(format!("the rig has no device {}: correct the rig file", found.device))
        })?;
        let axes = self.axes(device.coupled_axes());
        let is_measured = device.measures.iter().any(|measured| measured == "FORCE");
        let run = experiment::Experiment::new(file)?.run(&AtomicBool::new(false), |_| ());
        let column = |signal: &str, axis: usize| {
            let place = run.recording.find(found.name(), signal, Some(axis));
            let missing = || {
                UsageError(format!(
                    "the run did not record {signal} of axis {axis}: add the signal to `measures`"
                ))
            };
            place.map(|place| run.recording.column(place).collect()).ok_or_else(missing)
        };
        let positions = |_| (0..device.axes.len()).map(|axis| column("POSITION", axis)).collect();
        let coupled: Option<Vec<Vec<f64>>> = device.coupled_axes().map(positions).transpose()?;
        let force = if is_measured { "FORCE" } else { "DES_FORCE" };
        let joint = |axis: usize| -> Result<Joint, Box<dyn std::error::Error>> {
            let section = device.axes.get(axis);
            let section = section
                .ok_or_else(|| UsageError(format!("the device has no axis {axis}: correct --axis")))?;
            let of_plant = section.plant.as_ref().and_then(|plant| true_parameters(plant, is_measured));
            let of_arm = device.arm.clone().map(Truth::OfArm);
            Ok(Joint {
                name: format!("{}, axis {axis}, from {force}", found.name()),
                period_s: file::period_s(run.recording.time_s()).map_err(UsageError)?,
                position: column("POSITION", axis)?,
                force: column(force, axis)?,
                force_timing: force_timing(is_measured, device),
                turns: section.unit == AxisUnit::Radian,
                coupled: coupled.clone().map(|positions| (axis, positions)),
                truth: of_arm.or(of_plant.map(Truth::Of)).unwrap_or(Truth::Unknown),
            })
        };
        axes.map(joint).collect()
    }

    /// The axes to identify, of `coupled` axes.
    fn axes(&self, coupled: Option<usize>) -> std::ops::Range<usize> {
        match (self.axis, coupled) {
            (Some(axis), _) => axis..axis + 1,
            (None, Some(count)) => 0..count,
            (None, None) => 0..1,
        }
    }
}

impl Joint {
    /// Positions of the coupled joints.
    fn others(&self) -> impl Iterator<Item = &[f64]> {
        self.coupled.iter().flat_map(|(own, positions)| {
            let others = positions.iter().enumerate().filter(move |(axis, _)| axis != own);
            others.map(|(_, position)| position.as_slice())
        })
    }

    /// True values, if known, with the other joints held at `others_at`.
    fn truth(&self, others_at: &[f64]) -> Result<Option<[(Quantity, f64); 6]>, ParameterError> {
        match (&self.truth, &self.coupled) {
            (Truth::Of(truth), _) => Ok(Some(*truth)),
            (Truth::OfArm(arm), Some((axis, _))) => {
                let (before, behind) = others_at.split_at_checked(*axis).unwrap_or_default();
                true_arm_joint_parameters(arm, *axis, &[before, &[0.0], behind].concat())
            }
            _ => Ok(None),
        }
    }
}

fn force_timing(is_measured: bool, device: &DeviceSection) -> ForceTiming {
    if is_measured { ForceTiming::Measured } else { ForceTiming::Held { delay_ticks: device.delay_ticks } }
}

/// Unit of the frequency response.
const fn response_unit(turns: bool) -> &'static str {
    if turns { "rad/(N·m)" } else { "m/N" }
}

fn print(
    out: &mut dyn Write,
    joint: &Joint,
    identified: &IdentifiedJoint,
    truth: Option<&[(Quantity, f64); 6]>,
) -> std::io::Result<()> {
    writeln!(
        out,
        "{}: {} intervals of motion, {:.2} % of the force unexplained by the model",
        joint.name,
        identified.windows,
        100.0 * identified.unexplained
    )?;
    let mut table = text_table();
    table.set_header(["quantity", "unit", "estimate", "± (95 %)", "true value", "error"]);
    for Estimate { quantity, value } in &identified.estimates {
        let known = truth.into_iter().flatten().find(|(of, _)| of == quantity).map(|(_, truth)| *truth);
        let (estimate, half_width) = match value {
            Some((value, half_width)) => (format!("{value:.5}"), format!("{half_width:.5}")),
            None => ("not identifiable from this motion".to_owned(), String::new()),
        };
        let off = known.zip(*value).filter(|(truth, _)| truth.abs() > NOTHING);
        let off = off
            .map_or(String::new(), |(truth, (value, _))| format!("{:.2} %", 100.0 * (value / truth - 1.0)));
        let unit = quantity.unit(joint.turns);
        let truth = known.map_or("-".to_owned(), |truth| format!("{truth:.5}"));
        table.add_row([quantity.to_string(), unit.to_owned(), estimate, half_width, truth, off]);
    }
    writeln!(out, "{table}")
}
