//! Descriptions in responses.

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{AxisKind, ModuleKind, ModuleRef};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Identity of the device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// [`PROTOCOL_VERSION`](super::PROTOCOL_VERSION) of the device.
    pub protocol_version: u16,
    /// Name of the device.
    pub device: &'a str,
    /// Name of the image.
    pub image: &'a str,
    /// The type of motion on each axis, one entry per degree of freedom.
    pub axes: Vec<AxisKind, MAX_DOF>,
    /// Time between two ticks, `s`.
    pub sample_period_s: f32,
}

/// A kind of module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleDescription<'a> {
    /// Name in schemes.
    pub name: &'a str,
}

impl From<&ModuleKind> for ModuleDescription<'static> {
    fn from(kind: &ModuleKind) -> Self {
        Self { name: kind.name }
    }
}

/// A module instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct InstanceDescription {
    /// The module.
    pub module: ModuleRef,
    /// Position in the plug-in order, from 0; `None` if it is not plugged in.
    pub place: Option<u8>,
}
