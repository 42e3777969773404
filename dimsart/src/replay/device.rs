//! A device in a recording.

use dimsart_core::{
    AxisKind, DataType, DescriptorError, DeviceDescriptor, Format, InputLimits, Shape, Summary, Unit, types,
};
use hil_sim::untrusted_text::{escape_line, escape_word};
use serde::{Deserialize, Serialize};

/// Description of a simulated device for its controller: forces have symmetric limits, and 0 as their safe value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeviceDescription {
    name: String,
    axes: Vec<AxisKind>,
    sample_period_s: f32,
    measures: Vec<TypeFacts>,
    takes: Vec<TypeFacts>,
    /// Maximum of each word, by command type.
    #[serde(default)]
    limits: Vec<Vec<f32>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct TypeFacts {
    id: u16,
    name: String,
    unit: Unit,
    format: Format,
    shape: Shape,
}

impl From<&DeviceDescriptor> for DeviceDescription {
    fn from(device: &DeviceDescriptor) -> Self {
        let facts = |types: &[&DataType]| types.iter().map(|data_type| TypeFacts::from(*data_type)).collect();
        Self {
            name: device.name().to_owned(),
            axes: device.axes().to_vec(),
            sample_period_s: device.sample_period_s(),
            measures: facts(device.outputs),
            takes: facts(device.inputs),
            limits: device
                .limits()
                .iter()
                .map(|of_type| of_type.iter().map(|word| word.max).collect())
                .collect(),
        }
    }
}

impl From<&DataType> for TypeFacts {
    fn from(&DataType { id, name, unit, format, shape, .. }: &DataType) -> Self {
        Self { id, name: name.to_owned(), unit, format, shape }
    }
}

impl DeviceDescription {
    /// Creates the device. Its names and types stay in memory until the program ends.
    ///
    /// # Errors
    /// [`DescriptorError`] for an invalid description.
    pub fn descriptor(self) -> Result<DeviceDescriptor, DescriptorError> {
        let types = |facts: Vec<TypeFacts>| -> &'static [&'static DataType] {
            Vec::leak(facts.into_iter().map(TypeFacts::data_type).collect())
        };
        let Self { name, axes, sample_period_s, measures, takes, limits } = self;
        let limit = |max: f32| InputLimits { min: -max, max, ..InputLimits::NONE };
        let of_type = |of_type: Vec<f32>| &*Vec::leak(of_type.into_iter().map(limit).collect());
        let device = DeviceDescriptor::new(
            String::leak(escape_line(&name)),
            &axes,
            sample_period_s,
            types(measures),
            types(takes),
        )?;
        // Missing in a recording of an older version.
        if limits.is_empty() {
            return Ok(device);
        }
        device.with_limits(Vec::leak(limits.into_iter().map(of_type).collect()))
    }
}

impl TypeFacts {
    fn data_type(self) -> &'static DataType {
        if let Some(standard) = types::find_by_id(self.id).filter(|standard| Self::from(*standard) == self) {
            return standard;
        }
        let Self { id, name, unit, format, shape } = self;
        let summary = Summary::new("Of the recorded device.");
        Box::leak(Box::new(DataType {
            id,
            name: String::leak(escape_word(&name)),
            unit,
            format,
            shape,
            summary,
        }))
    }
}
