//! Device descriptor: what a scheme needs to know of a device.

use core::iter;

use crate::device::input_limits::{InputLimits, LimitsError};
use crate::device::output_limits::OutputLimits;
use crate::limits::{MAX_DEVICE_TYPES, MAX_DOF, MAX_LIMITED_WORDS};
use crate::signal::{AxisKind, DataType, Format};

/// Describes a device: degrees of freedom, sample period, inputs and outputs.
///
/// The core has no other knowledge of the hardware.
#[doc(alias = "Frame Descriptor")]
#[derive(Debug, Clone)]
pub struct DeviceDescriptor {
    name: &'static str,
    axes: heapless::Vec<AxisKind, MAX_DOF, u8>,
    sample_period_s: f32,
    /// Types the device measures; the frame writes them into the Data Base before every step.
    pub outputs: &'static [&'static DataType],
    /// Types that command the device; the frame reads them from the Data Base after every step.
    pub inputs: &'static [&'static DataType],
    limits: &'static [&'static [InputLimits]],
    output_limits: &'static [OutputLimits],
}

/// First number of a device's own types.
const OWN_TYPES: u16 = 0x8000;

/// A device input word with limits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LimitedWord {
    /// Index in the frame to the device.
    pub(crate) place: usize,
    /// Index within its type.
    pub(crate) axis: usize,
    pub(crate) data_type: &'static DataType,
    pub(crate) limits: &'static InputLimits,
}

/// The connected device; before a device is connected, one without axes and types.
#[derive(Debug)]
pub(crate) struct Served(pub(crate) Option<DeviceDescriptor>);

impl core::ops::Deref for Served {
    type Target = DeviceDescriptor;

    fn deref(&self) -> &DeviceDescriptor {
        self.0.as_ref().unwrap_or(DeviceDescriptor::NONE)
    }
}

/// Reason why a descriptor was refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DescriptorError {
    /// The number of axes is 0 or above [`MAX_DOF`].
    Dof {
        /// Number of axes.
        wanted: usize,
    },
    /// The sample period is not a finite number above 0.
    SamplePeriod {
        /// Sample period, `s`.
        wanted_s: f32,
    },
    /// More than [`MAX_DEVICE_TYPES`] outputs or inputs.
    TooManyTypes {
        /// Number of types.
        wanted: usize,
    },
    /// Two types have the same number or name.
    DuplicateType {
        /// Number of the second type.
        id: u16,
        /// Index of the first type in outputs followed by inputs, from 0.
        first: usize,
        /// Index of the second type.
        second: usize,
    },
    /// A device's own type has a number below 0x8000, which is reserved for the standard catalogue.
    ReservedTypeId {
        /// Its number.
        id: u16,
    },
    /// The number of limits does not match the inputs, or the words of an input.
    LimitsCount {
        /// Inputs, or words of an input.
        expected: usize,
        /// Declared limits.
        found: usize,
    },
    /// More than [`MAX_LIMITED_WORDS`] words have limits.
    TooManyLimits {
        /// Words with limits.
        wanted: usize,
    },
    /// The limits of an output are no valid range, allow no change per tick, or its format is not `f32`.
    OutputLimits {
        /// Index of the output, from 0.
        output: usize,
    },
    /// The limits of an input word are invalid.
    Limits {
        /// Index of the word in the frame to the device, from 0.
        word: usize,
        /// Reason.
        fault: LimitsError,
    },
}

impl core::fmt::Display for DescriptorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Dof { wanted } => {
                write!(f, "device has {wanted} degrees of freedom: allowed are 1 to {MAX_DOF}")
            }
            Self::SamplePeriod { wanted_s } => {
                write!(f, "invalid sample period {wanted_s} s: it must be finite and above 0")
            }
            Self::TooManyTypes { wanted } => {
                write!(f, "device has {wanted} inputs or outputs: the limit is {MAX_DEVICE_TYPES} each")
            }
            Self::DuplicateType { id, first, second } => write!(
                f,
                "duplicate data type {id}, entries {first} and {second} of the device's outputs and inputs: numbers and \
                 names of types must be unique"
            ),
            Self::ReservedTypeId { id } => write!(
                f,
                "data type {id} is not in the standard catalogue: number the device's own types from 0x8000"
            ),
            Self::LimitsCount { expected, found } => write!(
                f,
                "{found} limits for {expected} inputs or words: declare one entry per input, with limits for each word, \
                 one limit for all words, or none"
            ),
            Self::TooManyLimits { wanted } => {
                write!(f, "device declares limits for {wanted} words: the maximum is {MAX_LIMITED_WORDS}")
            }
            Self::OutputLimits { output } => write!(
                f,
                "invalid limits of output {output}: the range must be finite, the rate above 0, the format f32"
            ),
            Self::Limits { word, fault } => write!(f, "invalid limits of input word {word}: {fault}"),
        }
    }
}

