//! Descriptions of an engine's modules, ports and types.

use super::Engine;
use crate::device::DeviceDescriptor;
use crate::module::{KindId, ModuleRef};
use crate::signal::{AxisKind, DataType, types};
use crate::vocabulary::{DataTypeDescription, ParameterDescription, PortDescription, Vocabulary};

impl Vocabulary for Engine {
    fn device_name(&self) -> &str {
        self.device.name()
    }

    fn axes(&self) -> &[AxisKind] {
        self.device.axes()
    }

    fn kind_at(&self, place: u8) -> Option<&str> {
        self.kinds().list().get(usize::from(place)).map(|kind| kind.name)
    }

    fn kind_name(&self, kind: KindId) -> Option<&str> {
        self.kind(kind).map(|kind| kind.name)
    }

    fn parameter_text(&self, kind: KindId, index: u8) -> Option<ParameterDescription<'_>> {
        self.kinds().describe_parameter(kind, index)?.try_into().ok()
    }

    fn port_text(&self, module: ModuleRef, index: u8) -> Option<PortDescription<'_>> {
        self.describe_port(module, index)
    }

    fn type_text(&self, index: u16) -> Option<DataTypeDescription<'_>> {
        type_at(&self.device, index).map(DataTypeDescription::from)
    }
}

impl Engine {
    /// Describes a port like [`Vocabulary::port_text`], with texts of the image.
    #[must_use]
    pub fn describe_port(&self, module: ModuleRef, index: u8) -> Option<PortDescription<'static>> {
        let spec = self.port(module, index)?;
        let default = spec.data_type.map(|(_, signal)| signal);
        let bound = default.map(|default| self.binding(module, spec.name).unwrap_or(default));
        let is_delayed = spec.is_delayed;
        Some(PortDescription {
            name: spec.name,
            direction: spec.direction,
            stage: spec.stage,
            is_delayed,
            default,
            bound,
        })
    }
}

/// Returns the type at `index` of the list of standard types followed by the device's own, each once.
#[must_use]
pub fn type_at(device: &DeviceDescriptor, index: u16) -> Option<&'static DataType> {
    let own = || device.outputs.iter().chain(device.inputs).copied();
    let is_new = |(place, data_type): &(usize, &DataType)| {
        let is_same = |other: &DataType| other.id == data_type.id;
        types::find_by_id(data_type.id).is_none() && !own().take(*place).any(is_same)
    };
    let own_only = own().enumerate().filter(is_new).map(|(_, data_type)| data_type);
    types::ALL.iter().chain(own_only).nth(usize::from(index))
}
