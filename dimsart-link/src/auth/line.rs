//! Lines that a key protects.

/// A line that a key protects. Each line has its own keys: a message of one line is invalid on another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum KeyDomain {
    /// Between two controllers: the link's number, which is the same at both ends.
    Link(u8),
    /// From a host, which seals requests, to a board, which opens them.
    Commands,
}

impl KeyDomain {
    pub(super) const fn to_bytes(self) -> [u8; 2] {
        match self {
            Self::Link(number) => [1, number],
            Self::Commands => [2, 0],
        }
    }
}
