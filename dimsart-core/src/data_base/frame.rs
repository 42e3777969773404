//! The frame's side of the Data Base: what the device measured in, what it is commanded out.

use heapless::Vec;

use crate::data_base::DataBase;
use crate::data_base::storage::{Block, StorageError};
use crate::device::{DeviceDescriptor, Plausibility};
use crate::limits::MAX_DEVICE_TYPES;
use crate::signal::{DataType, Format, TypeRef, Word};

/// Why a frame was refused. Neither side has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// The frame has another number of words than the descriptor's types.
    Length {
        /// Words of the descriptor's types.
        expected: usize,
        /// Words in the frame.
        found: usize,
    },
    /// A number is not finite.
    NotFinite {
        /// The signal it belongs to.
        signal: TypeRef,
        /// Which of its words, starting at 0.
        word: u16,
    },
    /// A sensor shows what it cannot: it is beyond its [limits](crate::OutputLimits), or has changed faster than they
    /// allow since the tick before.
    Implausible {
        /// The signal.
        signal: TypeRef,
        /// Which of its words, starting at 0.
        word: u16,
        /// What it shows, an `f32` in bits.
        bits: u32,
    },
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { expected, found } => {
                write!(f, "frame of {found} words, the device's types have {expected}")
            }
            Self::NotFinite { signal, word } => {
                write!(f, "word {word} of type {} is not a finite number", signal.id)
            }
            Self::Implausible { signal, word, bits } => {
                let value = f32::from_bits(*bits);
                write!(
                    f,
                    "word {word} of type {} shows {value}, which it cannot so soon, or never",
                    signal.id
                )
            }
        }
    }
}

impl core::error::Error for FrameError {}

/// Moves whole frames between a device and the Data Base: all of it or nothing.
///
/// A frame is the words of the descriptor's types one behind the other, in the descriptor's order.
#[derive(Debug)]
pub struct Frame {
    outputs: Side,
    inputs: Side,
    plausibility: Plausibility,
}

#[derive(Debug)]
struct Side {
    types: Vec<(Block, &'static DataType), MAX_DEVICE_TYPES>,
    /// Where all of them lie, one behind the other, before all that comes and goes with the modules: they never move.
    span: Block,
}

impl Frame {
    /// The frame of a device without types.
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

    /// Becomes the frame of a device without types.
    fn disconnect(&mut self) {
        self.outputs.disconnect();
        self.inputs.disconnect();
        self.plausibility.disconnect();
    }

    /// Words of a frame from the device.
    #[must_use]
    pub fn output_words(&self) -> usize {
        self.outputs.words()
    }

    /// Words of a frame to the device.
    #[must_use]
    pub fn input_words(&self) -> usize {
        self.inputs.words()
    }

    /// Writes what the device measured into the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong, a number is not finite, or a sensor shows what it cannot; the Data Base is
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

    /// What the device measures next is where it is, however far from where it was.
    #[cold]
    #[inline(never)]
    pub(crate) fn begin_anew(&mut self) {
        self.plausibility.begin_anew();
    }

    /// Puts what the device got into the Data Base, instead of what it was commanded.
    pub(crate) fn show(&self, data_base: &mut DataBase, given: impl Iterator<Item = (usize, Word)>) {
        let words = data_base.storage_mut().words_mut(self.inputs.span).unwrap_or_default();
        for (place, given) in given {
            if let Some(word) = words.get_mut(place) {
                *word = given.0;
            }
        }
    }

    /// Reads what the device is commanded out of the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong; `commanded` is unchanged. What modules write is
    /// [looked at](crate::Engine::step) before.
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
            self.types.push((block, data_type)).map_err(|_| StorageError::NoSlot)?;
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

    /// Of the word at a place of the frame.
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
        // What is finite as a float is valid in every format; only otherwise it takes a closer look.
        if words.clone().all(|word| word.is_valid(Format::F32)) {
            Ok(())
        } else {
            self.find_fault(&mut words)
        }
    }

    /// Which word is no valid value of its type, if any.
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
