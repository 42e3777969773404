//! Takes a drive's reply apart.

use core::fmt;

use super::NOP;

/// Why a reply says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusReplyError {
    /// It ends within a subframe.
    Truncated,
    /// It has a number of more than 32 bits.
    Overlong,
    /// It has a subframe that is no part of a reply.
    UnknownSubframe {
        /// Its first byte.
        kind: u8,
    },
    /// The drive did not take what was written, or did not show what was asked for.
    Refused {
        /// Its number.
        register: u32,
        /// The drive's: 1 no such register, 2 not to be written, 3 no such value.
        error: u32,
    },
    /// It does not show all that was asked for.
    Missing {
        /// The first that is not there.
        register: u8,
    },
    /// It shows a mode or a fault that is not a whole number from 0 to 255.
    NoWholeNumber {
        /// The first such.
        register: u8,
    },
}

impl fmt::Display for MoteusReplyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated => {
                f.write_str("the reply ends within a subframe: are frames of the bus cut short?")
            }
            Self::Overlong => {
                f.write_str("the reply has a number of more than 32 bits: is this id a moteus drive's?")
            }
            Self::UnknownSubframe { kind } => {
                write!(
                    f,
                    "the reply has a subframe {kind:#04x}, none of a reply: is this id a moteus drive's?"
                )
            }
            Self::Refused { register, error } => {
                write!(f, "the drive refused register {register:#05x}, error {error}: update its firmware")
            }
            Self::Missing { register } => {
                write!(f, "the reply lacks register {register:#05x}: was it asked by another host?")
            }
            Self::NoWholeNumber { register } => {
                write!(
                    f,
                    "register {register:#05x} is no whole number from 0 to 255: update the drive's firmware"
                )
            }
        }
    }
}

impl core::error::Error for MoteusReplyError {}

/// A register's value as it came.
#[derive(Debug, Clone, Copy)]
pub(super) enum Value {
    Int8(i8),
    Int16(i16),
    Int32(i32),
    Float(f32),
}

/// Shows each register of a reply with its value, in order.
pub(super) fn read(reply: &[u8], mut show: impl FnMut(u32, Value)) -> Result<(), MoteusReplyError> {
    let mut bytes = Bytes(reply);
    while let Ok([kind]) = bytes.take() {
        match kind {
            NOP => {}
            0x20..=0x2f => bytes.values(kind, &mut show)?,
            0x30 | 0x31 => {
                let (register, error) = (bytes.varuint()?, bytes.varuint()?);
                return Err(MoteusReplyError::Refused { register, error });
            }
            kind => return Err(MoteusReplyError::UnknownSubframe { kind }),
        }
    }
    Ok(())
}

/// What is not read yet.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const LENGTH: usize>(&mut self) -> Result<[u8; LENGTH], MoteusReplyError> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(MoteusReplyError::Truncated)?;
        self.0 = rest;
        Ok(*taken)
    }

    /// A number of 7 bits a byte, the lowest first; all but the last have the highest bit.
    fn varuint(&mut self) -> Result<u32, MoteusReplyError> {
        let mut number = 0_u64;
        for shift in [0, 7, 14, 21, 28] {
            let [byte] = self.take()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return u32::try_from(number).map_err(|_| MoteusReplyError::Overlong);
            }
        }
        Err(MoteusReplyError::Overlong)
    }

    /// Registers in a row, of a subframe whose kind says their type and, up to three, their number.
    fn values(&mut self, kind: u8, show: &mut impl FnMut(u32, Value)) -> Result<(), MoteusReplyError> {
        let count = match kind & 0b11 {
            0 => self.varuint()?,
            count => u32::from(count),
        };
        let first = self.varuint()?;
        for index in 0..count {
            let value = self.value(kind >> 2 & 0b11)?;
            show(first.checked_add(index).ok_or(MoteusReplyError::Overlong)?, value);
        }
        Ok(())
    }

    /// Apart from the loop around it: a table of jumps in the middle of one is not followed by what bounds an image's stack.
    #[inline(never)]
    fn value(&mut self, width: u8) -> Result<Value, MoteusReplyError> {
        Ok(match width {
            0 => Value::Int8(i8::from_le_bytes(self.take()?)),
            1 => Value::Int16(i16::from_le_bytes(self.take()?)),
            2 => Value::Int32(i32::from_le_bytes(self.take()?)),
            _ => Value::Float(f32::from_le_bytes(self.take()?)),
        })
    }
}
