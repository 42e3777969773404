//! CAN frames to drives.

/// A classic CAN frame with a standard identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Frame {
    id: u16,
    bytes: [u8; 8],
    length: usize,
}

impl Cia402Frame {
    pub(super) fn new<const LENGTH: usize>(id: u16, data: [u8; LENGTH]) -> Self {
        const { assert!(LENGTH <= 8) };
        let mut bytes = [0; 8];
        bytes.iter_mut().zip(data).for_each(|(place, byte)| *place = byte);
        Self { id, bytes, length: LENGTH }
    }

    /// Returns the 11-bit identifier.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Returns the data.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}
