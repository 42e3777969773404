//! Frame: transfer of measurements and commands between the device and the Data Base.

use heapless::Vec;

use crate::data_base::DataBase;
use crate::data_base::storage::{Block, StorageError};
use crate::device::{DeviceDescriptor, Plausibility};
use crate::limits::MAX_DEVICE_TYPES;
use crate::signal::{DataType, Format, TypeRef, Word};

/// Reason why a frame was refused. Nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// The number of words does not match the descriptor's types.
    Length {
        /// Words of the descriptor's types.
        expected: usize,
        /// Words in the frame.
        found: usize,
    },
    /// A word is NaN or infinite.
    NotFinite {
        /// The signal.
        signal: TypeRef,
        /// Word of the signal, from 0.
        word: u16,
    },
    /// An implausible measurement: out of its [limits](crate::OutputLimits), or changed too fast since the
    /// previous tick.
    Implausible {
        /// The signal.
        signal: TypeRef,
        /// Word of the signal, from 0.
        word: u16,
        /// The value, `f32` bits.
        bits: u32,
    },
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { expected, found } => {
                write!(f, "frame has {found} words, but the device's data types need {expected}")
            }
            Self::NotFinite { signal, word } => {
                write!(f, "word {word} of data type {} is NaN or infinite", signal.id)
            }
            Self::Implausible { signal, word, bits } => {
                let value = f32::from_bits(*bits);
                write!(
                    f,
                    "word {word} of data type {} is {value}: out of the sensor's range, or changed too fast",
                    signal.id
                )
            }
        }
    }
}

impl core::error::Error for FrameError {}

/// Transfers whole frames between a device and the Data Base.
///
/// A frame contains the words of the descriptor's types, concatenated in the descriptor's order.
#[derive(Debug)]
pub struct Frame {
    outputs: Side,
    inputs: Side,
    plausibility: Plausibility,
}

#[derive(Debug)]
struct Side {
    types: Vec<(Block, &'static DataType), MAX_DEVICE_TYPES>,
    /// Block of the device's types. It comes before all module signals, so that it never moves.
    span: Block,
}

impl Frame {
    /// Creates the frame of a device without types.
    pub(crate) const fn unconnected() -> Self {
        Self { outputs: Side::EMPTY, inputs: Side::EMPTY, plausibility: Plausibility::unconnected() }
    }

    /// Inserts the device's types into the Data Base.
    ///
    /// # Errors
    /// [`StorageError`] when they do not fit; the frame is [disconnected](Self::disconnect) then.
    pub(crate) fn connect(
        &mut self,
        data_base: &mut DataBase,
        device: &DeviceDescriptor,
    ) -> Result<(), StorageError> {
        self.plausibility.connect(device);
        let outputs = self.outputs.connect(device.outputs, data_base, device.dof());
        let connected = outputs.and_then(|()| self.inputs.connect(device.inputs, data_base, device.dof()));
        connected.inspect_err(|_| self.disconnect())
    }

    /// Resets to the frame of a device without types.
    fn disconnect(&mut self) {
        self.outputs.disconnect();
        self.inputs.disconnect();
        self.plausibility.disconnect();
    }

    /// Returns the number of words of a frame from the device.
    #[must_use]
    pub fn output_words(&self) -> usize {
        self.outputs.words()
    }

    /// Returns the number of words of a frame to the device.
    #[must_use]
    pub fn input_words(&self) -> usize {
        self.inputs.words()
    }

    /// Writes a measurement into the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong, or a word is not finite or implausible; the Data Base is
    /// unchanged.
    #[doc(alias = "DB_ext_write")]
    pub fn write(&mut self, data_base: &mut DataBase, measured: &[Word]) -> Result<(), FrameError> {
        let words = data_base.storage_mut().words_mut(self.outputs.span);
        self.outputs.check(measured.iter().copied())?;
        if self.plausibility.has_limits() && !self.plausibility.look_at(measured) {
            let place = self.plausibility.implausible(measured).unwrap_or(0);
            return Err(self.outputs.refusal(place, measured));
        }
        for (word, measured) in words.unwrap_or_default().iter_mut().zip(measured) {
            *word = measured.0;
        }
        Ok(())
    }

