//! Sources of a configuration: a port or a file.

use std::error::Error;

use dimsart_core::{AxisKind, CommandError, DeviceDescriptor, ModuleKinds, types};

use super::super::UsageError;
use super::super::line::{Device, LineOptions, is_port};
use crate::config::{Configuration, first_side};
use crate::connect::ALL_DESTINATIONS;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::SchemeText;

/// A controller or a scheme file.
pub(super) enum Source {
    Device(Box<Device>),
    File(SchemeText),
}

impl Source {
    /// Opens a port, or reads a file.
    pub(super) fn open(name: &str, line: &LineOptions, kinds: ModuleKinds) -> Result<Self, Box<dyn Error>> {
        if is_port(name) {
            return Ok(Self::Device(Box::new(line.open(name, kinds)?)));
        }
        Ok(Self::File(SchemeText::read(name)?))
    }

    pub(super) fn read(
        &mut self,
        side: Option<&'static str>,
        kinds: ModuleKinds,
    ) -> Result<Configuration, Box<dyn Error>> {
        match self {
            Self::Device(device) => {
                let (rows, _) = device.configuration_text()?;
                Ok(device.read_configuration(&rows, ALL_DESTINATIONS)?)
            }
            Self::File(scheme) => without_a_device(scheme, side_of(scheme, side)?, kinds),
        }
    }
}

/// Returns the side whose rows to use; a file with rows for single sides needs `--side`.
pub(super) fn side_of(scheme: &SchemeText, side: Option<&'static str>) -> Result<&'static str, UsageError> {
    match (side, first_side(&scheme.text)) {
        (Some(side), _) => Ok(side),
        (None, None) => Ok(ALL_DESTINATIONS),
        (None, Some((line, word))) => Err(UsageError(format!(
            "{}:{line}: this row is for {word} only: select a side with --side",
            scheme.name
        ))),
    }
}

/// Reads rows by the names of this program. A file does not define its axes: units are given for linear and rotary axes.
fn without_a_device(
    scheme: &SchemeText,
    side: &str,
    kinds: ModuleKinds,
) -> Result<Configuration, Box<dyn Error>> {
    let axes = [AxisKind::Linear, AxisKind::Rotary].repeat(4);
    let device = DeviceDescriptor::new("any", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE])?;
    let dimsart = Box::new(SimulatedDimsart::new(device, kinds).map_err(CommandError::from)?);
    Ok(Configuration::read(&scheme.text, side, dimsart.engine(), &[]))
}
