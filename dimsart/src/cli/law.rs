//! `dimsart law`: control laws as text.

use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};
use dimsart_core::online::Header;
use dimsart_core::{AxisKind, Cost, DeviceDescriptor, KindId};
use hil_sim::law::MODULE;
use serde::Serialize;

use super::Ending;
use crate::stamp::StampedImage;

/// Compile control laws written as text.
///
/// `dimsart connect PORT law upload FILE` uploads a law to a running controller (docs/howto/a-law-as-text.md).
#[derive(Debug, Args)]
pub(super) struct Law {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Compile a law, and list its ports, parameters and cost, or its errors.
    Check {
        /// Law file.
        file: PathBuf,
        /// Stamped image: also print the cycles that the law adds to a tick.
        #[arg(long, value_name = "FILE")]
        image: Option<PathBuf>,
        /// Number of axes for which the cost is computed.
        #[arg(long, default_value_t = 1)]
        axes: u8,
        /// Print one JSON object.
        #[arg(long)]
        json: bool,
    },
}

/// Compiles a law file.
pub(super) fn read(path: &Path) -> Result<hil_sim::law::Law, String> {
    hil_sim::law::Law::read(path)
}

impl Law {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let Action::Check { file, image, axes, json } = self.action;
        let law = read(&file)?;
        let summary = Summary::of(&law, image.as_deref(), axes)?;
        if json {
            writeln!(out, "{}", serde_json::to_string(&summary)?)?;
        } else {
            writeln!(out, "{summary}")?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Ports, parameters and cost of a law.
#[derive(Debug, Serialize)]
struct Summary {
    name: String,
    summary: String,
    ports: Vec<Port>,
    parameters: Vec<Parameter>,
    /// Minimum number of axes; the exact number if the law computes all axes together.
    axes: u8,
    is_coupled: bool,
    /// Per tick and axis.
    instructions: u8,
    /// Per tick, once for all axes.
    instructions_once: u8,
    bytes: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    cycles: Option<Cycles>,
}

#[derive(Debug, Serialize)]
struct Port {
    name: String,
    on_device: String,
    is_written: bool,
    signal: String,
}

#[derive(Debug, Serialize)]
struct Parameter {
    name: String,
    on_device: String,
    unit: String,
    min: f32,
    max: f32,
    default: f32,
    meaning: String,
}

/// Upper bound on an image.
#[derive(Debug, Serialize)]
struct Cycles {
    image: String,
    axes: u8,
    cycles: u32,
}

impl Summary {
    fn of(
        law: &hil_sim::law::Law,
        image: Option<&Path>,
        axes: u8,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let header = law.program().map_or_else(Header::default, |program| program.header());
        let mut on_device = law.names().into_iter().map(|name| name.on_device);
        let mut next = || on_device.next().unwrap_or_default();
        let device = DeviceDescriptor::new("any", &[AxisKind::Rotary], 1e-3, &[], &[]);
        let signal = |signal| {
            device.as_ref().map_or_else(|_| String::new(), |device| device.signal_name(signal).to_string())
        };
        let inputs = law.inputs.iter().map(|port| (port, false));
        let ports = inputs.chain(law.outputs.iter().map(|port| (port, true)));
        let ports = ports.map(|(port, is_written)| Port {
            name: port.name.clone(),
            on_device: next(),
            is_written,
            signal: signal(port.signal),
        });
        let ports = ports.collect();
        let parameters = law.parameters.iter().map(|found| Parameter {
            name: found.name.clone(),
            on_device: next(),
            unit: found.parameter.unit.for_axes(&[AxisKind::Linear, AxisKind::Rotary]).to_string(),
            min: found.parameter.min,
            max: found.parameter.max,
            default: found.parameter.default,
            meaning: found.summary.clone(),
        });
        let cycles = match image {
            None => None,
            Some(path) => {
                Some(Cycles { image: path.display().to_string(), axes, cycles: cycles(law, path, axes)? })
            }
        };
        Ok(Self {
            name: law.name.clone(),
            summary: law.summary.clone(),
            ports,
            parameters: parameters.collect(),
            axes: header.axes,
            is_coupled: header.is_coupled,
            instructions: header.tick,
            instructions_once: header.once,
            bytes: 4 * law.words.len(),
            cycles,
        })
    }
}

/// Upper bound of the cycles that a law and its module add to a tick.
fn cycles(law: &hil_sim::law::Law, image: &Path, axes: u8) -> Result<u32, Box<dyn std::error::Error>> {
    let unknown = || {
        format!("image {}: the cost of laws is unknown: run `dimsart stamp` on this image", image.display())
    };
    let image = StampedImage::read(image)?;
    let (costs, kinds) = (image.costs().ok_or_else(unknown)?, image.kinds());
    let kind = kinds.iter().position(|kind| *kind == KindId::from_name(MODULE)).ok_or_else(unknown)?;
    let line = |index: usize| costs.get(index).copied().filter(|cost| *cost != Cost::UNKNOWN);
    let program = law.program().ok_or_else(unknown)?;
    let own = line(1 + kind).ok_or_else(unknown)?.cycles(axes.into());
    let of = |opcode| Some(line(1 + kinds.len() + opcode as usize)?.cycles(0));
    Ok(own + program.cycles(axes.into(), of).ok_or_else(unknown)?)
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}  {}", self.name, self.summary)?;
        for port in &self.ports {
            let Port { name, on_device, is_written, signal } = port;
            let does = if *is_written { "writes" } else { "reads" };
            writeln!(f, "  {on_device:6} {name}: {does} {signal}")?;
        }
        for parameter in &self.parameters {
            let Parameter { name, on_device, unit, min, max, default, meaning } = parameter;
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            writeln!(f, "  {on_device:6} {name}: {default}{unit}, {min} to {max}  {meaning}")?;
        }
        match (self.axes, self.is_coupled) {
            (axes, true) => {
                writeln!(f, "for devices with exactly {axes} axes; the law computes all axes together")?
            }
            (0 | 1, false) => writeln!(f, "for any device; the law computes each axis separately")?,
            (axes, false) => {
                writeln!(f, "for devices with at least {axes} axes; the law computes each axis separately")?
            }
        }
        let Self { instructions, instructions_once, bytes, .. } = self;
        write!(
            f,
            "each tick: {instructions} instructions per axis, {instructions_once} once; size: {bytes} bytes"
        )?;
        if let Some(Cycles { image, axes, cycles }) = &self.cycles {
            write!(f, "\nadds at most {cycles} cycles to a tick with {axes} axes on image {image}")?;
        }
        Ok(())
    }
}