    /// Accepts the next measurement whatever the last one was.
    #[cold]
    #[inline(never)]
    pub(crate) fn begin_anew(&mut self) {
        self.plausibility.begin_anew();
    }

    /// Writes the device's actual inputs into the Data Base in place of the commands.
    pub(crate) fn show(&self, data_base: &mut DataBase, given: impl Iterator<Item = (usize, Word)>) {
        let words = data_base.storage_mut().words_mut(self.inputs.span).unwrap_or_default();
        for (place, given) in given {
            if let Some(word) = words.get_mut(place) {
                *word = given.0;
            }
        }
    }

    /// Reads the commands to the device from the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong; `commanded` is unchanged. Words that modules write are
    /// [checked](crate::Engine::step) before.
    #[doc(alias = "DB_ext_read")]
    pub fn read(&self, data_base: &DataBase, commanded: &mut [Word]) -> Result<(), FrameError> {
        let words = data_base.storage().words(self.inputs.span);
        self.inputs.read(words.unwrap_or_default(), commanded)
    }
}

impl Side {
    const EMPTY: Self = Self { types: Vec::new(), span: Block { offset: 0, words: 0 } };

    #[inline(never)]
    fn connect(
        &mut self,
        types: &'static [&'static DataType],
        data_base: &mut DataBase,
        dof: usize,
    ) -> Result<(), StorageError> {
        self.disconnect();
        for data_type in types {
            let slot = data_base.insert(data_type, data_type.first(), dof)?;
            let block = data_base.storage().block(slot);
            if self.types.is_empty() {
                self.span.offset = block.offset;
            }
            self.types.push((block, data_type)).map_err(|_| StorageError::OutOfSlots)?;
            self.span.words += block.words;
        }
        Ok(())
    }

    fn disconnect(&mut self) {
        self.types.clear();
        self.span = Block { offset: 0, words: 0 };
    }

    fn words(&self) -> usize {
        usize::from(self.span.words)
    }

    /// Returns the error for a word of the frame.
    #[cold]
    fn refusal(&self, place: u16, measured: &[Word]) -> FrameError {
        let bits = measured.get(usize::from(place)).map_or(0, |word| word.0);
        let mut word = place;
        for (block, data_type) in &self.types {
            if word < block.words {
                return FrameError::Implausible { signal: data_type.first(), word, bits };
            }
            word -= block.words;
        }
        FrameError::Length { expected: self.words(), found: measured.len() }
    }

    fn read(&self, words: &[u32], commanded: &mut [Word]) -> Result<(), FrameError> {
        self.has_length(commanded.len())?;
        for (commanded, word) in commanded.iter_mut().zip(words) {
            *commanded = Word(*word);
        }
        Ok(())
    }

    #[inline]
    fn check(&self, mut words: impl ExactSizeIterator<Item = Word> + Clone) -> Result<(), FrameError> {
        self.has_length(words.len())?;
        // A finite `f32` is valid in every format; other words need a check by type.
        if words.clone().all(|word| word.is_valid(Format::F32)) {
            Ok(())
        } else {
            self.find_fault(&mut words)
        }
    }

    /// Finds the first word that is invalid for its type.
    #[cold]
    fn find_fault(&self, words: &mut dyn Iterator<Item = Word>) -> Result<(), FrameError> {
        for (block, data_type) in &self.types {
            for word in 0..block.words {
                if words.next().is_some_and(|word| !word.is_valid(data_type.format)) {
                    return Err(FrameError::NotFinite { signal: data_type.first(), word });
                }
            }
        }
        Ok(())
    }

    fn has_length(&self, found: usize) -> Result<(), FrameError> {
        let expected = self.words();
        if found == expected { Ok(()) } else { Err(FrameError::Length { expected, found }) }
    }
}
