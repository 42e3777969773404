//! Stable id of a module kind.

use core::fmt;
use core::num::NonZeroU16;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Identifies a module kind on the wire, in flash and in a stamp.
///
/// It is computed from the kind's [name](crate::Module::NAME): FNV-1a, both halves combined by exclusive or.
/// A list with two kinds of the same id does not compile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub struct KindId(NonZeroU16);

impl KindId {
    /// Computes the id of the kind with this name.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "the halves are combined")]
    pub const fn from_name(name: &str) -> Self {
        let mut hash: u32 = 0x811C_9DC5;
        let mut bytes = name.as_bytes();
        while let [byte, rest @ ..] = bytes {
            hash = (hash ^ *byte as u32).wrapping_mul(0x0100_0193);
            bytes = rest;
        }
        Self::from_bits((hash ^ (hash >> 16)) as u16)
    }

    /// Creates an id from its bits; 0 becomes 1.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Self {
        match NonZeroU16::new(bits) {
            Some(bits) => Self(bits),
            None => Self(NonZeroU16::MIN),
        }
    }

    /// Returns the bits.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0.get()
    }
}

/// Prints four hexadecimal digits.
impl fmt::Display for KindId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}", self.bits())
    }
}

/// Encodes two bytes, little endian.
impl Serialize for KindId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.bits().to_le_bytes().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for KindId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <[u8; 2]>::deserialize(deserializer).map(u16::from_le_bytes).map(Self::from_bits)
    }
}

#[cfg(test)]
mod tests {
    use super::KindId;

    #[test]
    fn an_id_follows_from_the_name_alone() {
        // By another implementation of FNV-1a.
        assert_eq!(KindId::from_name("PDCTRL_MOD"), KindId::from_bits(0x739E));
        assert_eq!(KindId::from_name(""), KindId::from_bits(0x811C ^ 0x9DC5));
    }
}
