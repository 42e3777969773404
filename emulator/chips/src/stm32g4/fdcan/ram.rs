//! Layout of message RAM (RM0440, "Message RAM": its figure misprints the start of RX FIFO 0).

/// 28 elements of one word.
pub(super) const STANDARD_FILTERS: u32 = 0x000;
/// 8 elements of two words.
pub(super) const EXTENDED_FILTERS: u32 = 0x070;
/// Both RX FIFOs, 3 elements each.
pub(super) const RX_FIFOS: [u32; 2] = [0x0B0, 0x188];
/// 3 elements of two words.
pub(super) const TX_EVENTS: u32 = 0x260;
/// 3 elements.
pub(super) const TX_BUFFERS: u32 = 0x278;
/// Size of a frame in a FIFO or a buffer: 18 words.
pub(super) const ELEMENT_BYTES: u32 = 72;

/// Word access to the bytes of message RAM.
#[derive(Debug)]
pub(super) struct Ram<'a>(pub(super) &'a mut [u8]);

impl Ram<'_> {
    pub(super) fn word(&self, offset: u32) -> u32 {
        let bytes = self.0.get(offset as usize..).and_then(|rest| rest.first_chunk());
        bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes))
    }

    pub(super) fn set(&mut self, offset: u32, value: u32) {
        if let Some(bytes) = self.0.get_mut(offset as usize..).and_then(|rest| rest.first_chunk_mut()) {
            *bytes = value.to_le_bytes();
        }
    }
}
