//! Fields of a record: little-endian numbers, and length-prefixed texts and bytes.

use mcap::records::op;

use super::Record;

/// The rest of a record; a truncated field is `None`.
#[derive(Debug)]
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (array, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*array)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn bytes(&mut self, count: u64) -> Option<&'a [u8]> {
        self.0.split_off(..usize::try_from(count).ok()?)
    }

    pub(super) fn text(&mut self) -> Option<String> {
        let count = self.u32()?;
        String::from_utf8(self.bytes(count.into())?.to_vec()).ok()
    }
}

/// A schema, channel or message.
pub(super) fn record(opcode: u8, body: &[u8]) -> Option<Record> {
    let mut fields = Fields(body);
    match opcode {
        op::SCHEMA => {
            let (id, _name, _encoding) = (fields.u16()?, fields.text()?, fields.text()?);
            let count = fields.u32()?;
            Some(Record::Schema { id, data: fields.bytes(count.into())?.to_vec() })
        }
        op::CHANNEL => {
            Some(Record::Channel { id: fields.u16()?, schema: fields.u16()?, topic: fields.text()? })
        }
        op::MESSAGE => {
            let (channel, _sequence) = (fields.u16()?, fields.u32()?);
            let (_log_time, _publish_time) = (fields.u64()?, fields.u64()?);
            Some(Record::Message { channel, data: fields.0.to_vec() })
        }
        _ => None,
    }
}

/// An attachment, whose checksum is verified if it has one.
pub(super) fn attachment(body: &[u8]) -> Option<Record> {
    let mut fields = Fields(body);
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let (name, _media_type, count) = (fields.text()?, fields.text()?, fields.u64()?);
    let data = fields.bytes(count)?.to_vec();
    let checked = body.get(..body.len() - fields.0.len())?;
    let crc = fields.u32()?;
    (crc == 0 || crc == crc32fast::hash(checked)).then_some(Record::Attachment { name, data })
}