impl core::error::Error for DescriptorError {}

impl DeviceDescriptor {
    /// Descriptor without axes, types and period, until a device is connected.
    const NONE: &'static Self = &Self {
        name: "",
        axes: heapless::Vec::new(),
        sample_period_s: 0.0,
        outputs: &[],
        inputs: &[],
        limits: &[],
        output_limits: &[],
    };

    /// Describes a device with one entry of `axes` per degree of freedom.
    ///
    /// # Errors
    /// [`DescriptorError`] when the number of axes is not 1 to [`MAX_DOF`], the period is not finite and
    /// above 0, there are more than [`MAX_DEVICE_TYPES`] inputs or outputs, or a type's number or name is a
    /// duplicate or reserved.
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
        check_types(outputs, inputs)?;
        Ok(Self { name, axes, sample_period_s, outputs, inputs, limits: &[], output_limits: &[] })
    }

    /// Adds limits to the inputs, one entry per input in order: limits for each word, one for all words, or
    /// none. Inputs without limits accept any finite value; their safe value is zero.
    ///
    /// # Errors
    /// [`DescriptorError`] when the number of entries is wrong, more than [`MAX_LIMITED_WORDS`] words have
    /// limits, or a limit is invalid.
    pub fn with_limits(self, limits: &'static [&'static [InputLimits]]) -> Result<Self, DescriptorError> {
        let words = self.inputs.iter().map(|data_type| data_type.shape.words(self.dof()));
        let has_count = |expected, found| match found == expected {
            true => Ok(()),
            false => Err(DescriptorError::LimitsCount { expected, found }),
        };
        has_count(self.inputs.len(), limits.len())?;
        for (words, limits) in words.zip(limits).filter(|(_, limits)| limits.len() > 1) {
            has_count(words, limits.len())?;
        }
        let limited = Self { limits, ..self };
        let mut wanted = 0;
        let mut checked = Ok(());
        for place in 0..limited.input_words() {
            if let Some(LimitedWord { data_type, limits, .. }) = limited.limited_word(place) {
                let found = limits.check(data_type, limited.outputs, limited.sample_period_s);
                checked = checked.and(found.map_err(|fault| DescriptorError::Limits { word: place, fault }));
                wanted += 1;
            }
        }
        if wanted > MAX_LIMITED_WORDS {
            return Err(DescriptorError::TooManyLimits { wanted });
        }
        checked.map(|()| limited)
    }

    /// Adds limits to the first outputs, in order: a measurement beyond them is refused. The other outputs
    /// accept any finite value.
    ///
    /// # Errors
    /// [`DescriptorError`] when there are more limits than outputs, more than [`MAX_LIMITED_WORDS`] limited
    /// words, or a limit is invalid.
    pub fn with_output_limits(self, limits: &'static [OutputLimits]) -> Result<Self, DescriptorError> {
        let (expected, found) = (self.outputs.len(), limits.len());
        if found > expected {
            return Err(DescriptorError::LimitsCount { expected, found });
        }
        let is_wrong = |(data_type, limits): (&&DataType, &OutputLimits)| {
            data_type.format != Format::F32 || !limits.are_usable(self.sample_period_s)
        };
        if let Some(output) = self.outputs.iter().zip(limits).position(is_wrong) {
            return Err(DescriptorError::OutputLimits { output });
        }
        let limited = Self { output_limits: limits, ..self };
        let wanted = limited.limits_of_output_words().count();
        if wanted > MAX_LIMITED_WORDS { Err(DescriptorError::TooManyLimits { wanted }) } else { Ok(limited) }
    }

    /// Returns the [limits](Self::with_limits) of the inputs; empty if none are declared.
    #[must_use]
    pub fn limits(&self) -> &'static [&'static [InputLimits]] {
        self.limits
    }

    /// Returns the device's name, for reports.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the degrees of freedom, 1 to [`MAX_DOF`].
    #[must_use]
    pub fn dof(&self) -> usize {
        self.axes.len()
    }

    /// Returns the kind of each axis.
    #[must_use]
    pub fn axes(&self) -> &[AxisKind] {
        &self.axes
    }

    /// Returns the sample period, `s`. In [`prepare`](crate::Module::prepare) it is the period of the module:
    /// the time between its own calls.
    #[must_use]
    pub fn sample_period_s(&self) -> f32 {
        self.sample_period_s
    }

    /// Converts a time of at least 0 to ticks, rounded; saturates.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    pub fn time_to_ticks(&self, time_s: f32) -> u32 {
        (time_s / self.sample_period_s + 0.5) as u32
    }

    /// Returns the descriptor for a module that runs every `every_ticks` ticks.
    pub(crate) fn with_period_of(&self, every_ticks: u8) -> Self {
        let sample_period_s = self.sample_period_s * f32::from(every_ticks);
        Self { sample_period_s, ..self.clone() }
    }

    /// Finds a type by number among the device's own and the standard types.
    #[must_use]
    pub fn data_type(&self, id: u16) -> Option<&'static DataType> {
        self.own_types().find(|data_type| data_type.id == id).or_else(|| crate::signal::types::find_by_id(id))
    }

    /// Finds a type by name among the device's own and the standard types.
    #[must_use]
    pub fn data_type_by_name(&self, name: &str) -> Option<&'static DataType> {
        self.own_types()
            .find(|data_type| data_type.name == name)
            .or_else(|| crate::signal::types::find_by_name(name))
    }

    /// Returns how many of the outputs are timing outputs: the last outputs, equal to the last of
    /// [`types::TIMING`](crate::types::TIMING), one word each.
    #[must_use]
    pub fn timing_outputs(&self) -> usize {
        let both = self.outputs.iter().rev().zip(crate::signal::types::TIMING.iter().rev());
        both.take_while(|(output, timing)| output == timing).count()
    }

    /// Returns the number of words of all inputs.
    pub(crate) fn input_words(&self) -> usize {
        self.inputs.iter().map(|data_type| data_type.shape.words(self.dof())).sum()
    }

    /// Returns the index of a type's first word in the frame from the device.
    pub(crate) fn output_place(&self, wanted: &DataType) -> Option<usize> {
        let before = self.outputs.iter().take_while(|data_type| **data_type != wanted);
        let words = |data_type: &&DataType| data_type.shape.words(self.dof());
        self.outputs.contains(&wanted).then(|| before.map(words).sum())
    }

    /// Returns the input word at an index, if it has limits.
    #[inline(never)]
    pub(crate) fn limited_word(&self, place: usize) -> Option<LimitedWord> {
        let mut first = 0;
        for (data_type, limits) in self.inputs.iter().zip(self.limits) {
            let words = data_type.shape.words(self.dof());
            let axis = place.wrapping_sub(first);
            if axis < words {
                let limits = if limits.len() > 1 { limits.get(axis) } else { limits.first() };
                return Some(LimitedWord { place, axis, data_type, limits: limits? });
            }
            first += words;
        }
        None
    }

    /// Returns the limits of the output words that have limits, which are the first words.
    pub(crate) fn limits_of_output_words(&self) -> impl Iterator<Item = &'static OutputLimits> + '_ {
        let limited = self.outputs.iter().zip(self.output_limits);
        limited.flat_map(|(data_type, limits)| iter::repeat_n(limits, data_type.shape.words(self.dof())))
    }

    fn own_types(&self) -> impl Iterator<Item = &'static DataType> {
        self.outputs.iter().chain(self.inputs).copied()
    }
}

fn check_types(outputs: &[&'static DataType], inputs: &[&'static DataType]) -> Result<(), DescriptorError> {
    let wanted = outputs.len().max(inputs.len());
    if wanted > MAX_DEVICE_TYPES {
        return Err(DescriptorError::TooManyTypes { wanted });
    }
    let all = || outputs.iter().chain(inputs).copied();
    for (second, data_type) in all().enumerate() {
        let DataType { id, name, .. } = *data_type;
        if let Some(first) = all().take(second).position(|found| found.id == id || found.name == name) {
            return Err(DescriptorError::DuplicateType { id, first, second });
        }
        if id < OWN_TYPES && crate::signal::types::find_by_id(id) != Some(data_type) {
            return Err(DescriptorError::ReservedTypeId { id });
        }
    }
    Ok(())
}
