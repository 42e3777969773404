//! What a device is, as far as a control scheme needs to know.

use core::iter;

use crate::device::input_limits::{InputLimits, LimitsFault};
use crate::device::output_limits::OutputLimits;
use crate::limits::{MAX_DEVICE_TYPES, MAX_DOF, MAX_LIMITED_WORDS};
use crate::signal::{AxisKind, DataType, Format};

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
    limits: &'static [&'static [InputLimits]],
    output_limits: &'static [OutputLimits],
}

/// From here on types have a device's own numbers.
const OWN_TYPES: u16 = 0x8000;

/// A word of a device's inputs that has limits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LimitedWord {
    /// Place in the frame to the device.
    pub(crate) place: usize,
    /// Place within its type.
    pub(crate) axis: usize,
    pub(crate) data_type: &'static DataType,
    pub(crate) limits: &'static InputLimits,
}

/// The device that is served, once there is one; until then it has no axes and types.
#[derive(Debug)]
pub(crate) struct Served(pub(crate) Option<DeviceDescriptor>);

impl core::ops::Deref for Served {
    type Target = DeviceDescriptor;

    fn deref(&self) -> &DeviceDescriptor {
        self.0.as_ref().unwrap_or(DeviceDescriptor::NONE)
    }
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
    /// Two types have the same number or name, or one is there twice.
    SameType {
        /// The number of the second one.
        id: u16,
        /// Place of the first one among the outputs and, behind them, the inputs, from 0.
        first: usize,
        /// Place of the second one.
        second: usize,
    },
    /// A type of the device's own has a number below 0x8000, which is the standard catalogue's.
    OwnType {
        /// Its number.
        id: u16,
    },
    /// Limits are declared for another number of inputs, or of words of an input.
    LimitsCount {
        /// Inputs, or words of an input.
        expected: usize,
        /// Declared.
        found: usize,
    },
    /// More than [`MAX_LIMITED_WORDS`] words have limits.
    TooManyLimits {
        /// Words with limits.
        wanted: usize,
    },
    /// The limits of an output are no range, or allow no change in a tick; or its type is not of format `f32`.
    OutputLimits {
        /// The output's place, from 0.
        output: usize,
    },
    /// The limits of a word cannot be kept.
    Limits {
        /// The word's place in the frame to the device, from 0.
        word: usize,
        /// Why.
        fault: LimitsFault,
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
                "the device's type {id}, at place {second} of its outputs and inputs, has the number or the name of the \
                 one at place {first}: each can be there once"
            ),
            Self::OwnType { id } => write!(
                f,
                "the device's type {id} is none of the standard catalogue: types of a device's own count from 0x8000"
            ),
            Self::LimitsCount { expected, found } => write!(
                f,
                "limits for {found} where the device has {expected}: declare them for every input, and in each for \
                 every word, one for all, or none"
            ),
            Self::TooManyLimits { wanted } => {
                write!(f, "limits for {wanted} words: at most {MAX_LIMITED_WORDS} are possible")
            }
            Self::OutputLimits { output } => write!(
                f,
                "limits of output {output}: the range must be finite, the rate above 0, the format f32"
            ),
            Self::Limits { word, fault } => write!(f, "limits of word {word} of the inputs: {fault}"),
        }
    }
}

impl core::error::Error for DescriptorError {}

impl DeviceDescriptor {
    /// What stands in until there is a device: no axes, no types, no period.
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
    /// [`DescriptorError`] when there are 0 or more than [`MAX_DOF`] axes, the period is unusable, one way has more
    /// than [`MAX_DEVICE_TYPES`] types, two of them all have the same number or name, or one of the device's own has a
    /// number of the standard catalogue.
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

    /// With limits of its inputs, in their order: of each word of an input, one for all of its words, or none. Inputs
    /// without limits get any finite number, and zero as their safe value.
    ///
    /// # Errors
    /// [`DescriptorError`] when there are limits for another number of inputs or words, for more than
    /// [`MAX_LIMITED_WORDS`], or such as cannot be kept.
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

    /// With limits of its first outputs, in their order: a measurement beyond them is refused. The other outputs may show
    /// any finite number.
    ///
    /// # Errors
    /// [`DescriptorError`] when there are limits for more outputs than it has, for more than [`MAX_LIMITED_WORDS`] words, or
    /// such as no sensor can keep.
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

    /// The [limits](Self::with_limits) of its inputs; empty without any.
    #[must_use]
    pub fn limits(&self) -> &'static [&'static [InputLimits]] {
        self.limits
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

    /// Time between two ticks, `s`; for a module that is [prepared](crate::Module::prepare), between two of those in which
    /// it runs.
    #[must_use]
    pub fn sample_period_s(&self) -> f32 {
        self.sample_period_s
    }

    /// Ticks that come nearest to a time of at least 0; saturates.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    pub fn ticks(&self, time_s: f32) -> u32 {
        (time_s / self.sample_period_s + 0.5) as u32
    }

    /// As a module sees it that runs in one of so many ticks.
    pub(crate) fn with_period_of(&self, every_ticks: u8) -> Self {
        let sample_period_s = self.sample_period_s * f32::from(every_ticks);
        Self { sample_period_s, ..self.clone() }
    }

    /// Finds a type by number among the device's own and the standard ones.
    #[must_use]
    pub fn data_type(&self, id: u16) -> Option<&'static DataType> {
        self.own_types().find(|data_type| data_type.id == id).or_else(|| crate::signal::types::by_id(id))
    }

    /// Finds a type by name among the device's own and the standard ones.
    #[must_use]
    pub fn data_type_named(&self, name: &str) -> Option<&'static DataType> {
        self.own_types()
            .find(|data_type| data_type.name == name)
            .or_else(|| crate::signal::types::by_name(name))
    }

    /// How many of its outputs, the last ones, are the last ones of [`types::TIMING`](crate::types::TIMING): each is a word.
    #[must_use]
    pub fn timing_outputs(&self) -> usize {
        let both = self.outputs.iter().rev().zip(crate::signal::types::TIMING.iter().rev());
        both.take_while(|(output, timing)| output == timing).count()
    }

    /// Words of all its inputs.
    pub(crate) fn input_words(&self) -> usize {
        self.inputs.iter().map(|data_type| data_type.shape.words(self.dof())).sum()
    }

    /// The place of a type's first word among those of its outputs.
    pub(crate) fn output_place(&self, wanted: &DataType) -> Option<usize> {
        let before = self.outputs.iter().take_while(|data_type| **data_type != wanted);
        let words = |data_type: &&DataType| data_type.shape.words(self.dof());
        self.outputs.contains(&wanted).then(|| before.map(words).sum())
    }

    /// The word at a place of its inputs, if it has limits.
    ///
    /// By its place: an iterator over all of them is many times the size.
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

    /// Limits of the words of its outputs that have some: they are the first ones.
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
            return Err(DescriptorError::SameType { id, first, second });
        }
        if id < OWN_TYPES && crate::signal::types::by_id(id) != Some(data_type) {
            return Err(DescriptorError::OwnType { id });
        }
    }
    Ok(())
}
