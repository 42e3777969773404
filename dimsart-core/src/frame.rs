//! The frame's side of the Data Base: what the device measured in, what it is commanded out.

use heapless::Vec;

use crate::data_base::DataBase;
use crate::data_type::{DataType, TypeRef};
use crate::device::DeviceDescriptor;
use crate::storage::{Block, StorageError};
use crate::word::{Format, Word};

/// Most types a device can measure, and most it can be commanded by.
pub const MAX_DEVICE_TYPES: usize = 8;

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
}

#[derive(Debug)]
struct Side {
    /// Where each type lies: before all that comes and goes with the modules, so it never moves.
    types: Vec<(Block, &'static DataType), MAX_DEVICE_TYPES>,
    words: usize,
}

impl Frame {
    /// The frame of a device without types.
    pub(crate) const fn unconnected() -> Self {
        Self { outputs: Side::EMPTY, inputs: Side::EMPTY }
    }

    /// Inserts the device's types into the Data Base.
    ///
    /// # Errors
    /// [`StorageError`] when they do not fit.
    pub(crate) fn connect<const WORDS: usize>(
        data_base: &mut DataBase<WORDS>,
        device: &DeviceDescriptor,
    ) -> Result<Self, StorageError> {
        let mut side = |types: &[&'static DataType]| {
            let mut side = Side::EMPTY;
            for data_type in types {
                let slot = data_base.insert(data_type, data_type.first(), device.dof())?;
                let block = data_base.storage().block(slot);
                side.types.push((block, data_type)).map_err(|_| StorageError::NoSlot)?;
                side.words += data_type.shape.words(device.dof());
            }
            Ok(side)
        };
        Ok(Self { outputs: side(device.outputs)?, inputs: side(device.inputs)? })
    }

    /// Words of a frame from the device.
    #[must_use]
    pub fn output_words(&self) -> usize {
        self.outputs.words
    }

    /// Words of a frame to the device.
    #[must_use]
    pub fn input_words(&self) -> usize {
        self.inputs.words
    }

    /// Writes what the device measured into the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong or a number is not finite; the Data Base is unchanged.
    #[doc(alias = "DB_ext_write")]
    pub fn write<const WORDS: usize>(
        &self,
        data_base: &mut DataBase<WORDS>,
        measured: &[Word],
    ) -> Result<(), FrameError> {
        self.outputs.has_length(measured.len())?;
        // What is finite as a float is valid in every format; only otherwise it takes a closer look.
        if !measured.iter().all(|word| word.is_valid(Format::F32)) {
            self.outputs.check(measured)?;
        }
        let storage = data_base.storage_mut();
        let mut rest = measured;
        for (block, _) in &self.outputs.types {
            let Some(targets) = storage.words_mut(*block) else { break };
            let Some((words, behind)) = rest.split_at_checked(targets.len()) else { break };
            for (target, word) in targets.iter_mut().zip(words) {
                *target = word.0;
            }
            rest = behind;
        }
        Ok(())
    }

    /// Reads what the device is commanded out of the Data Base.
    ///
    /// # Errors
    /// [`FrameError`] when the length is wrong or a number is not finite; `commanded` is unchanged.
    #[doc(alias = "DB_ext_read")]
    pub fn read<const WORDS: usize>(
        &self,
        data_base: &DataBase<WORDS>,
        commanded: &mut [Word],
    ) -> Result<(), FrameError> {
        self.inputs.has_length(commanded.len())?;
        let storage = data_base.storage();
        for (block, data_type) in &self.inputs.types {
            let Some(words) = storage.words(*block) else { break };
            check(data_type, words.iter().copied().map(Word))?;
        }
        let mut rest = commanded;
        for (block, _) in &self.inputs.types {
            let Some(words) = storage.words(*block) else { break };
            let Some((targets, behind)) = rest.split_at_mut_checked(words.len()) else { break };
            for (target, word) in targets.iter_mut().zip(words) {
                *target = Word(*word);
            }
            rest = behind;
        }
        Ok(())
    }
}

impl Side {
    const EMPTY: Self = Self { types: Vec::new(), words: 0 };

    fn check(&self, words: &[Word]) -> Result<(), FrameError> {
        let mut rest = words;
        for (block, data_type) in &self.types {
            let Some((words, behind)) = rest.split_at_checked(usize::from(block.words)) else { break };
            check(data_type, words.iter().copied())?;
            rest = behind;
        }
        Ok(())
    }

    fn has_length(&self, found: usize) -> Result<(), FrameError> {
        if found == self.words { Ok(()) } else { Err(FrameError::Length { expected: self.words, found }) }
    }
}

fn check(data_type: &DataType, words: impl Iterator<Item = Word> + Clone) -> Result<(), FrameError> {
    // What is finite as a float is valid in every format; only otherwise it takes a closer look.
    if words.clone().all(|word| word.is_valid(Format::F32)) {
        return Ok(());
    }
    match (0_u16..).zip(words).find(|(_, word)| !word.is_valid(data_type.format)) {
        Some((word, _)) => Err(FrameError::NotFinite { signal: data_type.first(), word }),
        None => Ok(()),
    }
}
