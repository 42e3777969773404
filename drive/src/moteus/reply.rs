//! Parser of a drive's replies.

use core::fmt;

use super::NOP;

/// Reason for rejecting a reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MoteusReplyError {
    /// The reply ends within a subframe.
    Truncated,
    /// A number has more than 32 bits.
    NumberTooLong,
    /// Unknown subframe.
    UnknownSubframe {
        /// First byte of the subframe.
        kind: u8,
    },
    /// The drive refused to write or read a register.
    Refused {
        /// Register number.
        register: u32,
        /// Error of the drive: 1 unknown register, 2 read-only, 3 invalid value.
        error: u32,
    },
    /// A queried register is missing.
    Missing {
        /// First missing register.
        register: u8,
    },
    /// Mode or fault is not an integer from 0 to 255.
    NotAnInteger {
        /// First such register.
        register: u8,
    },
}

impl fmt::Display for MoteusReplyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truncated => {
                f.write_str("reply ends within a subframe: check whether the bus truncates frames")
            }
            Self::NumberTooLong => {
                f.write_str("reply has a number above 32 bits: check that this id is a moteus drive")
            }
            Self::UnknownSubframe { kind } => {
                write!(f, "reply has unknown subframe {kind:#04x}: check that this id is a moteus drive")
            }
            Self::Refused { register, error } => {
                write!(
                    f,
                    "drive refused register {register:#05x}, error {error}: update the drive's firmware"
                )
            }
            Self::Missing { register } => {
                write!(f, "reply lacks register {register:#05x}: check for another host with this id")
            }
            Self::NotAnInteger { register } => {
                write!(
                    f,
                    "register {register:#05x} is not an integer from 0 to 255: update the drive's firmware"
                )
            }
        }
    }
}

impl core::error::Error for MoteusReplyError {}

/// Register value as received.
#[derive(Debug, Clone, Copy)]
pub(super) enum Value {
    Int8(i8),
    Int16(i16),
    Int32(i32),
    Float(f32),
}

/// Calls `show` for each register of a reply with its value, in order.
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

/// Unread bytes.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const LENGTH: usize>(&mut self) -> Result<[u8; LENGTH], MoteusReplyError> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(MoteusReplyError::Truncated)?;
        self.0 = rest;
        Ok(*taken)
    }

    /// Reads a number of 7 bits per byte, least significant first; the high bit marks continuation.
    fn varuint(&mut self) -> Result<u32, MoteusReplyError> {
        let mut number = 0_u64;
        for shift in [0, 7, 14, 21, 28] {
            let [byte] = self.take()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return u32::try_from(number).map_err(|_| MoteusReplyError::NumberTooLong);
            }
        }
        Err(MoteusReplyError::NumberTooLong)
    }

    /// Reads consecutive registers of a subframe; `kind` encodes their type and, up to three, their number.
    fn values(&mut self, kind: u8, show: &mut impl FnMut(u32, Value)) -> Result<(), MoteusReplyError> {
        let count = match kind & 0b11 {
            0 => self.varuint()?,
            count => u32::from(count),
        };
        let first = self.varuint()?;
        for index in 0..count {
            let value = self.value(kind >> 2 & 0b11)?;
            show(first.checked_add(index).ok_or(MoteusReplyError::NumberTooLong)?, value);
        }
        Ok(())
    }

    /// Not inlined: the stack analysis of images does not follow a jump table inside a loop.
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
