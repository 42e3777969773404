//! Encodes to postcard's format with small code.

use postcard::ser_flavors::Flavor;
use postcard::{Error, Result};
use serde::Serialize;

/// Writes a value to the start of `buffer`; `None` if it does not fit.
///
/// Replaces `postcard::to_slice`, which inlines the byte writer for every field of every type.
pub(crate) fn encode_into<'b>(value: &impl Serialize, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    postcard::serialize_with_flavor(value, Buffer { bytes: buffer, length: 0 }).ok()
}

struct Buffer<'b> {
    bytes: &'b mut [u8],
    length: usize,
}

impl<'b> Flavor for Buffer<'b> {
    type Output = &'b [u8];

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> Result<()> {
        self.try_extend(&[byte])
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> Result<()> {
        let room = self.bytes.get_mut(self.length..).and_then(|rest| rest.get_mut(..bytes.len()));
        room.ok_or(Error::SerializeBufferFull)?.copy_from_slice(bytes);
        self.length += bytes.len();
        Ok(())
    }

    fn finalize(self) -> Result<&'b [u8]> {
        self.bytes.get(..self.length).ok_or(Error::SerializeBufferFull)
    }
}
