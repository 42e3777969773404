//! What a device is, as far as a control scheme needs to know.

use crate::data_type::DataType;
use crate::frame::MAX_DEVICE_TYPES;
use crate::limits::MAX_DOF;
use crate::unit::AxisKind;

/// Degrees of freedom, sample period, and the types a device gives and takes.
///
/// The only thing the core ever learns about hardware.
#[doc(alias = "Frame Descriptor")]
#[derive(Debug, Clone)]
pub struct DeviceDescriptor {
    name: &'static str,
    axes: heapless::Vec<AxisKind, MAX_DOF, u8>,
    sample_period_s: f32,
    /// Types the device measures: written into the Data Base by the frame before every step.
    pub outputs: &'static [&'static DataType],
    /// Types the device is commanded by: read from the Data Base by the frame after every step.
    pub inputs: &'static [&'static DataType],
}

/// Why a descriptor was refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DescriptorError {
    /// The number of axes is 0 or above [`MAX_DOF`].
    Dof {
        /// Axes asked for.
        wanted: usize,
    },
    /// The sample period is not a finite number above 0.
    SamplePeriod {
        /// Period asked for, `s`.
        wanted_s: f32,
    },
    /// More than [`MAX_DEVICE_TYPES`] outputs, or inputs.
    TooManyTypes {
        /// Types asked for.
        wanted: usize,
    },
    /// The same type is twice among the outputs, or the inputs.
    SameType {
        /// Its number.
        id: u16,
        /// Place of the first one, from 0.
        first: usize,
        /// Place of the second one.
        second: usize,
    },
}

impl core::fmt::Display for DescriptorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Dof { wanted } => {
                write!(f, "a device with {wanted} degrees of freedom: 1 to {MAX_DOF} are possible")
            }
            Self::SamplePeriod { wanted_s } => {
                write!(f, "a sample period of {wanted_s} s: it must be finite and above 0")
            }
            Self::TooManyTypes { wanted } => {
                write!(f, "a device with {wanted} types one way: at most {MAX_DEVICE_TYPES} are possible")
            }
            Self::SameType { id, first, second } => write!(
                f,
                "the device's type {id} is at place {first} and again at place {second}: each type can be there once"
            ),
        }
    }
}

impl core::error::Error for DescriptorError {}

impl DeviceDescriptor {
    /// Describes a device with one entry of `axes` per degree of freedom.
    ///
    /// # Errors
    /// [`DescriptorError`] when there are 0 or more than [`MAX_DOF`] axes, the period is unusable, or one
    /// way has more than [`MAX_DEVICE_TYPES`] types or one of them twice.
    pub fn new(
        name: &'static str,
        axes: &[AxisKind],
        sample_period_s: f32,
        outputs: &'static [&'static DataType],
        inputs: &'static [&'static DataType],
    ) -> Result<Self, DescriptorError> {
        let dof = DescriptorError::Dof { wanted: axes.len() };
        let axes = heapless::Vec::from_slice(axes).ok().filter(|axes| !axes.is_empty()).ok_or(dof)?;
        if !(sample_period_s.is_finite() && sample_period_s > 0.0) {
            return Err(DescriptorError::SamplePeriod { wanted_s: sample_period_s });
        }
        check_types(outputs)?;
        check_types(inputs)?;
        Ok(Self { name, axes, sample_period_s, outputs, inputs })
    }

    /// Name for reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Degrees of freedom, 1 to [`MAX_DOF`].
    #[must_use]
    pub fn dof(&self) -> usize {
        self.axes.len()
    }

    /// What moves on each axis.
    #[must_use]
    pub fn axes(&self) -> &[AxisKind] {
        &self.axes
    }

    /// Time between two ticks, `s`.
    #[must_use]
    pub fn sample_period_s(&self) -> f32 {
        self.sample_period_s
    }

    /// Finds a type by number among the device's own and the standard ones.
    #[must_use]
    pub fn data_type(&self, id: u16) -> Option<&'static DataType> {
        self.own_types().find(|data_type| data_type.id == id).or_else(|| crate::types::by_id(id))
    }

    /// Finds a type by name among the device's own and the standard ones.
    #[must_use]
    pub fn data_type_named(&self, name: &str) -> Option<&'static DataType> {
        self.own_types().find(|data_type| data_type.name == name).or_else(|| crate::types::by_name(name))
    }

    fn own_types(&self) -> impl Iterator<Item = &'static DataType> {
        self.outputs.iter().chain(self.inputs).copied()
    }
}

fn check_types(types: &[&'static DataType]) -> Result<(), DescriptorError> {
    if types.len() > MAX_DEVICE_TYPES {
        return Err(DescriptorError::TooManyTypes { wanted: types.len() });
    }
    for (second, data_type) in types.iter().enumerate() {
        let id = data_type.id;
        if let Some(first) = types.iter().take(second).position(|found| found.id == id) {
            return Err(DescriptorError::SameType { id, first, second });
        }
    }
    Ok(())
}
